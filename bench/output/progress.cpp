#include "bench/output/progress.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <atomic>
#include <cstdio>
#include <memory>

#include "bench/output/experiment.hpp"

namespace palpate {
namespace {

constexpr std::chrono::milliseconds kTerminalFirst{1000}, kTerminalEach{200}, kLogEach{10'000};

std::atomic<bool> shows_already{false};

std::string about(double s) {
  if (s < 90) return fmt::format("{:.0f} s", s);
  if (s < 90 * 60) return fmt::format("{:.0f} min", s / 60);
  return fmt::format("{:.1f} h", s / 3600);
}

}  // namespace

std::string progress_line(const std::string& what, double share, double elapsed_s) {
  const std::string line = fmt::format("{:.0f} % of {}", 100 * share, what);
  return share > 0 ? line + ", about " + about(elapsed_s * (1 - share) / share) + " to go" : line;
}

Progress::Progress(std::string what)
    : what_(std::move(what)),
      outermost_(!shows_already.exchange(true)),
      terminal_(isatty(STDERR_FILENO) != 0),
      begin_(Clock::now()),
      next_(begin_ + (terminal_ ? kTerminalFirst : kLogEach)) {}

Progress::~Progress() {
  if (terminal_ && shown_) fmt::print(stderr, "\r\033[K");
  if (outermost_) shows_already = false;
}

void Progress::at(double share) {
  if (!outermost_) return;
  const std::lock_guard lock(mutex_);
  const auto now = Clock::now();
  if (now < next_) return;
  next_ = now + (terminal_ ? kTerminalEach : kLogEach);
  shown_ = true;
  const std::string line = progress_line(what_, share, std::chrono::duration<double>(now - begin_).count());
  fmt::print(stderr, "{}{}{}", terminal_ ? "\r\033[K" : program_name() + ": ", line, terminal_ ? "" : "\n");
  std::fflush(stderr);
}

std::function<void(const char*, double)> show_progress() {
  struct Parts {
    std::string what;
    std::unique_ptr<Progress> progress;
  };
  return [parts = std::make_shared<Parts>()](const char* what, double share) {
    if (!parts->progress || parts->what != what) {
      parts->progress.reset();  // before the constructor of the next one checks for others
      parts->what = what;
      parts->progress = std::make_unique<Progress>(what);
    }
    parts->progress->at(share);
  };
}

}  // namespace palpate
