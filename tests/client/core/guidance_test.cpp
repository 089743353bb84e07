// The coupling of two tools against its inequality, in time and in frequency, and where samples stop, jump or say too much.
#include "client/core/guidance.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <complex>
#include <deque>
#include <limits>
#include <numbers>
#include <random>

#include "small_world.hpp"

using namespace palpate;
using namespace std::chrono_literals;

namespace {

constexpr double kDt = 1e-3;

/// Two tools, coupled over a delay each way that may vary from sample to sample.
struct CoupledPair {
  struct Sent {
    Micros arrives, stamp;
    Vec3 position;
  };
  GuidanceCoupling ends[2];
  std::deque<Sent> under_way[2];
  Micros now{1'000'000}, delay[2]{10ms, 10ms}, jitter[2]{};
  Vec3 at[2]{Vec3::Zero(), Vec3::Zero()}, force[2]{Vec3::Zero(), Vec3::Zero()};
  std::mt19937 random{7};

  /// Advances by a tick with the tools at `at`; samples are sent every 8 ms.
  void tick() {
    now += 1ms;
    for (int to : {0, 1}) {
      const int from = 1 - to;
      if ((now.count() / 1000) % 8 == 0) {
        const auto later = Micros{
            static_cast<std::int64_t>(std::uniform_real_distribution<>(0, 1)(random) * static_cast<double>(jitter[to].count()))};
        under_way[to].push_back({now + delay[to] + later, now, at[from]});
      }
      const Micros reach = from_seconds(ends[from].reach_s());
      for (auto it = under_way[to].begin(); it != under_way[to].end();)
        if (it->arrives <= now) {
          ends[to].hear({it->stamp, it->position, reach, true}, now);
          it = under_way[to].erase(it);
        } else {
          ++it;
        }
    }
    for (int k : {0, 1}) force[k] = ends[k].tick({now, at[k]}, kDt);
  }
  void rest(Micros time) {
    for (const Micros end = now + time; now < end;) tick();
  }
  bool held() const { return ends[0].hand() == GuidanceHand::holds && ends[1].hand() == GuidanceHand::holds; }
};

/// Potential of the saturated spring.
double potential_j(double stiffness_n_m, double distance_m) {
  const double pull_n = stiffness_n_m * distance_m, most_n = GuidanceCoupling::kForceMostN;
  return pull_n <= most_n ? 0.5 * pull_n * distance_m : most_n * distance_m - 0.5 * most_n * most_n / stiffness_n_m;
}

PartnerTool partner_at(Micros stamp, const Vec3& position) { return {stamp, position, 20ms, true}; }

/// Runs one end with a partner at rest, which has sent a sample just before each tick.
Vec3 hold(GuidanceCoupling& end, Micros& now, Micros time, const Vec3& own, const Vec3& partner, Micros delay = 10ms) {
  Vec3 force = Vec3::Zero();
  for (const Micros until = now + time; now < until;) {
    now += 1ms;
    end.hear(partner_at(now - delay, partner), now);
    force = end.tick({now, own}, kDt);
  }
  return force;
}

}  // namespace

TEST_CASE("Two coupled tools give no more energy than the spring had at the beginning, however they move and the delays vary") {
  const auto [up_ms, down_ms, jitter_ms] = GENERATE(std::tuple{4, 4, 0}, std::tuple{50, 50, 0}, std::tuple{150, 150, 20},
                                                    std::tuple{300, 300, 40}, std::tuple{10, 300, 60});
  CAPTURE(up_ms, down_ms, jitter_ms);
  CoupledPair pair;
  pair.delay[0] = 1ms * up_ms;
  pair.delay[1] = 1ms * down_ms;
  pair.jitter[0] = pair.jitter[1] = 1ms * jitter_ms;
  pair.at[1] = Vec3(0.005, 0, 0);
  pair.rest(3s);
  REQUIRE(pair.held());
  const double stored_j = potential_j(pair.ends[0].stiffness_n_m(), (pair.at[1] - pair.at[0]).norm());
  std::mt19937 random(11);
  std::uniform_real_distribution<> phase(0, 2 * std::numbers::pi), hz(0.2, 6);
  double omega[2][3], start[2][3];
  for (int k : {0, 1})
    for (int axis = 0; axis < 3; ++axis) {
      omega[k][axis] = 2 * std::numbers::pi * hz(random);
      start[k][axis] = phase(random);
    }
  const Vec3 origin[2]{pair.at[0], pair.at[1]};
  double given_j = 0, most_j = 0;
  for (int n = 1; n <= 8000; ++n) {
    const double t = n * kDt, grown = std::min(1.0, t);
    for (int k : {0, 1}) {
      Vec3 next = origin[k];
      for (int axis = 0; axis < 3; ++axis)
        next[axis] += 0.02 * grown * (std::sin(omega[k][axis] * t + start[k][axis]) - std::sin(start[k][axis]));
      given_j += pair.force[k].dot(next - pair.at[k]);
      pair.at[k] = next;
    }
    pair.tick();
    most_j = std::max(most_j, given_j);
  }
  CHECK(most_j <= stored_j + 1e-6);
  CHECK(given_j < -0.01);  // they have absorbed energy on the whole
}

