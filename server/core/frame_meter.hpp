// Cost of the frames that stepped the body within the last second.
#pragma once

#include <deque>

#include "common/base/types.hpp"

namespace palpate {

class FrameMeter {
 public:
  static constexpr Micros kOver{1'000'000};

  struct Figures {
    int frames = 0;
    Micros took_mean{};           ///< mean time from a frame's start to its patches
    double real_time_factor = 0;  ///< simulated body time per time spent, 0 without a frame
  };

  void add(Micros finished, Micros took, Micros simulated) {
    frames_.push_back({finished, took, simulated});
    while (finished - frames_.front().finished >= kOver) frames_.pop_front();
  }
  Figures at(Micros now) const {
    Figures figures;
    Micros took{}, simulated{};
    for (const Frame& frame : frames_) {
      if (now - frame.finished >= kOver) continue;
      ++figures.frames;
      took += frame.took;
      simulated += frame.simulated;
    }
    if (figures.frames > 0) figures.took_mean = took / figures.frames;
    if (took > Micros{0}) figures.real_time_factor = seconds(simulated) / seconds(took);
    return figures;
  }

 private:
  struct Frame {
    Micros finished, took, simulated;
  };
  std::deque<Frame> frames_;
};

}  // namespace palpate
