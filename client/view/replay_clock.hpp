// Which moment of a recording is shown: playing, paused, faster, slower, gone to.
//
//     moment(now) = anchor + speed * (now - anchored at),  kept within the recording; playing ends at its end.
#pragma once

#include "common/base/types.hpp"

namespace palpate {

class ReplayClock {
 public:
  static constexpr int kMostDoublings = 3;  ///< speeds from 1/8 to 8

  /// Paused at the beginning. begin <= end.
  ReplayClock(Micros begin, Micros end) : begin_(begin), end_(end), anchor_(begin) {}

  Micros begin() const { return begin_; }
  Micros end() const { return end_; }
  Micros at(Micros now) const;
  bool playing(Micros now) const { return playing_ && at(now) < end_; }
  double speed() const;

  /// Plays or pauses; at the end it plays from the beginning.
  void toggle(Micros now);
  void pause(Micros now);
  /// To this moment, or the nearest there is; goes on playing when it was.
  void seek(Micros moment, Micros now);
  /// Twice as fast n times, -n times half as fast.
  void double_speed(int n, Micros now);

 private:
  void anchor(Micros moment, Micros now);

  Micros begin_, end_, anchor_, anchored_at_{};
  int doublings_ = 0;
  bool playing_ = false;
};

}  // namespace palpate