TEST_CASE("Two devices that nobody holds come to rest over any delay up to 300 ms each way") {
  const auto [up_ms, down_ms] = GENERATE(std::pair{2, 2}, std::pair{75, 75}, std::pair{300, 300}, std::pair{0, 300});
  CAPTURE(up_ms, down_ms);
  CoupledPair pair;
  pair.delay[0] = 1ms * up_ms;
  pair.delay[1] = 1ms * down_ms;
  Vec3 velocity[2]{Vec3(0.2, 0, 0), Vec3(0, -0.2, 0.1)};
  pair.at[1] = Vec3(0.03, 0, 0);
  constexpr double kMass = 0.075;
  for (int n = 0; n < 12'000; ++n) {
    pair.tick();
    if (!pair.held()) continue;  // they are let go when the hold begins
    for (int k : {0, 1}) {
      velocity[k] += kDt / kMass * pair.force[k];
      pair.at[k] += kDt * velocity[k];
    }
  }
  REQUIRE(pair.held());
  CHECK(velocity[0].norm() < 1e-3);
  CHECK(velocity[1].norm() < 1e-3);
  CHECK((pair.at[1] - pair.at[0]).norm() < 1e-3);
}

TEST_CASE("The spring has the stiffness for which the damping of the bound is within its limit") {
  const int delay_ms = GENERATE(1, 20, 50, 100, 200, 300);
  CoupledPair pair;
  pair.delay[0] = pair.delay[1] = 1ms * delay_ms;
  pair.rest(3s);
  REQUIRE(pair.held());
  const double round_s = pair.ends[0].reach_s() + pair.ends[1].reach_s();
  CHECK(pair.ends[0].reach_s() >= 1e-3 * delay_ms + GuidanceCoupling::kTargetS);
  CHECK(round_s <= 2e-3 * delay_ms + 2 * (GuidanceCoupling::kTargetS + 0.010));
  for (const GuidanceCoupling& end : pair.ends) {
    CHECK(end.damping_n_s_m() == Approx(end.stiffness_n_m() * round_s / 2));
    CHECK(end.damping_n_s_m() <= GuidanceCoupling::kDampingMostNSM * (1 + 1e-9));
    const bool at_limit = end.stiffness_n_m() == Approx(GuidanceCoupling::kStiffnessMostNM) ||
                          end.damping_n_s_m() == Approx(GuidanceCoupling::kDampingMostNSM);
    CHECK(at_limit);
  }
}

TEST_CASE("As sampled, the two ends are passive together at every frequency up to 65 Hz, and beyond it weaker than 15 g") {
  using Complex = std::complex<double>;
  const auto [delay_1_s, delay_2_s] =
      GENERATE(std::pair{0.002, 0.002}, std::pair{0.01, 0.02}, std::pair{0.1, 0.1}, std::pair{0.3, 0.3}, std::pair{0.0, 0.3});
  CAPTURE(delay_1_s, delay_2_s);
  const double tick_s = kDt, target_s = GuidanceCoupling::kTargetS, velocity_s = GuidanceCoupling::kVelocityS;
  const double round_s = delay_1_s + delay_2_s + 2 * (target_s + tick_s);
  const double k = GuidanceCoupling::stiffness_for(round_s), b = k * round_s / 2;
  const double a = kDt / (target_s + kDt), c = kDt / (velocity_s + kDt);
  for (double hz = 0.05; hz < 499; hz *= 1.01) {
    const double omega = 2 * std::numbers::pi * hz;
    const Complex back = std::polar(1.0, -omega * kDt);
    const Complex speed = (1.0 / back - 1.0) / kDt;  // mean over the tick in which the force is held
    const Complex target = a / (1.0 - (1 - a) * back), damper = b * c * (1.0 - back) / kDt / (1.0 - (1 - c) * back);
    const Complex own = (k + damper) / speed;
    const Complex other_1 = -k * target * std::polar(1.0, -omega * delay_1_s) / speed;
    const Complex other_2 = -k * target * std::polar(1.0, -omega * delay_2_s) / speed;
    // The Hermitian part [[Re own, z], [z*, Re own]] with z = (other_1 + other_2*) / 2 has to be positive semi-definite.
    const double margin = own.real() - 0.5 * std::abs(other_1 + std::conj(other_2));
    CAPTURE(hz);
    if (hz <= 65)
      REQUIRE(margin >= -1e-9 * b);
    else
      REQUIRE(std::abs(own) + std::max(std::abs(other_1), std::abs(other_2)) < 0.015 * omega);
  }
}

