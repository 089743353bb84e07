#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bench/world/draw.hpp"
#include "common/wire/codec.hpp"
#include "server/room/room.hpp"

namespace palpate {
namespace {

/// Log-uniform.
double spread(Random& random, double low, double high) { return low * std::pow(high / low, random.uniform()); }

LinkSpec draw_link(Random& random, double latency_s, bool losses) {
  LinkSpec link;
  link.latency = from_seconds(latency_s * random.uniform(0.75, 1.3));
  link.jitter = from_seconds(std::min(random.chance(0.3) ? 0.0 : random.uniform(0, 0.02), 0.5 * latency_s));
  const double loss = random.chance(0.4) ? 0.0 : spread(random, 0.002, 0.3);
  const double burst = random.chance(0.5) ? 0.0 : random.uniform(2, 6);
  const double duplicate = random.chance(0.6) ? 0.0 : random.uniform(0, 0.1);
  const double reorder = random.chance(0.6) ? 0.0 : random.uniform(0, 0.1);
  if (losses) {
    link.loss = loss;
    link.burst_mean = burst;
    link.duplicate = duplicate;
    link.reorder = reorder;
  }
  link.seed = random.bits();
  return link;
}

void draw_links(const Scenario& s, std::size_t index, StationPlan& plan) {
  Random random = part_of(s.drawn_with.seed, Part::link, index);
  const double latency_s = random.chance(0.05) ? random.uniform(0.2, 0.5) : spread(random, 0.0002, 0.12);
  plan.up = draw_link(random, latency_s, s.drawn_with.losses);
  plan.down = draw_link(random, latency_s, s.drawn_with.losses);
  plan.client.send_interval = pick(random, {Micros{2000}, Micros{2000}, Micros{4000}, Micros{8000}});
}

void draw_clock(const Scenario& s, std::size_t index, StationPlan& plan) {
  Random random = part_of(s.drawn_with.seed, Part::clock, index);
  const double drift = random.uniform(-100, 100);
  plan.drift_ppm = s.drawn_with.drift ? drift : 0;
}

int draw_order(const Scenario& s, Random& random) {
  const int most = max_port_modes(s.scene.tool.contact);
  return random.chance(0.6) ? 0 : 2 * (2 + static_cast<int>(random.bits() % static_cast<std::uint64_t>(most - 1)));
}

/// With the schemes that Palpate replaced a simulated hand may well be unstable, so only a recorded motion feels them.
Scheme draw_scheme(Random& random, bool any) {
  const bool another = random.chance(0.4);
  const Scheme scheme = pick(random, {Scheme::hold, Scheme::filtered, Scheme::tangent, Scheme::ring, Scheme::port});
  return any && another ? scheme : Scheme::port;
}

void draw_hand(const Scenario& s, std::size_t index, StationPlan& plan) {
  Random random = part_of(s.drawn_with.seed, Part::hand, index);
  plan.hand = pick(random, {"light", "reference", "reference", "firm"});
  plan.phantom.hand = *hand_from_name(plan.hand);
  plan.phantom.tremor_m = random.uniform(0, 2e-4);
  plan.phantom.seed = random.bits();
  const double release_s = random.uniform(seconds(kFirstFaultAt), seconds(s.healed));
  if (random.chance(0.1)) plan.phantom.release_s = release_s;
  plan.simulated = random.chance(0.7);
}

StationPlan draw_station(const Scenario& s, std::size_t index) {
  StationPlan plan;
  draw_hand(s, index, plan);
  draw_links(s, index, plan);
  draw_clock(s, index, plan);
  Random random = part_of(s.drawn_with.seed, Part::crew, 1 + index);
  plan.client.hello.station = fmt::format("hand{}", index);
  plan.client.hello.scheme = draw_scheme(random, !plan.simulated);
  plan.client.hello.order = static_cast<std::uint16_t>(draw_order(s, random));
  const SimPhantomOptions device;
  plan.client.guard = {device.force_max_n, SimPhantom::kSlewMaxNS, PassivityMode::on};
  return plan;
}

void make_shadow(const Scenario& s, StationPlan& plan, int owner, const StationPlan& of) {
  Random random = part_of(s.drawn_with.seed, Part::crew, 1000 + static_cast<std::uint64_t>(owner));
  plan.owner = owner;
  plan.drift_ppm = of.drift_ppm;
  plan.client.hello.shadow_of = of.client.hello.station;
  plan.client.hello.scheme = draw_scheme(random, true);
  plan.client.hello.station += "-shadow";
}

}  // namespace

std::vector<StationPlan> draw_stations(const Scenario& s) {
  Random random = part_of(s.drawn_with.seed, Part::crew);
  const bool attach = s.scene.tool.contact == ContactKind::attach;
  const auto hands = std::min(static_cast<std::uint64_t>(s.drawn_with.stations_max),
                              attach ? 1 : pick<std::uint64_t>(random, {1, 1, 1, 2, 2, 3}));
  const bool shadow = random.chance(0.25), viewer = random.chance(0.25);
  std::vector<StationPlan> plans;
  for (std::uint64_t k = 0; k < hands; ++k) {
    plans.push_back(draw_station(s, k));
    plans.back().path = draw_path(s, k, hands);
  }
  const auto room_for = [&] { return plans.size() < static_cast<std::size_t>(s.drawn_with.stations_max); };
  if (shadow && room_for()) {
    plans.push_back(draw_station(s, plans.size()));
    make_shadow(s, plans.back(), 0, plans[0]);
  }
  if (viewer && room_for()) {
    plans.push_back(draw_station(s, plans.size()));
    plans.back().client.hello.role = Role::viewer;
    plans.back().client.hello.station = "viewer";
  }
  return plans;
}

namespace {

/// Where the hand of station `index` works, and how far it may go from there.
struct Playground {
  Vec3 home = Vec3::Zero(), reach = Vec3::Zero();  ///< reach: sideways, sideways, into the body
  double above_m = 0;                              ///< between touches, 0 for a grasp
};

Playground playground(const Scenario& s, Random& random, std::size_t index, std::size_t count) {
  const LumpedBody& body = s.scene.body;
  double spacing_m = 1;
  Vec3 low = body.nodes[0], high = body.nodes[0];
  for (const Element& e : body.elements) spacing_m = std::min(spacing_m, e.rest_length_m);
  for (const Vec3& x : body.nodes) {
    low = low.cwiseMin(x);
    high = high.cwiseMax(x);
  }
  Playground p;
  p.home = home_of(s.scene);
  const double far = random.uniform(0.1, 0.45) * spacing_m;
  p.reach = Vec3(far, far, body.planar ? 0 : far);
  if (s.scene.tool.contact == ContactKind::attach) return p;
  const Vec3 middle = 0.5 * (low + high), half = 0.5 * (high - low);
  const double side = count > 1 ? -0.6 + 1.2 * static_cast<double>(index) / static_cast<double>(count - 1) : 0;
  p.home = Vec3(middle.x() + side * half.x() + random.uniform(-0.15, 0.15) * half.x(),
                middle.y() + random.uniform(-0.5, 0.5) * half.y(), high.z());
  p.reach = Vec3(0.25 * half.x(), 0.4 * half.y(), random.uniform(0.1, 0.45) * spacing_m);
  p.above_m = random.uniform(0.002, 0.015);
  return p;
}

class PathDraw {
 public:
  PathDraw(const Vec3& start) : at_(start) { points_.push_back({0, start}); }

