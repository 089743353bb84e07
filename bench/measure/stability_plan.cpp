#include "bench/measure/stability_plan.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "bench/measure/even_spread.hpp"

namespace palpate {
namespace {

constexpr double kBurstMean = 4;

std::vector<double> round_trips(bool quick, std::vector<double> of_a_look) {
  return quick ? std::move(of_a_look) : std::vector<double>(kStabilityRttMs.begin(), kStabilityRttMs.end());
}

/// Hands and gestures that exist with a kind of contact.
std::vector<StabilityPoint> cases_of(Scheme scheme, const StabilityPlan& plan) {
  std::vector<StabilityPoint> cases;
  for (const ContactKind contact : {ContactKind::attach, ContactKind::touch})
    for (const char* hand : {"free", "light", "firm"})
      for (const Gesture gesture : {Gesture::press, Gesture::tap, Gesture::stroke, Gesture::release}) {
        StabilityPoint p;
        p.scheme = scheme;
        p.contact = contact;
        p.hand = hand;
        p.gesture = gesture;
        p.stiffness_n_m = plan.body_n_m;
        p.seed = plan.seed;
        if (is_possible(p)) cases.push_back(p);
      }
  return cases;
}

/// Set of points, each once.
class Points {
 public:
  explicit Points(const StabilityPlan& plan) : plan_(plan) {}
  void add(const StabilityPoint& p) {
    if (is_possible(p) && std::find(points_.begin(), points_.end(), p) == points_.end()) points_.push_back(p);
  }
  const StabilityPlan& plan() const { return plan_; }
  std::vector<StabilityPoint> take() { return std::move(points_); }