TEST_CASE("A hold begins at zero, and no sample makes a step of the force") {
  GuidanceCoupling end;
  Micros now{1'000'000};
  std::mt19937 random(3);
  std::uniform_real_distribution<> place(-0.3, 0.3), share(0, 1);
  Vec3 before = Vec3::Zero();
  double step_n = 0, most_n = 0;
  Vec3 partner = Vec3(0.3, 0, 0);
  for (int n = 0; n < 20'000; ++n) {
    now += 1ms;
    if (n % 50 == 0) partner = Vec3(place(random), place(random), place(random));
    const auto reach = Micros{static_cast<std::int64_t>(1e6 * 0.4 * share(random))};
    if (share(random) < 0.97) end.hear({now - reach, partner, reach, share(random) < 0.95}, now);
    const Vec3 force = end.tick({now, Vec3::Zero()}, kDt);
    if (n == 0) CHECK(force.norm() < 0.02);
    step_n = std::max(step_n, (force - before).norm());
    most_n = std::max(most_n, force.norm());
    before = force;
  }
  CHECK(step_n < GuidanceCoupling::kStepMostN);
  CHECK(most_n > 0.5);
  CHECK(most_n <= GuidanceCoupling::kForceMostN * (1 + 1e-9));
}

TEST_CASE("Where samples stop, or the partner objects, the force is gone within a quarter of a second") {
  const bool objects = GENERATE(false, true);
  GuidanceCoupling end;
  CHECK(end.idle());
  Micros now{1'000'000};
  const Vec3 force = hold(end, now, 1s, Vec3::Zero(), Vec3(0.01, 0, 0));
  CHECK_FALSE(end.idle());
  REQUIRE(force.norm() == Approx(2).epsilon(0.01));  // 200 N/m
  Vec3 before = force;
  int ticks = 0;
  while (end.hand() == GuidanceHand::holds && ticks < 1000) {
    now += 1ms;
    if (objects) end.hear({now, Vec3(0.01, 0, 0), 20ms, false}, now);
    const Vec3 next = end.tick({now, Vec3::Zero()}, kDt);
    CHECK((next - before).norm() < 0.05);
    before = next;
    ++ticks;
  }
  CHECK(ticks <= (objects ? 101 : 252));
  CHECK(before.norm() == 0);
  end.tick({now + 1ms, Vec3::Zero()}, kDt);
  CHECK(end.reach_s() == 0);
  CHECK(end.idle());
}

TEST_CASE("A partner whose delay is not known, or whose samples are too old, exerts no force") {
  GuidanceCoupling end;
  Micros now{1'000'000};
  for (int n = 0; n < 1000; ++n) {
    now += 1ms;
    end.hear({now - 10ms, Vec3(0.1, 0, 0), 0ms, true}, now);
    REQUIRE(end.tick({now, Vec3::Zero()}, kDt).norm() == 0);
  }
  CHECK(end.reach_s() > 0.010);
  CHECK(hold(end, now, 1s, Vec3::Zero(), Vec3(0.1, 0, 0), 700ms).norm() == 0);
}

TEST_CASE("Within a hold the stiffness only falls, and a new one begins anew") {
  GuidanceCoupling end;
  Micros now{1'000'000};
  hold(end, now, 1s, Vec3::Zero(), Vec3(0.005, 0, 0), 20ms);
  const double first = end.stiffness_n_m();
  CHECK(first == Approx(200));
  double before = first;
  for (const Micros delay : {200ms, 20ms, 100ms, 20ms}) {
    for (int n = 0; n < 500; ++n) {
      hold(end, now, 1ms, Vec3::Zero(), Vec3(0.005, 0, 0), delay);
      REQUIRE(end.stiffness_n_m() <= before + 1e-9);
      before = end.stiffness_n_m();
    }
  }
  CHECK(before == Approx(GuidanceCoupling::stiffness_for(0.2 + GuidanceCoupling::kTargetS + 0.001 + 0.02)));
  for (int n = 0; n < 300; ++n) end.tick({now += 1ms, Vec3::Zero()}, kDt);
  hold(end, now, 1s, Vec3::Zero(), Vec3(0.005, 0, 0), 20ms);
  CHECK(end.stiffness_n_m() == Approx(first));
}

