// One hand that would use all available time, and one that only presses. Work is counted in Newton iterations.
#include <catch2/catch.hpp>
#include <filesystem>
#include <utility>

#include "common/base/random.hpp"
#include "common/motion/motion.hpp"
#include "common/player/player.hpp"
#include "server/room/room.hpp"

using namespace palpate;

namespace {

constexpr Micros kCostlyFrame{50'000};
constexpr StationId kPresses = 1, kFirstOfOthers = 2;

/// A hand presses 30 mm deep into the organ, and others follow the test.
class SharedOrgan {
 public:
  SharedOrgan()
      : scene_(load_scene(std::string(PALPATE_SOURCE_DIR) + "/scenes/organ.json")), room_(scene_), home_(home_of(scene_)) {
    low_ = high_ = home_;
    for (const Vec3& x : scene_.body.nodes) low_ = low_.cwiseMin(x), high_ = high_.cwiseMax(x);
    room_.start(now_);
  }

  template <class Other>
  FrameResult frame(std::size_t others, const Other& other) {
    FrameJob job;
    job.begin = now_ += std::exchange(left_out, Micros{});
    job.target = now_ + length;
    job.frame = kCostlyFrame;
    for (StationId id = kPresses; id < kFirstOfOthers + others; ++id) {
      StationJob hand;
      hand.id = id;
      hand.scheme = id == kPresses ? Scheme::port : Scheme::hold;
      hand.horizon = Micros{150'000};
      for (Micros t = now_ + kTick; t <= job.target; t += kTick)
        hand.samples.push_back({t, id == kPresses ? pressed(t) : other(id - kFirstOfOthers, t)});
      job.stations.push_back(hand);
    }
    now_ = job.target;
    return room_.run(job);
  }
  Vec3 anywhere(Random& random) const {
    const Vec3 share(random.uniform(0, 1), random.uniform(0, 1), random.uniform(0, 1));
    return low_ + share.cwiseProduct(high_ - low_);
  }
  const Vec3& home() const { return home_; }

  Micros now() const { return now_; }

  Micros length{kCostlyFrame};     ///< of a frame, longer where the room is behind
  Micros left_out{};               ///< body time dropped before the next frame
  Micros pressed_from{1'000'000};  ///< time at which the pressing hand is at the surface

 private:
  Vec3 pressed(Micros t) const { return home_ - Vec3(0, 0, 0.03 * std::clamp(seconds(t - pressed_from) / 0.3, -0.5, 1.0)); }

  Scene scene_;
  Room room_;
  Vec3 home_, low_, high_;
  Micros now_{1'000'000};
};

/// The hand that presses is lifted, and presses anew beside another that stays away: force at the end [N].
double pressed_anew_n(SharedOrgan& organ) {
  organ.pressed_from = organ.now() + Micros{800'000};
  const Vec3 away = organ.home() + Vec3(0, 0, 0.2);
  FrameResult result;
  for (int k = 0; k < 40; ++k) result = organ.frame(1, [&](std::size_t, Micros) { return away; });
  return result.stations.front().force.norm();
}

double alone_n() {
  SharedOrgan organ;
  return pressed_anew_n(organ);
}

}  // namespace

TEST_CASE("A hand that jumps about inside the body is let go of, and the hand beside it feels what it feels alone") {
  const int every = GENERATE(1, 5, 50);  // ms
  SharedOrgan organ;
  Random random(5);
  Vec3 at = organ.home();
  int iterations = 0, without = 0;
  FrameResult result;
  bool said = false;
  constexpr int kFrames = 40;
  for (int k = 0; k < kFrames; ++k) {
    result = organ.frame(1, [&](std::size_t, Micros t) {
      if (t.count() / 1000 % every == 0) at = organ.anywhere(random);
      return at;
    });
    iterations += result.newton_iterations;
    without += result.stations.front().patch ? 0 : 1;
    for (const StationId id : result.released) said |= id == kFirstOfOthers;
    for (const StationId id : result.released) CHECK(id == kFirstOfOthers);
    CHECK(result.newton_iterations < 600);  // for 5 steps of 10 ms; one hand needs 20, and may spend what two frames have, 400
  }
  CHECK(said);
  CHECK(without <= 1);
  CHECK(iterations < 60 * kFrames + 200);  // what frames before it left is spent once
  // Friction keeps a trace of where the other has shaken the contact to.
  CHECK(result.stations.front().force.norm() == Approx(alone_n()).epsilon(0.1));
  CHECK(pressed_anew_n(organ) == Approx(alone_n()).epsilon(0.01));
}

TEST_CASE("A hand that lies still keeps the body while another leaps into it, now and then or all the time") {
  const int every = GENERATE(20, 50, 100, 200);  // ms
  const std::uint64_t seed = GENERATE(1, 2, 3);
  CAPTURE(every, seed);
  SharedOrgan organ;
  Random random(seed);
  Vec3 at = organ.home();
  for (int k = 0; k < 100; ++k) {
    const FrameResult result = organ.frame(1, [&](std::size_t, Micros t) {
      if (t.count() / 1000 % every == 0) at = organ.anywhere(random);
      return at;
    });
    CHECK_FALSE(result.failed);
    for (const StationId id : result.released) CHECK(id == kFirstOfOthers);
    if (k > 20) CHECK(result.stations.front().force.norm() > 0.5);
  }
}

TEST_CASE("A hand that was let go of for what it cost may touch again after a while, from outside") {
  SharedOrgan organ;
  Random random(5);
  const Vec3 aside(0.03, 0, 0);
  bool dear = false;
  for (int k = 0; k < 40 && !dear; ++k)
    dear = !organ.frame(1, [&](std::size_t, Micros) { return organ.anywhere(random); }).released.empty();
  REQUIRE(dear);
  const auto stays = [&](double over_m) {
    return [&organ, aside, over_m](std::size_t, Micros) { return Vec3(organ.home() + aside + Vec3(0, 0, over_m)); };
  };
  FrameResult result;
  for (int k = 0; k < 30; ++k) {
    result = organ.frame(1, stays(-0.035));  // inside
    CHECK_FALSE(result.stations.back().contact);
    CHECK(result.stations.back().released);
  }
  CHECK_FALSE(result.stations.front().released);
  for (int k = 0; k < 4; ++k) result = organ.frame(1, stays(0.02));
  CHECK_FALSE(result.stations.back().released);
  for (int k = 0; k < 10; ++k) result = organ.frame(1, stays(-0.02 - 0.002 * k));
  CHECK(result.stations.back().contact);
  CHECK(result.released.empty());
}

TEST_CASE("A hand under which a body folds keeps it: a frame may take the work that frames before it left") {
  const Scene scene = load_scene(std::string(PALPATE_SOURCE_DIR) + "/scenes/organs/gallbladder.json");
  const Vec3 above(-0.0140634, -0.0030469, 0.0374058), pressed(-0.0146931, -0.0009509, 0.0276581);
  constexpr double kPressedWithinS = 0.3;
  Room room(scene);
  const Micros begin{1'000'000};
  room.start(begin);
  int most = 0;
  for (int k = 0; k < 16; ++k) {
    FrameJob job;
    job.begin = begin + k * kCostlyFrame;
    job.target = job.begin + kCostlyFrame;
    job.frame = kCostlyFrame;
    StationJob hand;
    hand.id = kPresses;
    hand.scheme = Scheme::hold;
    hand.horizon = Micros{50'000};
    for (Micros t = job.begin + kTick; t <= job.target; t += kTick) {
      const double s = std::min(seconds(t - begin) / kPressedWithinS, 1.0);
      hand.samples.push_back({t, above + s * s * s * (10 + s * (6 * s - 15)) * (pressed - above)});
    }
    job.stations.push_back(hand);
    const FrameResult result = room.run(job);
    most = std::max(most, result.newton_iterations);
    CHECK(result.released.empty());
    if (k > 4) CHECK(result.stations.front().contact);
  }
  CHECK(most > 200);  // what five steps may take by themselves
}

TEST_CASE("Spheres of an instrument that come and go on a body cost it no hand: none of the tasks is let go of") {
  const auto folder = std::filesystem::path(PALPATE_SOURCE_DIR) / "scenes/handling";
  for (const char* name : {"edge", "hole", "fold", "two-organs"}) {
    CAPTURE(name);
    Room room(load_scene((folder / name).replace_extension(".json")));
    const Motion motion = read_motion((folder / name).replace_extension(".csv"));
    const Micros begin{1'000'000};
    room.start(begin);
    FrameJob job;
    job.target = begin;
    job.frame = kCostlyFrame;
    int touched = 0;
    while (job.target < begin + motion.duration()) {
      job.begin = std::exchange(job.target, job.target + kCostlyFrame);
      StationJob hand;
      hand.id = kPresses;
      hand.scheme = Scheme::hold;
      hand.horizon = kCostlyFrame;
      for (Micros t = job.begin + kTick; t <= job.target; t += kTick)
        hand.samples.push_back({t, motion.position(t - begin), motion.orientation(t - begin)});
      job.stations = {hand};
      const FrameResult result = room.run(job);
      CHECK(result.released.empty());
      touched += result.stations.front().contact;
    }
    CHECK(touched > 50);
  }
}

TEST_CASE("Time that is left out moves nothing: the tool is led from where the body knew it to where it is") {
  SharedOrgan organ;
  const auto aside = [&](double over_m) {
    return [&organ, over_m](std::size_t, Micros) { return Vec3(organ.home() + Vec3(0.03, 0, over_m)); };
  };
  FrameResult before;
  for (int k = 0; k < 20; ++k) before = organ.frame(1, aside(-0.035));
  REQUIRE(before.stations.back().contact);
  organ.left_out = Micros{3'000'000};
  FrameResult result = organ.frame(1, aside(-0.045));
  CHECK(result.stamp == before.stamp + kCostlyFrame + Micros{3'000'000});
  CHECK(result.newton_iterations < 100);
  CHECK(result.stations.back().tool.z() == Approx(organ.home().z() - 0.04).margin(1e-3));  // half-way, as by ToolTrack::kLeadBack
  for (int k = 0; k < 3; ++k) result = organ.frame(1, aside(-0.045));
  CHECK(result.stations.back().tool.z() == Approx(organ.home().z() - 0.045).margin(1e-6));
  CHECK(result.stations.back().contact);
}

TEST_CASE("A hand that presses 37 mm deep at once is not let go of because frames are late") {
  SharedOrgan organ;
  organ.pressed_from = Micros::max() / 2;
  const Vec3 deep(0, 0, 0.05);
  std::size_t releases = 0;
  organ.frame(1, [&](std::size_t, Micros) { return Vec3(deep + Vec3(0, 0, 0.15)); });
  organ.length = Micros{400'000};
  organ.left_out = Micros{600'000};  // the hand is led down in 0.1 s
  FrameResult result;
  for (int k = 0; k < 4; ++k) {
    result = organ.frame(1, [&](std::size_t, Micros) { return deep; });
    releases += result.released.size();
    CHECK(result.newton_iterations < 1650);  // for 40 steps of 10 ms, or 20 of 20 ms
  }
  CHECK(releases == 0);
  CHECK(result.stations.back().force.norm() > 4);
}

TEST_CASE(
    "Fifteen hands that stir deep in the body are let go of at a bounded cost, and a hand that presses anew feels what it feels "
    "alone") {
  const double turns_hz = GENERATE(1, 5);
  SharedOrgan organ;
  constexpr std::size_t kHands = 15;
  std::size_t releases = 0;
  for (int k = 0; k < 30; ++k) {
    const FrameResult result = organ.frame(kHands, [&](std::size_t hand, Micros t) {
      const double turned = 2.4 * static_cast<double>(hand) + 2 * 3.14159 * turns_hz * seconds(t);
      const double far_m = 0.06 * std::sqrt((static_cast<double>(hand) + 0.5) / kHands);
      const double down_m = 0.07 * std::min(1.0, (seconds(t) - 1) / 0.3) - 0.01;
      return Vec3(organ.home() + Vec3(far_m * std::cos(turned), far_m * std::sin(turned), -down_m));
    });
    CHECK(result.newton_iterations <
          1100);  // what two frames have, 400, 200 calmed, four times 50, and by what each exceeds these
    releases += result.released.size();
  }
  CHECK(releases > 10);
  CHECK(pressed_anew_n(organ) == Approx(alone_n()).epsilon(0.01));
}