 private:
  StabilityPlan plan_;
  std::vector<StabilityPoint> points_;
};

/// Adds every axis against the round trip, through the base.
void add_maps(Points& points, const StabilityPoint& base) {
  const bool quick = points.plan().quick;
  for (const double rtt_ms : round_trips(quick, {0, 100, 1000})) {
    const auto add = [&](double StabilityPoint::*axis, const std::vector<double>& values, double burst = 0) {
      for (const double value : values) {
        StabilityPoint p = base;
        p.rtt_ms = rtt_ms;
        p.*axis = value;
        p.burst = value > 0 ? burst : 0;
        points.add(p);
      }
    };
    add(&StabilityPoint::rate_hz, quick ? std::vector{10.0, 20.0} : std::vector{10.0, 20.0, 30.0, 60.0});
    if (quick) continue;
    add(&StabilityPoint::stiffness_n_m, stability_stiffnesses(points.plan().body_n_m));
    add(&StabilityPoint::jitter_ms, {0, 10, 25, 50});
    add(&StabilityPoint::loss_pct, {0, 5, 15, 30});
    add(&StabilityPoint::loss_pct, {5, 15, 30}, kBurstMean);
  }
}

/// Adds all hands and gestures against the round trip.
void add_cases(Points& points, Scheme scheme) {
  for (StabilityPoint p : cases_of(scheme, points.plan()))
    for (const double rtt_ms : round_trips(points.plan().quick, {100})) {
      p.rtt_ms = rtt_ms;
      points.add(p);
    }
}

/// Adds all hands and gestures at the corners of the axes that interact most: delay, rate, stiffness.
void add_corners(Points& points, Scheme scheme) {
  const std::vector<double> stiffnesses = stability_stiffnesses(points.plan().body_n_m);
  for (StabilityPoint p : cases_of(scheme, points.plan()))
    for (const double stiffness : {stiffnesses.front(), stiffnesses.back()})
      for (const double rate_hz : {10.0, 60.0})
        for (const double rtt_ms : {0.0, 100.0, 1000.0}) {
          p.stiffness_n_m = stiffness;
          p.rate_hz = rate_hz;
          p.rtt_ms = rtt_ms;
          points.add(p);
        }
}

/// Adds `count` of these cases, spread evenly over all axes at once.
void add_scattered(Points& points, const std::vector<StabilityPoint>& cases, std::size_t count) {
  EvenSpread<7> spread(points.plan().seed);
  const std::vector<double> stiffnesses = stability_stiffnesses(points.plan().body_n_m);
  for (std::size_t i = 0; i < count; ++i) {
    const auto& u = spread.next();
    StabilityPoint p = pick(u[0], cases);
    p.stiffness_n_m = pick(u[1], stiffnesses);
    p.rate_hz = std::round(10 * std::pow(6, u[2]));
    p.rtt_ms = std::round(1000 * u[3] * u[3]);  // half of them below 250 ms, the usual range
    p.jitter_ms = std::round(50 * u[4]);
    p.loss_pct = std::round(30 * u[5]);
    p.burst = p.loss_pct > 0 && u[6] > 0.5 ? std::round(2 + 12 * (u[6] - 0.5)) : 0;
    p.seed = points.plan().seed + i;
    points.add(p);
  }
}

}  // namespace

std::vector<double> stability_stiffnesses(double body_n_m) {
  std::vector<double> levels{50, 200, 400, 800};
  levels.insert(std::upper_bound(levels.begin(), levels.end(), body_n_m), body_n_m);
  return levels;
}

StabilityPoint map_base(ContactKind contact, double body_n_m) {
  StabilityPoint p;
  p.contact = contact;
  p.stiffness_n_m = body_n_m;
  if (contact == ContactKind::attach) return p;
  p.hand = "light";
  p.gesture = Gesture::tap;
  return p;
}

std::vector<StabilityPoint> stability_points(const StabilityPlan& plan) {
  constexpr std::size_t kScattered = 300, kScatteredBeside = 40, kScatteredQuick = 10;
  Points points(plan);
  for (const Scheme scheme : plan.schemes) {
    const bool ours = scheme == Scheme::port || scheme == Scheme::hyper;
    for (const ContactKind contact : {ContactKind::attach, ContactKind::touch}) {
      StabilityPoint base = map_base(contact, plan.body_n_m);
      base.scheme = scheme;
      base.seed = plan.seed;
      add_maps(points, base);
    }
    add_cases(points, scheme);
    if (ours && !plan.quick) add_corners(points, scheme);
    add_scattered(points, cases_of(scheme, plan), plan.quick ? kScatteredQuick : ours ? kScattered : kScatteredBeside);
  }
  return points.take();
}

std::vector<StabilityPoint> hands_points(const StabilityPlan& plan) {
  constexpr int kScattered = 40, kScatteredQuick = 2, kHandsMost = 8;
  constexpr double kStiffNM = 400;
  using RoundTrips = std::vector<std::pair<double, double>>;  // of the first hand, of the others
  const std::vector<int> counts = plan.quick ? std::vector{2} : std::vector{2, 4, kHandsMost};
  const std::vector<double> distances = plan.quick ? std::vector<double>{0, 30} : std::vector<double>{0, 10, 30, kApartMostMm};
  const RoundTrips round_trips =
      plan.quick ? RoundTrips{{100, 100}, {0, 300}} : RoundTrips{{0, 0}, {100, 100}, {300, 300}, {0, 300}, {300, 20}};
  const std::vector<std::pair<const char*, Gesture>> cases{{"light", Gesture::tap}, {"firm", Gesture::press}};
  const std::vector<double> stiffnesses = stability_stiffnesses(plan.body_n_m);
  Points points(plan);
  for (const Scheme scheme : plan.schemes) {
    StabilityPoint p;
    p.scheme = scheme;
    p.contact = ContactKind::touch;
    for (const auto& [hand, gesture] : cases)
      for (const int hands : counts)
        for (const double apart_mm : distances)
          for (const auto& [rtt_ms, others_rtt_ms] : round_trips)
            for (const double stiffness : {plan.body_n_m, kStiffNM}) {
              if (stiffness != plan.body_n_m && (hands > 2 || plan.quick)) continue;
              p.hand = hand;
              p.gesture = gesture;
              p.hands = hands;
              p.apart_mm = apart_mm;
              p.rtt_ms = rtt_ms;
              p.others_rtt_ms = others_rtt_ms;
              p.stiffness_n_m = stiffness;
              p.seed = plan.seed;
              points.add(p);
            }
    EvenSpread<9> spread(plan.seed);
    for (int i = 0; i < (plan.quick ? kScatteredQuick : kScattered); ++i) {
      const auto& u = spread.next();
      std::tie(p.hand, p.gesture) = pick(u[0], cases);
      p.hands = 2 + static_cast<int>((kHandsMost - 1) * u[1]);
      p.apart_mm = std::round(kApartMostMm * u[2] * u[2]);
      p.rtt_ms = std::round(300 * u[3]);
      p.others_rtt_ms = std::round(300 * u[4]);
      p.stiffness_n_m = pick(u[5], stiffnesses);
      p.rate_hz = std::round(10 * std::pow(6, u[6]));
      p.jitter_ms = std::round(50 * u[7]);
      p.loss_pct = std::round(30 * u[8]);
      p.seed = plan.seed + static_cast<std::uint64_t>(i);
      points.add(p);
      p.rate_hz = StabilityPoint().rate_hz;
      p.jitter_ms = p.loss_pct = 0;
    }
  }
  return points.take();
}

std::vector<StabilityPoint> tool_points(const StabilityPlan& plan) {
  constexpr std::size_t kScattered = 100, kScatteredQuick = 4;
  const std::vector<double> stiffnesses = stability_stiffnesses(plan.body_n_m);
  Points points(plan);
  for (const Scheme scheme : plan.schemes) {
    if (scheme != Scheme::port && scheme != Scheme::hyper) continue;
    std::vector<StabilityPoint> cases;
    for (const char* tool : {"ball", "shaft", "grasper", "retractor", kNeedle.data()})
      for (const char* hand : {"light", "firm"})
        for (std::size_t gesture = 0; gesture < kGestureNames.size(); ++gesture) {
          StabilityPoint p;
          p.scheme = scheme;
          p.contact = ContactKind::touch;
          p.hand = hand;
          p.tool = tool;
          p.gesture = static_cast<Gesture>(gesture);
          p.stiffness_n_m = plan.body_n_m;
          p.seed = plan.seed;
          if (is_possible(p)) cases.push_back(p);
        }
    for (StabilityPoint p : cases)
      for (const double rtt_ms : round_trips(plan.quick, {100})) {
        p.rtt_ms = rtt_ms;
        points.add(p);
      }
    if (!plan.quick)
      for (StabilityPoint p : cases)
        for (const double stiffness : {stiffnesses.front(), stiffnesses.back()})
          for (const double rate_hz : {10.0, 60.0})
            for (const double rtt_ms : {0.0, 300.0}) {
              p.stiffness_n_m = stiffness;
              p.rate_hz = rate_hz;
              p.rtt_ms = rtt_ms;
              points.add(p);
            }
    add_scattered(points, cases, plan.quick ? kScatteredQuick : kScattered);
  }
  return points.take();
}

std::vector<BodyTrial> body_trials(std::size_t scattered, std::uint64_t seed) {
  std::vector<BodyTrial> trials;
  for (const Treatment treatment : {Treatment::compress, Treatment::invert, Treatment::pull})
    for (const double ratio : {1.0, 1e4})
      for (const double zeta : {0.0, 10.0})
        for (const double mass_kg : {1e-6, 10.0})
          for (const double step_ms : {0.1, 50.0}) {
            const double amount = treatment == Treatment::compress ? 0.9 : 2;
            trials.push_back({treatment, SpringLaw::linear, amount, ratio, zeta, mass_kg, mass_kg, step_ms, seed});
          }
  EvenSpread<9> spread(seed);
  const auto decades = [](double share, double low, double high) { return low * std::pow(high / low, share); };
  for (std::size_t i = 0; i < scattered; ++i) {
    const auto& u = spread.next();
    BodyTrial t;
    t.treatment = static_cast<Treatment>(3 * u[0]);
    t.law = static_cast<SpringLaw>(3 * u[1]);
    t.amount = t.treatment == Treatment::compress ? 0.9 * u[2] : t.treatment == Treatment::invert ? 1 + u[2] : 3 * u[2];
    t.ratio = decades(u[3], 1, 1e4);
    t.zeta = u[4] < 0.2 ? 0 : decades((u[4] - 0.2) / 0.8, 1e-3, 10);
    t.mass_min_kg = decades(u[5], 1e-6, 10);
    t.mass_max_kg = u[6] < 0.5 ? t.mass_min_kg : decades(2 * u[6] - 1, t.mass_min_kg, 10);
    t.step_ms = decades(u[7], 0.1, 50);
    t.seed = seed + i;
    trials.push_back(t);
  }
  return trials;
}

}  // namespace palpate
