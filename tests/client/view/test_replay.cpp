// Playback of a recording: its clock, the moments that it shows, the bar under it, and damaged files.
#include <catch2/catch.hpp>
#include <random>

#include "client/view/replay_bar.hpp"
#include "client/viewer/recorded_scene.hpp"
#include "client/viewer/replay_clock.hpp"
#include "common/base/error.hpp"
#include "tests/common/record/small_recording.hpp"

using namespace palpate;

namespace {

constexpr int kFrames = 30;
constexpr Micros kSecond{1'000'000};

Micros frame_time(double k) { return test::kSmallBegin + from_seconds(k * seconds(test::kSmallFrame)); }

std::string refusal(std::span<const std::byte> bytes) {
  try {
    const RecordingReader recording(bytes, "some.rec");
    const RecordedScene scene(recording, "some.rec");
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

/// A recording without an end, of the small body with only these shapes: (seconds, k).
std::vector<std::byte> with_shapes(const std::vector<std::pair<double, int>>& shapes) {
  RecordingWriter writer(test::small_head());
  for (const auto& [t_s, k] : shapes) writer.add_shape(from_seconds(t_s), test::small_shape(k));
  writer.finish();
  return writer.take();
}

}  // namespace

TEST_CASE("A played recording goes forward at its speed, stands when paused and stops at its end", "[view][replay]") {
  ReplayClock clock(10 * kSecond, 20 * kSecond);
  CHECK(clock.at(99 * kSecond) == 10 * kSecond);
  CHECK_FALSE(clock.playing(99 * kSecond));
  clock.toggle(100 * kSecond);
  CHECK(clock.at(102 * kSecond) == 12 * kSecond);
  clock.double_speed(1, 102 * kSecond);
  CHECK(clock.at(104 * kSecond) == 16 * kSecond);
  clock.toggle(104 * kSecond);
  CHECK(clock.at(150 * kSecond) == 16 * kSecond);
  clock.toggle(150 * kSecond);
  CHECK(clock.playing(151 * kSecond));
  CHECK(clock.at(153 * kSecond) == 20 * kSecond);
  CHECK_FALSE(clock.playing(153 * kSecond));
  clock.toggle(160 * kSecond);  // at the end it plays again
  CHECK(clock.at(161 * kSecond) == 12 * kSecond);
  clock.double_speed(-9, 161 * kSecond);
  CHECK(clock.speed() == 0.125);
  CHECK(clock.at(169 * kSecond) == 13 * kSecond);
}

TEST_CASE("A moment that is gone to is shown, within the recording, and playing goes on from there", "[view][replay]") {
  ReplayClock clock(10 * kSecond, 20 * kSecond);
  clock.toggle(Micros{0});
  clock.seek(17 * kSecond, kSecond);
  CHECK(clock.at(2 * kSecond) == 18 * kSecond);
  clock.seek(3 * kSecond, 2 * kSecond);
  CHECK(clock.at(2 * kSecond) == 10 * kSecond);
  clock.seek(33 * kSecond, 2 * kSecond);
  CHECK(clock.at(3 * kSecond) == 20 * kSecond);
}

TEST_CASE("Between what was recorded, vertices and tools move straight", "[view][replay]") {
  const auto bytes = test::small_recording(kFrames, true);
  const RecordingReader recording(bytes, "small");
  RecordedScene scene(recording, "small");
  REQUIRE(scene.mesh().triangles.size() == 4);
  CHECK(scene.begin() == recording.begin());
  CHECK(scene.end() == recording.end());
  for (const double k : {0.0, 3.0, 3.5, 10.25, 28.9}) {
    const ViewMoment moment = scene.at(frame_time(k));
    CHECK(moment.shape.positions[3].z() == Approx(0.1 - 0.001 * k).margin(5e-6));
    REQUIRE(moment.tools.size() == 1);
    CHECK(moment.tools[0].station == "hand");
    CHECK(moment.tools[0].position.x() == Approx(0.01 * k).margin(1e-6));
    CHECK(moment.tools[0].force.z() == Approx(0.25 * k).margin(1e-5));
    CHECK(moment.tools[0].contact == (k > 2));
  }
  CHECK(scene.displacement_max_m() == Approx(0.029).margin(1e-5));
  CHECK(scene.force_max_n() == Approx(7.25));
}

TEST_CASE("Each hand of a recording is shown with the tool that it held", "[view][replay]") {
  RecordingHead head = test::small_head();
  head.tool = {{Vec3(0, 0, 64 * kToolStepM), 32 * kToolStepM}};
  const ToolShape bar{{Vec3::Zero(), 16 * kToolStepM}, {Vec3(0, 0, 128 * kToolStepM), 16 * kToolStepM}};
  RecordingWriter writer(head);
  RecordedEvent joined{test::kSmallBegin, RecordedEventKind::joined, 3, RecordedRole::hand, Scheme::port, "left", ""};
  writer.add(joined);
  joined.station = 4;
  joined.name = "right";
  joined.tool = {"bar", bar};
  writer.add(joined);
  writer.add(RecordedFrame{frame_time(0), Micros{1000}, Micros{1000}, 0, 1, 0, 0, false});
  writer.add_shape(frame_time(0), test::small_shape(1));
  writer.finish();
  const auto bytes = writer.take();
  const RecordingReader recording(bytes, "tools.rec");
  const RoomView room = RecordedScene(recording, "tools.rec").room_at(frame_time(0));
  CHECK(shape_held(room, "left") == head.tool);
  CHECK(shape_held(room, "right") == bar);
}

TEST_CASE("A moment looks the same however it was reached", "[view][replay]") {
  const auto bytes = test::small_recording(kFrames, true);
  const RecordingReader recording(bytes, "small");
  RecordedScene straight(recording, "small"), jumping(recording, "small");
  std::mt19937 random(3);
  for (int k = 0; k < 2 * (kFrames - 1); ++k) {
    const Micros t = frame_time(0.5 * k);
    jumping.at(frame_time(std::uniform_real_distribution(0.0, kFrames - 1.0)(random)));
    const ViewMoment a = straight.at(t), b = jumping.at(t);
    CHECK(a.shape.positions == b.shape.positions);
    CHECK(a.tools[0].position == b.tools[0].position);
  }
}

TEST_CASE("A body that lay still begins to move one shape before the first that moved", "[view][replay]") {
  const auto bytes = with_shapes({{0, 0}, {0.6, 10}});
  const RecordingReader recording(bytes, "still");
  RecordedScene scene(recording, "still");
  const auto z = [&](double t_s) { return scene.at(from_seconds(t_s)).shape.positions[3].z(); };
  CHECK(z(0.45) == Approx(0.1).margin(1e-6));
  CHECK(z(0.55) == Approx(0.095).margin(5e-6));
  CHECK(z(0.6) == Approx(0.09).margin(5e-6));
}

TEST_CASE("Panels of a recording say what links, patches and frames were", "[view][replay]") {
  const auto bytes = test::small_recording(kFrames, true);
  const RecordingReader recording(bytes, "small");
  const RecordedScene scene(recording, "small");
  const RoomView room = scene.room_at(frame_time(25.2));
  CHECK(room.nodes == 5);
  CHECK(room.frame_time == Micros{4000});
  CHECK(room.rate_hz == Approx(20));
  CHECK(room.real_time_factor == Approx(50.0 / 4));
  REQUIRE(room.stations.size() == 1);
  const StationView& hand = room.stations[0];
  CHECK(hand.station == "hand");
  CHECK(hand.rtt == Micros{40'000});
  CHECK(hand.jitter == Micros{900});
  CHECK(hand.patch_age == Micros{90'000});
  CHECK(hand.states == 16);
  CHECK(hand.judged == 25);  // one datagram per frame since the first report
  CHECK(hand.lost == 0);
  History forces, ages;
  scene.plot(frame_time(25.2), forces, ages);
  REQUIRE(forces.series().size() == 1);
  CHECK(forces.series()[0].points.size() == 26);
  CHECK(forces.series()[0].points.back().value == Approx(0.25 * 25));
  CHECK(ages.series()[0].points.back().value == Approx(90));
}

TEST_CASE("A recording has its task's progress at any moment, and its notes by their moments", "[view][replay]") {
  RecordingWriter writer(test::small_head());  // hold 0.5 to 2 N for 3 s
  writer.add(RecordedEvent{test::kSmallBegin, RecordedEventKind::joined, 3, RecordedRole::hand, Scheme::port, "hand", ""});
  constexpr int kLong = 700, kReset = 450;
  for (int k = 0; k < kLong; ++k) {
    if (k == kReset)
      writer.add(
          RecordedEvent{frame_time(k) - Micros{1}, RecordedEventKind::reset, 3, RecordedRole::hand, Scheme::port, "hand", ""});
    writer.add(RecordedFrame{frame_time(k), Micros{1000}, Micros{1000}, 0, 1, 0, 0, false});
    RecordedTouch touch = test::small_touch(4);
    touch.t = frame_time(k);
    touch.force = Vec3(0, 0, k % 90 < 30 ? 1 : 3);
    writer.add(touch);
    if (k % 300 == 10) writer.add(RecordedNote{frame_time(k), 9, frame_time(620 - k), "Weber", std::to_string(k)});
  }
  writer.add_shape(frame_time(0), test::small_shape(1));
  writer.finish();
  const auto bytes = writer.take();
  const RecordingReader recording(bytes, "task.rec");
  const RecordedScene scene(recording, "task.rec");

  TaskWatch watch;  // as a viewer follows it
  watch.take(*recording.head().task);
  std::map<int, std::pair<double, double>> seen;
  for (int k = 0; k < kLong; ++k) {
    watch.take_resets(k >= kReset);
    watch.take(Tools{0, frame_time(k), 0, {{"hand", Vec3::Zero(), Vec3(0, 0, k % 90 < 30 ? 1 : 3), true}}});
    seen[k] = {watch.hands().front().progress.score, watch.hands().front().progress.time_s};
  }
  for (const int k : {699, 0, 1, 99, 100, 101, 250, 449, 450, 451, 20, 690}) {
    const auto hands = scene.task_at(frame_time(k)).hands();
    REQUIRE(hands.size() == 1);
    CHECK(hands[0].station == "hand");
    CHECK(hands[0].progress.score == seen[k].first);
    CHECK(hands[0].progress.time_s == seen[k].second);
  }
  CHECK(scene.task_at(frame_time(-1)).hands().empty());
  CHECK(scene.task_at(frame_time(200)).task()->text == "hold");
  REQUIRE(scene.notes().size() == 3);
  CHECK(scene.notes()[0].text == "610");
  CHECK(scene.notes()[2].text == "10");
}

TEST_CASE("What is held fast is recorded and marked", "[view][replay]") {
  RecordingHead head = test::small_head();
  head.surface.marks = {0, 0, 0, 0};
  for (const std::size_t v : {1, 3}) head.surface.marks[v] = kFixedMark;
  RecordingWriter writer(head);
  writer.add_shape(Micros{0}, test::small_shape(0));
  writer.finish();
  const auto bytes = writer.take();
  const RecordingReader recording(bytes, "held");
  const RecordedScene scene(recording, "held");
  for (std::size_t v = 0; v < 4; ++v) CHECK(scene.mesh().vertices[v].fixed == (v == 1 || v == 3));
}

TEST_CASE("The bar shows the force of a touch without gaps, also when it has more parts than the recording frames",
          "[view][replay]") {
  const auto bytes = test::small_recording(kFrames, true);
  const RecordingReader recording(bytes, "small");
  const RecordedScene scene(recording, "small");
  REQUIRE(scene.course().size() == RecordedScene::kCourseParts);
  const double first_s = seconds(scene.begin() - test::kSmallBegin), span_s = seconds(scene.end() - scene.begin());
  for (std::size_t part = 0; part < scene.course().size(); ++part) {
    const double share = (static_cast<double>(part) + 0.5) / RecordedScene::kCourseParts;
    const double frame = (first_s + share * span_s) / seconds(test::kSmallFrame);
    if (frame > 3.2) CHECK(scene.course()[part] == Approx(std::floor(frame) / (kFrames - 1)).margin(0.04));
    if (frame < 2.8) CHECK(scene.course()[part] == 0);
  }
}

TEST_CASE("A recording without a body to draw is refused in a line that says what was expected", "[view][replay]") {
  RecordingHead head = test::small_head();
  const auto ended = [](const RecordingHead& h, bool shape) {
    RecordingWriter writer(h);
    if (shape) writer.add_shape(Micros{0}, test::small_shape(0));
    writer.finish();
    return writer.take();
  };
  const std::string empty = refusal(ended(head, false));
  CHECK(empty.find("some.rec") == 0);
  CHECK(empty.find("holds no shape") != std::string::npos);
  head.surface = recorded_surface(test::small_shape(0), {}, 5);
  CHECK(refusal(ended(head, true)).find("no triangles") != std::string::npos);
  head.kind = RecordingKind::station;
  head.surface = {};
  CHECK(refusal(ended(head, false)).find("of a station") != std::string::npos);
  for (const auto& text : {empty, refusal({})}) CHECK(text.find('\n') == std::string::npos);
}

TEST_CASE("A recording cut off at any byte plays up to the cut or is refused", "[view][replay]") {
  const auto whole = test::small_recording(20, true);
  std::size_t played = 0;
  for (std::size_t n = 0; n < whole.size(); ++n) {
    try {
      const std::span<const std::byte> cut(whole.data(), n);
      const RecordingReader recording(cut, "cut");
      RecordedScene scene(recording, "cut");
      const ViewMoment last = scene.at(scene.end());
      CHECK(last.shape.positions.size() == 4);
      CHECK(last.tools.size() == 1);
      ++played;
    } catch (const InputError&) {
    }
  }
  CHECK(played > whole.size() / 3);
  CHECK(played < whole.size());
}

TEST_CASE("Flipped bits cost what they hit, never the program", "[view][replay]") {
  const auto whole = test::small_recording(20, true);
  std::mt19937 random(9);
  for (int k = 0; k < 2000; ++k) {
    auto bytes = whole;
    bytes[std::uniform_int_distribution<std::size_t>(0, bytes.size() - 1)(random)] ^= std::byte(1 << (k % 8));
    try {
      const RecordingReader recording(bytes, "flipped");
      RecordedScene scene(recording, "flipped");
      for (const Micros t : {scene.begin(), scene.end()})
        for (const auto& x : scene.at(t).shape.positions) CHECK(x.allFinite());
    } catch (const InputError&) {
    }
  }
}

TEST_CASE("The replay bar leads to the moment under the pointer, and to the ends beside it", "[view][replay]") {
  for (const float scale : {0.72F, 1.0F, 2.0F}) {
    const ReplayBar bar(1280 * scale, 800 * scale, scale);
    const ReplayState state{kSecond, 11 * kSecond, kSecond, 1, false, {}};
    const float middle = 0.5F * (bar.left + bar.right), y = 0.5F * (bar.top + bar.bottom);
    CHECK(std::abs((bar.moment_at(state, middle) - 6 * kSecond).count()) < 5);
    CHECK(bar.moment_at(state, 0) == kSecond);
    CHECK(bar.moment_at(state, 5000 * scale) == 11 * kSecond);
    CHECK(bar.on_track(middle, y));
    CHECK_FALSE(bar.on_track(middle, bar.top - 1));
    CHECK_FALSE(bar.on_track(bar.button_left + 1, y));
    CHECK(bar.on_button(bar.button_left + 1, y));
  }
}
