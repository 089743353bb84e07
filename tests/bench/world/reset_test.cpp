// Hands on a body that is reset to rest feel no jump, over real cores and links in virtual time.
#include <catch2/catch.hpp>
#include <cmath>

#include "bench/world/world.hpp"
#include "client/device/replay_device.hpp"
#include "common/base/minimum_jerk.hpp"

using namespace palpate;

namespace {

constexpr double kTopM = 0.075;

/// Down onto touch-cube by 1 s, held to 4 s with a small oscillation, out, and down again.
Motion press(double x_m) {
  std::vector<MotionPoint> points;
  for (int i = 0; i <= 8000; ++i) {
    const double t = i * 1e-3;
    const double in = minimum_jerk(t - 0.5) - minimum_jerk((t - 4) / 0.5) + minimum_jerk(t - 5.5);
    points.push_back({t, Vec3(x_m, 0.05, kTopM + 0.003 - 0.009 * in + 0.0005 * std::sin(9 * t) * in)});
  }
  return Motion(std::move(points));
}

struct ResetFelt {
  Vec3 last = Vec3::Zero();
  double steepest_n = 0, at_reset_n = 0, quiet_n = 0, again_n = 0;
};

}  // namespace

TEST_CASE("A reset takes what hands feel away and gives it back without a step, seen by all stations") {
  const Scene scene = load_scene(std::string(PALPATE_SOURCE_DIR) + "/scenes/touch-cube.json");
  World world(scene, {});
  std::vector<ResetFelt> felt(2);
  std::vector<WorldStation*> stations;
  for (std::size_t k = 0; k < felt.size(); ++k) {
    ClientOptions options;
    options.hello.station = k == 0 ? "port" : "hyper";
    options.hello.scheme = k == 0 ? Scheme::port : Scheme::hyper;
    LinkSpec link;
    link.latency = Micros{30'000};
    link.jitter = Micros{5'000};
    link.loss = 0.03;
    link.seed = 10 * k + 1;
    stations.push_back(&world.add_station(options, std::make_unique<ReplayDevice>(press(k == 0 ? 0.03 : 0.07)), link));
    stations.back()->on_tick = [&, k](Micros t, const Vec3&, const TickOutput& out) {
      ResetFelt& f = felt[k];
      const double s = seconds(t), step_n = (out.force - f.last).norm(), force_n = out.force.norm();
      f.last = out.force;
      CHECK(out.force.allFinite());
      if (s > 2.9 && s < 3.0) f.at_reset_n = force_n;
      if (s > 3 && s < 4) f.steepest_n = std::max(f.steepest_n, step_n);
      if (s > 3.7 && s < 5) f.quiet_n = std::max(f.quiet_n, force_n);
      if (s > 7.4) f.again_n = force_n;
    };
  }
  world.at(Micros{3'000'000}, [&] { stations[0]->core().ask_reset(); });
  world.run_until(Micros{7'500'000});
  CHECK(world.server().counts().resets == 1);
  CHECK_FALSE(stations[0]->core().reset_pending());
  for (const ResetFelt& f : felt) {
    CHECK(f.at_reset_n > 0.5);
    CHECK(f.quiet_n < 1e-6);
    CHECK(f.steepest_n < std::max(0.05, 0.05 * f.at_reset_n));  // change per tick that goes unnoticed
    CHECK(f.again_n == Approx(f.at_reset_n).epsilon(0.3));
  }
}
