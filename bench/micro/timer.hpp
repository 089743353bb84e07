// Wall clock of this machine, and processor time of this program, which other load on the machine does not affect.
#pragma once

#include <chrono>
#include <cstdint>
#include <ctime>

namespace palpate {

inline std::int64_t steady_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

class Timer {
 public:
  std::int64_t ns() const { return steady_ns() - begin_; }
  double seconds() const { return static_cast<double>(ns()) * 1e-9; }

 private:
  std::int64_t begin_ = steady_ns();
};

class ProcessorTimer {
 public:
  double seconds() const { return static_cast<double>(std::clock() - begin_) / CLOCKS_PER_SEC; }

 private:
  std::clock_t begin_ = std::clock();
};

}  // namespace palpate
