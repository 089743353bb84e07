#include "client/viewer/replay_clock.hpp"

#include <algorithm>
#include <cmath>

namespace palpate {

double ReplayClock::speed() const { return std::ldexp(1.0, doublings_); }

Micros ReplayClock::at(Micros now) const {
  if (!playing_) return anchor_;
  return std::clamp(anchor_ + from_seconds(speed() * seconds(now - anchored_at_)), begin_, end_);
}

void ReplayClock::anchor(Micros moment, Micros now) {
  anchor_ = std::clamp(moment, begin_, end_);
  anchored_at_ = now;
}

void ReplayClock::toggle(Micros now) {
  const bool play = !playing(now);
  anchor(play && at(now) >= end_ ? begin_ : at(now), now);
  playing_ = play;
}

void ReplayClock::pause(Micros now) {
  anchor(at(now), now);
  playing_ = false;
}

void ReplayClock::seek(Micros moment, Micros now) { anchor(moment, now); }

void ReplayClock::double_speed(int n, Micros now) {
  anchor(at(now), now);
  doublings_ = std::clamp(doublings_ + n, -kMostDoublings, kMostDoublings);
}

}  // namespace palpate
