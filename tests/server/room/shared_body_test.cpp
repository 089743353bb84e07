// What the patches of the other stations expect of a hand: its motion as far as its own past shows it to be predictable.
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>

#include "server/room/stepped_body.hpp"

using namespace palpate;

namespace {

constexpr Micros kSharedFrame{50'000}, kExpectedAge{100'000};

/// Body with one hand above it, two seconds into a motion.
class WatchedHand {
 public:
  explicit WatchedHand(const std::function<Vec3(double t_s)>& motion)
      : body_(load_scene(std::string(PALPATE_SOURCE_DIR) + "/scenes/touch-cube.json")) {
    const Vec3 home = home_of(body_.scene());
    Micros now{1'000'000};
    body_.start(now);
    for (int frame = 0; frame < 40; ++frame) {
      StationJob station;
      station.id = 1;
      station.scheme = Scheme::port;
      station.horizon = kExpectedAge;
      for (Micros t = now; t <= now + kSharedFrame; t += Micros{1000}) station.samples.push_back({t, home + motion(seconds(t))});
      FrameJob job;
      job.begin = now;
      job.target = now += kSharedFrame;
      job.frame = kSharedFrame;
      job.stations.push_back(station);
      body_.step(job);
    }
  }
  HandMotion hand() const { return body_.hand_motion(0); }
  HandMotion expected() const { return body_.predictable_motion(0); }

 private:
  SteppedBody body_;
};

}  // namespace

TEST_CASE("A hand that moves steadily is expected to move on, one that circles within a patch's age is not") {
  const WatchedHand steady([](double t_s) { return Vec3(0.01 * t_s, 0, 0); });
  CHECK(steady.hand().velocity.norm() == Approx(0.01).epsilon(1e-6));
  CHECK((steady.expected().velocity - steady.hand().velocity).norm() < 1e-5);
  Predictability path;
  const auto circle = [](double t_s) { return Vec3(0.003 * std::cos(25 * t_s), 0.003 * std::sin(25 * t_s), 0); };
  for (int k = 0; k <= 195; ++k) path.add(circle(1 + 0.01 * k), seconds(kExpectedAge));
  const WatchedHand swings(circle);
  CHECK(path.share() < 0.4);
  CHECK((swings.expected().velocity - path.share() * swings.hand().velocity).norm() < 1e-3 * swings.hand().velocity.norm());
  CHECK((swings.expected().acceleration - path.share() * swings.hand().acceleration).norm() <
        1e-3 * swings.hand().acceleration.norm());
  // Back from where it is now, not from where its past was last noted, a frame ago.
  const Vec3 back = path.back(circle(3));
  CHECK(back.norm() > 0.001);
  CHECK((swings.expected().back - back).norm() < 0.01 * back.norm());
  CHECK(steady.expected().back.norm() == 0);
}

TEST_CASE("The path that a patch expects of a hand begins with its velocity, and ends where the hand moved on and came back") {
  const HandMotion hand{Vec3(0.02, 0, -0.01), Vec3(0, 0.3, 0), Vec3(-0.002, 0.001, 0)};
  constexpr double kHorizonS = 0.2;
  const HandMotion path = expected_path(hand, kHorizonS);
  CHECK(path.velocity == hand.velocity);
  const Vec3 there = kHorizonS * path.velocity + 0.5 * kHorizonS * kHorizonS * path.acceleration;
  const Vec3 moved = moved_on({Vec3::Zero(), hand.velocity}, hand.acceleration, kHorizonS).position;
  CHECK((there - moved - hand.back).norm() < 1e-15);
}
