// Progress of a long command, in one line on stderr: percentage and expected remaining time.
//
// On a terminal the line is rewritten in place, from 1 s on, and erased at the end; elsewhere a line is added every 10 s. A
// shorter command prints nothing, nor does a part of something whose progress is already shown.
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
  /// `what` names the activity: "full model at 1 kHz".
  explicit Progress(std::string what);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// Reports that `share` is done, 0 to 1. Callable from any thread.
  void at(double share);
  /// Shows `line` instead, when the next line is due. Callable from any thread.
  void show(const std::string& line);
  double elapsed_s() const;

 private:
  using Clock = std::chrono::steady_clock;
  std::string what_;
  bool outermost_, terminal_, shown_ = false;
  Clock::time_point begin_, next_;
  std::mutex mutex_;
};

/// Progress of a command with steps whose duration is unknown: shows the step and for how long it has run.
class Steps {
 public:
  explicit Steps(std::size_t count);
  /// Begins the next step, called `what`: "balancing the body".
  void begin(const std::string& what);

 private:
  void watch(const std::stop_token& stop);
  std::size_t count_, step_ = 0;
  std::string what_;
  double begin_s_ = 0;
  Progress progress_{"the steps"};
  std::mutex mutex_;
  std::condition_variable_any ended_;
  std::jthread watcher_;  ///< ends first, as it uses the other members
};

/// Shows the progress of successive parts of a long activity, for ReplayOptions::progress.
std::function<void(const char* what, double share)> show_progress();

/// "40 % of full model at 1 kHz, about 2 min to go".
std::string progress_line(const std::string& what, double share, double elapsed_s);
/// "step 2 of 5: balancing the body, for 12 s".
std::string step_line(std::size_t step, std::size_t count, const std::string& what, double elapsed_s);

}  // namespace palpate
