// A short recording with a little of everything, for tests and the fuzz harness.
#pragma once

#include <cmath>
#include <vector>

#include "common/record/reader.hpp"
#include "common/record/writer.hpp"

namespace palpate::test {

/// A pyramid, and an inner vertex that no triangle uses.
inline RecordingHead small_head() {
  RecordingHead head;
  head.program = "test 1";
  head.name = "room";
  head.unix_time = Micros{1'800'000'000'000'000};
  head.clock_time = Micros{5'000'000};
  head.rate_hz = 20;
  head.shapes_hz = 10;
  head.scene = "{\"name\": \"pyramid\"}";
  head.scene_file = "pyramid.json";
  head.task = Task{"hold", PressTask{0.5, 2, 3}};
  head.parts = {{"roof", 0xff8000, 0.25, {{{Vec3(0, 0, 0.5)}, {Vec3(0.25, 0, 0.5)}, {Vec3(0, 0.25, 0.5)}}, {{0, 1, 2}}}}};
  const std::vector<Vec3> rest{{0, 0, 0}, {0.05, 0.05, 0.02}, {0.1, 0, 0}, {0, 0.1, 0}, {0, 0, 0.1}};
  head.bodies = {{"base", 0x102030}, {"peak", 0xffffff}};
  head.surface = recorded_surface(rest, {{0, 3, 2}, {0, 2, 4}, {0, 4, 3}, {2, 3, 4}}, 77);
  head.surface.marks = {kFixedMark, 0, kWallMark, kBodyMark};
  return head;
}

inline constexpr Micros kSmallBegin{5'000'000}, kSmallFrame{50'000};

/// Frame k of the small recording.
inline RecordedTouch small_touch(int k) {
  RecordedTouch touch;
  touch.t = kSmallBegin + k * kSmallFrame;
  touch.station = 3;
  touch.tool = Vec3(0.01 * k, 0, 0.1);
  touch.force = Vec3(0, 0, 0.25 * k);
  touch.torque = Vec3(0.125 * k, 0, 0);
  touch.contact = k > 2;
  touch.has_patch = true;
  touch.scheme = Scheme::port;
  touch.states = 16;
  touch.bytes = 1000;
  touch.horizon = Micros{120'000};
  return touch;
}

inline std::vector<Vec3> small_shape(int k) {
  std::vector<Vec3> shape{{0, 0, 0}, {0.05, 0.05, 0.02}, {0.1, 0, 0}, {0, 0.1, 0}, {0, 0, 0.1 - 0.001 * k}};
  return shape;
}

inline void add_small_frame(RecordingWriter& writer, int k) {
  const Micros t = kSmallBegin + k * kSmallFrame;
  RecordedPath path{3, {}};
  for (Micros s = t - kSmallFrame + Micros{1000}; s <= t; s += Micros{1000})
    path.samples.push_back({s, Vec3(0.2 * seconds(s - kSmallBegin), 0, 0.1)});
  writer.add(path);
  writer.add(RecordedFrame{t, Micros{4000}, Micros{60'000}, 0, 5, 1, 12, false});
  writer.add(small_touch(k));
  writer.add_shape(t, small_shape(k));
  writer.add(RecordedLink{t, 3, Micros{40'000}, Micros{38'000}, Micros{900}, Micros{90'000}, Micros{-1234},
                          100u + static_cast<unsigned>(k), 2});
  RecordedTick tick;
  tick.t = t;
  tick.position = Vec3(0, 0, 0.001 * k);
  tick.model_force = Vec3(0, 0, 2);
  tick.force = Vec3(0, 0, 1.5);
  tick.patch_age = Micros{70'000};
  tick.has_patch = tick.contact = true;
  if (k % 3 == 0) {
    tick.model_torque = Vec3(0.25, 0, 0);
    tick.torque = Vec3(0.125, 0, 0.5 * k);
  }
  writer.add(tick);
  writer.add(RecordedTurn{t, 3, Eigen::Quaterniond(std::cos(0.1 * k), std::sin(0.1 * k), 0, 0)});
  writer.add(RecordedButtons{t, 3, static_cast<std::uint32_t>(k % 4)});
  writer.add(RecordedGuidance{t, 3, 4, 0.25, 0.5 * k});
  if (k % 8 == 5) writer.add(RecordedNote{t, 9, t - Micros{30'000'000}, "Weber", k == 5 ? "too deep" : ""});
  RecordedCheckpoint checkpoint{
      t, small_shape(k), std::vector<Vec3>(5, Vec3(0, 0, -0.25 * k)), {{"hand", Vec3(0.01 * k, 0, 0.1)}}};
  if (k % 5 == 0) writer.add(checkpoint);
  writer.add(RecordedHandOver{t, t - Micros{70'000}, 0.125});
  writer.add(RecordedPacket{t, std::vector<std::byte>(10 + static_cast<std::size_t>(k), std::byte{7})});
  writer.tick(t);
}

/// Recording of `frames` frames of 50 ms.
inline std::vector<std::byte> small_recording(int frames, bool ended) {
  RecordingWriter writer(small_head());
  RecordedEvent joined{kSmallBegin, RecordedEventKind::joined, 3, RecordedRole::hand, Scheme::port, "hand", ""};
  writer.add(joined);
  for (int k = 0; k < frames; ++k) add_small_frame(writer, k);
  if (ended) writer.finish();
  return writer.take();
}

}  // namespace palpate::test