  /// A reach along a minimum-jerk curve.
  void reach(const Vec3& to, double duration_s) {
    constexpr double kSampleS = 0.004;
    const int n = std::max(2, static_cast<int>(duration_s / kSampleS));
    for (int i = 1; i <= n; ++i) {
      const double c = static_cast<double>(i) / n;
      points_.push_back({t_s_ + c * duration_s, at_ + c * c * c * (10 - 15 * c + 6 * c * c) * (to - at_)});
    }
    t_s_ += duration_s;
    at_ = to;
  }
  void stay(double until_s) {
    if (until_s <= t_s_) return;
    points_.push_back({until_s, at_});
    t_s_ = until_s;
  }
  double now_s() const { return t_s_; }
  std::vector<MotionPoint> points() const { return points_; }

 private:
  Vec3 at_;
  double t_s_ = 0;
  std::vector<MotionPoint> points_;
};

}  // namespace

std::vector<MotionPoint> draw_path(const Scenario& s, std::size_t index, std::size_t count) {
  Random random = part_of(s.drawn_with.seed, Part::hand, 1000 + index);
  const Playground p = playground(s, random, index, count);
  const auto somewhere = [&](double height_m) {
    const double x = random.uniform(-1, 1), y = random.uniform(-1, 1);
    return Vec3(p.home + Vec3(x * p.reach.x(), y * p.reach.y(), height_m));
  };
  const double jabs = random.uniform(0, 0.3);
  PathDraw path(p.home + Vec3(0, 0, p.above_m));
  path.stay(random.uniform(0.2, 0.5));
  const double rest_s = seconds(s.rest);
  while (path.now_s() < rest_s - 0.35) {
    const bool lifted = random.chance(0.3), jab = random.chance(jabs);
    const double depth_m = random.uniform(-1, p.above_m > 0 ? -0.1 : 1) * p.reach.z();
    const double duration_s = jab ? random.uniform(0.05, 0.1) : random.uniform(0.15, 0.5);
    const Vec3 to = somewhere(lifted && p.above_m > 0 ? p.above_m : depth_m);
    path.reach(to, std::min(duration_s, rest_s - 0.3 - path.now_s() + 0.05));
  }
  path.reach(somewhere(-random.uniform(0.5, 1) * p.reach.z()), std::max(0.05, rest_s - path.now_s()));
  path.stay(rest_s + 60);
  return path.points();
}

}  // namespace palpate
