// Progress of a long command, in one line on stderr: percentage and expected remaining time.
//
// On a terminal the line is rewritten in place, from 1 s on, and erased at the end; elsewhere a line is added every 10 s. A
// shorter command prints nothing, nor does a part of something whose progress is already shown.
#pragma once

#include <chrono>
#include <functional>
#include <mutex>
#include <string>

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

 private:
  using Clock = std::chrono::steady_clock;
  std::string what_;
  bool outermost_, terminal_, shown_ = false;
  Clock::time_point begin_, next_;
  std::mutex mutex_;
};

/// Shows the progress of successive parts of a long activity, for ReplayOptions::progress.
std::function<void(const char* what, double share)> show_progress();

/// "40 % of full model at 1 kHz, about 2 min to go".
std::string progress_line(const std::string& what, double share, double elapsed_s);

}  // namespace palpate