TEST_CASE("A hand that pulls against the whole force for a second is let go, and held again after the tools have met for one") {
  GuidanceCoupling end;
  Micros now{1'000'000};
  const Vec3 partner(0.05, 0, 0), away = Vec3::Zero();
  hold(end, now, 1200ms, away, partner);
  CHECK(end.hand() == GuidanceHand::holds);
  hold(end, now, 300ms, away, partner);
  CHECK(end.hand() == GuidanceHand::released);
  CHECK(hold(end, now, 2s, away, partner).norm() == 0);
  hold(end, now, 900ms, partner, partner);
  CHECK(end.hand() == GuidanceHand::released);
  hold(end, now, 200ms, partner, partner);
  CHECK(end.hand() == GuidanceHand::holds);
}

TEST_CASE("A position that is not finite, or outside the world, never reaches the force") {
  GuidanceCoupling end;
  Micros now{1'000'000};
  hold(end, now, 1s, Vec3::Zero(), Vec3(0.01, 0, 0));
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 11.0}) {
    now += 1ms;
    end.hear(partner_at(now, Vec3(0, bad, 0)), now);
    const Vec3 force = end.tick({now, Vec3::Zero()}, kDt);
    CHECK(force.allFinite());
    CHECK(force.x() == Approx(2).epsilon(0.02));
  }
}

namespace {

/// Guide and trainee in the small world, whose tools move alike.
struct GuidedWorld : SmallWorld {
  ClientCore *guide = nullptr, *trainee = nullptr;
  explicit GuidedWorld(bool refuses = false) {
    link.delay = 40ms;
    ClientOptions options;
    options.hello.station = "OR 1";
    options.refuses_guidance = refuses;
    trainee = &add(1, options, 3s);
    options.hello.station = "OR 3";
    options.hello.guides = "OR 1";
    options.refuses_guidance = false;
    guide = &add(2, options, 77s);
  }
};

}  // namespace

TEST_CASE("Two clients of which one guides the other hold each other through the server, with one stiffness at both ends") {
  GuidedWorld world;
  world.run(2s);
  CHECK(world.guide->guidance(world.clock(2)) == GuidanceStatus{"OR 1", true, GuidanceHand::holds, GuidanceHand::holds});
  CHECK(world.trainee->guidance(world.clock(1)) == GuidanceStatus{"OR 3", false, GuidanceHand::holds, GuidanceHand::holds});
  const double apart_s = seconds(world.guide->haptic().guidance().reach + world.trainee->haptic().guidance().reach);
  CHECK(apart_s == Approx(0.160 + 2 * 0.022).margin(0.012));
  CHECK(world.guide->haptic().counts().holds == 1);
  CHECK(world.guide->haptic().counts().guided_ticks > 1000);
  CHECK(world.trainee->haptic().counts().guidance_mean_n() > 0.01);
  world.guide->leave();
  world.run(500ms);
  CHECK(world.trainee->haptic().guidance().hand == GuidanceHand::ready);
  world.run(1s);
  CHECK(world.trainee->guidance(world.clock(1)).partner.empty());
}

TEST_CASE("A hand that refuses guidance feels none, and its guide hears why") {
  GuidedWorld world(true);
  world.run(2s);
  CHECK(world.guide->guidance(world.clock(2)) == GuidanceStatus{"OR 1", true, GuidanceHand::refuses, GuidanceHand::ready});
  CHECK(world.trainee->guidance(world.clock(1)).partner.empty());
  for (const PeerId peer : {1u, 2u})
    for (const TickOutput& tick : world.places.at(peer).ticks) REQUIRE(tick.guidance.norm() == 0);
}

TEST_CASE("Guidance over a lossy link with jitter is held, and ends with the server") {
  GuidedWorld world;
  world.link = {60ms, 20ms, 0.05, 0.02};
  world.run(4s);
  CHECK(world.trainee->haptic().guidance().hand == GuidanceHand::holds);
  world.server.reset();
  world.run(400ms);
  CHECK(world.trainee->haptic().guidance().hand == GuidanceHand::ready);
  CHECK(world.places.at(1).ticks.back().guidance.norm() == 0);
}
