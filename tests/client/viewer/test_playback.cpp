#include <catch2/catch.hpp>
#include <random>

#include "client/viewer/playback.hpp"

using namespace palpate;

namespace {

constexpr Micros kPeriod{50'000}, kPath{30'000}, kOtherClock{987'654'321};

Shape moving(Micros body_time) {
  return {body_time, {Eigen::Vector3f(static_cast<float>(seconds(body_time - kOtherClock)), 0, 0)}, {}};
}

}  // namespace

TEST_CASE("Steady motion is shown steadily at the stated delay, whatever the jitter within the margin", "[view]") {
  Playback playback;
  std::mt19937 random(3);
  std::uniform_int_distribution<int> jitter_us(0, 14'000);
  Shape shape;
  std::vector<ToolView> tools;
  Micros frame{0}, arrival = kPath;
  int shown = 0;
  for (Micros now{0}; now < Micros{3'000'000}; now += Micros{4'000}) {
    for (; arrival <= now; arrival = frame + kPath + Micros{jitter_us(random) * (frame > Micros{500'000})}) {
      playback.add(moving(kOtherClock + frame), arrival);
      frame += kPeriod;
    }
    if (now < Micros{300'000}) continue;
    REQUIRE(playback.at(now, shape, tools));
    REQUIRE(shape.positions[0].x() == Approx(seconds(now - kPath - playback.delay())).margin(1e-5));
    ++shown;
  }
  REQUIRE(shown > 600);
  REQUIRE(playback.delay() >= kPeriod);
  REQUIRE(playback.delay() <= kPeriod + Micros{20'000});
}

TEST_CASE("When shapes stop the last one stays, and a body time that starts over starts the playback over", "[view]") {
  Playback playback;
  Shape shape;
  std::vector<ToolView> tools;
  REQUIRE_FALSE(playback.at(Micros{0}, shape, tools));
  for (int i = 0; i < 5; ++i) playback.add(moving(kOtherClock + i * kPeriod), kPath + i * kPeriod);
  REQUIRE(playback.at(Micros{9'000'000}, shape, tools));
  REQUIRE(shape.positions[0].x() == Approx(seconds(4 * kPeriod)));
  playback.add({Micros{77}, {Eigen::Vector3f(-1, 0, 0)}, {}}, Micros{9'100'000});
  REQUIRE(playback.at(Micros{9'100'000}, shape, tools));
  REQUIRE(shape.positions[0].x() == -1);
}

TEST_CASE("What nodal scalars are of is known with them, and newtons are not mixed with shares", "[view]") {
  Playback playback;
  for (int i = 0; i < 4; ++i) {
    Shape shape = moving(kOtherClock + i * kPeriod);
    shape.channel = i < 2 ? ShapeChannel::tension : ShapeChannel::support;
    shape.scalars = {i < 2 ? 5.0F : 0.5F};
    playback.add(shape, kPath + i * kPeriod);
  }
  Shape shape;
  std::vector<ToolView> tools;
  REQUIRE(playback.at(kPath + playback.delay() + 3 * kPeriod / 2, shape, tools));
  CHECK(shape.channel == ShapeChannel::tension);
  CHECK(shape.scalars[0] == 5);
  CHECK(shape.positions[0].x() == Approx(1.5 * seconds(kPeriod)));
  REQUIRE(playback.at(kPath + playback.delay() + 9 * kPeriod / 4, shape, tools));
  CHECK(shape.channel == ShapeChannel::support);
  CHECK(shape.scalars[0] == 0.5F);
}

TEST_CASE("A tool moves between its two reported places and new tools appear", "[view]") {
  Playback playback;
  const auto hand = [](double x, double f) { return ToolView{"hand", Vec3(x, 0, 0), Vec3(0, 0, f), true}; };
  for (int i = 0; i < 4; ++i) {
    const Micros t = kOtherClock + i * kPeriod;
    playback.add(moving(t), kPath + i * kPeriod);
    Tools tools{0, t, 0, {hand(i, 2 * i)}};
    if (i == 3) tools.tools.push_back({"second", Vec3(9, 9, 9), Vec3::Zero(), false});
    playback.add(tools, kPath + i * kPeriod);
  }
  Shape shape;
  std::vector<ToolView> tools;
  REQUIRE(playback.at(kPath + playback.delay() + kPeriod + kPeriod / 4, shape, tools));
  REQUIRE(tools.size() == 1);
  REQUIRE(tools[0].position.x() == Approx(1.25));
  REQUIRE(tools[0].force.z() == Approx(2.5));
  REQUIRE(playback.at(Micros{1'000'000}, shape, tools));
  REQUIRE(tools.size() == 2);
}

TEST_CASE("A tool turns and opens between its two reported orientations and openings", "[view]") {
  Playback playback;
  for (int i = 0; i < 4; ++i) {
    const Micros t = kOtherClock + i * kPeriod;
    playback.add(moving(t), kPath + i * kPeriod);
    const Eigen::Quaterniond held(Eigen::AngleAxisd(0.4 * i, Vec3::UnitY()));
    playback.add(Tools{0, t, 0, {{"pen", Vec3::Zero(), Vec3::Zero(), false, held, 1, "", 0.2 * i}}}, kPath + i * kPeriod);
  }
  Shape shape;
  std::vector<ToolView> tools;
  REQUIRE(playback.at(kPath + playback.delay() + kPeriod + kPeriod / 4, shape, tools));
  REQUIRE(tools.size() == 1);
  const Eigen::Quaterniond expected(Eigen::AngleAxisd(0.5, Vec3::UnitY()));
  CHECK(tools[0].orientation->angularDistance(expected) < 1e-9);
  CHECK(tools[0].opening == Approx(0.25));
  CHECK(tools[0].buttons == 1);
}
