// The moment of a recording to show: playing, paused, faster, slower, or after a seek.
//
//     moment(now) = anchor + speed * (now - anchored at),  clamped to the recording; playing stops at its end.
#pragma once

#include "common/base/types.hpp"

namespace palpate {

class ReplayClock {
 public:
  static constexpr int kMostDoublings = 3;  ///< speeds from 1/8 to 8

  /// Starts paused at the beginning. begin <= end.
  ReplayClock(Micros begin, Micros end) : begin_(begin), end_(end), anchor_(begin) {}

  Micros begin() const { return begin_; }
  Micros end() const { return end_; }
  Micros at(Micros now) const;
  bool playing(Micros now) const { return playing_ && at(now) < end_; }
  double speed() const;

  /// Plays or pauses; at the end it plays from the beginning.
  void toggle(Micros now);
  void pause(Micros now);
  /// Moves to this moment, clamped to the recording; keeps playing when it was.
  void seek(Micros moment, Micros now);
  /// Multiplies the speed by 2^n; n may be negative.
  void double_speed(int n, Micros now);

 private:
  void anchor(Micros moment, Micros now);

  Micros begin_, end_, anchor_, anchored_at_{};
  int doublings_ = 0;
  bool playing_ = false;
};

}  // namespace palpate
