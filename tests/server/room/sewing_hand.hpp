// A hand that goes along a line with a thread or a needle, alone in a room.
#pragma once

#include <cmath>
#include <utility>

#include "server/room/room.hpp"

namespace palpate::test {

class SewingHand {
 public:
  static constexpr Micros kFrame{50'000};

  /// `turn`: how it holds its tool.
  explicit SewingHand(const Scene& scene, const Orientation& turn = {}) : room_(scene), turn_(turn) { room_.start(Micros{}); }
  void begin_at(const Vec3& at) { at_ = at; }
  /// Presses a button in the coming frame.
  void press() { ++presses_; }
  /// Resets the body in the coming frame.
  void reset() { resets_ = true; }
  /// The hand leaves, and later ones are others.
  void leave() { ++id_; }
  /// Runs a frame in which the hand goes to a place.
  FrameResult frame(const Vec3& to) {
    StationJob station;
    station.id = id_;
    station.presses = presses_;
    station.horizon = Micros{100'000};
    for (Micros t = now_ + kTick; t <= now_ + kFrame; t += kTick) {
      const double part = static_cast<double>((t - now_).count()) / static_cast<double>(kFrame.count());
      station.samples.push_back({t, at_ + part * (to - at_), turn_});
    }
    at_ = to;
    FrameJob job;
    job.begin = now_;
    job.target = now_ += kFrame;
    job.frame = kFrame;
    job.stations = {station};
    job.shapes = job.state = true;
    job.reset = std::exchange(resets_, false);
    return room_.run(job);
  }
  /// Runs frames up to a place at a speed [m/s], and some more there.
  FrameResult go(const Vec3& to, double speed_m_s, int rest = 0) {
    const Vec3 from = at_;
    const int frames = static_cast<int>(std::ceil((to - from).norm() / (speed_m_s * seconds(kFrame))));
    FrameResult last;
    for (int k = 1; k <= frames; ++k) last = frame(from + static_cast<double>(k) / frames * (to - from));
    for (int k = 0; k < rest; ++k) last = frame(to);
    return last;
  }
  FrameResult press_here() {
    press();
    return frame(at_);
  }
  Room& room() { return room_; }

 private:
  Room room_;
  Orientation turn_;
  Micros now_{};
  Vec3 at_ = Vec3::Zero();
  StationId id_ = 1;
  std::uint32_t presses_ = 0;
  bool resets_ = false;
};

}  // namespace palpate::test
