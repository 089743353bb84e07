// How far a long command is, in one line on stderr: percent and the time that is still to be expected.
//
// On a terminal the line is written anew in its place, from 1 s on, and is gone at the end; elsewhere a line is added every 10 s.
// A command that is done sooner says nothing; nor does what is a part of something whose progress is shown already.
#pragma once

#include <chrono>
#include <functional>
#include <mutex>
#include <string>

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

 private:
  using Clock = std::chrono::steady_clock;
  std::string what_;
  bool outermost_, terminal_, shown_ = false;
  Clock::time_point begin_, next_;
  std::mutex mutex_;
};

/// Hears of the parts of something long one after the other, as ReplayOptions::progress does.
std::function<void(const char* what, double share)> show_progress();

/// "40 % of full model at 1 kHz, about 2 min to go".
std::string progress_line(const std::string& what, double share, double elapsed_s);

}  // namespace palpate
