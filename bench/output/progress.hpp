// How far a long command is, in one line on stderr: percent and the time that is still to be expected.
//
// On a terminal the line is written anew in its place, from 1 s on, and is gone at the end; elsewhere a line is added every 10 s.
// A command that is done sooner says nothing; nor does what is a part of something whose progress is shown already.
#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

namespace palpate {

class Progress {
 public:
  /// `what` is being done: "full model at 1 kHz".
  explicit Progress(std::string what);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// `share` of it is done, 0 to 1. From any thread.
  void at(double share);
  /// The line in other words, when it is time for one. From any thread.
  void show(const std::string& line);
  double elapsed_s() const;

 private:
  using Clock = std::chrono::steady_clock;
  std::string what_;
  bool outermost_, terminal_, shown_ = false;
  Clock::time_point begin_, next_;
  std::mutex mutex_;
};

/// The same for a command that goes in steps which cannot tell how far they are: which step, and for how long it has run.
class Steps {
 public:
  explicit Steps(std::size_t count);
  /// The next one, called `what`: "balancing the body".
  void begin(const std::string& what);

 private:
  void watch(const std::stop_token& stop);
  std::size_t count_, step_ = 0;
  std::string what_;
  double begin_s_ = 0;
  Progress progress_{"the steps"};
  std::mutex mutex_;
  std::condition_variable_any ended_;
  std::jthread watcher_;  ///< ends first: it shows the rest
};

/// Hears of the parts of something long one after the other, as ReplayOptions::progress does.
std::function<void(const char* what, double share)> show_progress();

/// "40 % of full model at 1 kHz, about 2 min to go".
std::string progress_line(const std::string& what, double share, double elapsed_s);
/// "step 2 of 5: balancing the body, for 12 s".
std::string step_line(std::size_t step, std::size_t count, const std::string& what, double elapsed_s);

}  // namespace palpate
