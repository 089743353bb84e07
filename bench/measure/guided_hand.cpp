#include "bench/measure/guided_hand.hpp"

#include <algorithm>
#include <cmath>

#include "bench/measure/gestures.hpp"
#include "client/core/guidance.hpp"
#include "client/core/hands_damper.hpp"
#include "common/base/error.hpp"
#include "common/base/minimum_jerk.hpp"

namespace palpate {
namespace {

constexpr double kGuidedHoldS = 2.5, kGuidedStrokeS = 0.8, kGuidedSettleS = 1.0, kWindowsSeen = 7, kSlowestSeen = 3,
                 kGuidedDownS = 0.8, kGuidedDepthM = 0.005, kGuidedAboveM = 0.040;
constexpr int kStrokes = 4;
constexpr double kMovesToS = kGuidedHoldS + kStrokes * kGuidedStrokeS;

Hand guided_hand(const std::string& name) {
  const Hand reference = *hand_from_name("reference");
  if (name == "free") return {};
  if (name == "led") return {reference.mass_kg, reference.damping_n_s_m, 0};
  if (name == "resting") return reference;
  throw InputError("hand", "'" + name + "' is not one that can be guided", "free, led or resting");
}

/// Intention of the guide, or of the guided hand, which does not stroke.
Motion intention(const Scene& scene, bool touches, bool strokes) {
  const Vec3 home = start_of(scene) + Vec3(strokes ? 0 : kGuidedBesideM, 0, touches ? 0 : kGuidedAboveM);
  std::vector<MotionPoint> points;
  for (int ms = 0; ms <= static_cast<int>(1e3 * (kMovesToS + 0.1)); ++ms) {
    const double t_s = ms * 1e-3, stroked = std::clamp((t_s - kGuidedHoldS) / kGuidedStrokeS, 0.0, double{kStrokes});
    const int whole = std::min(static_cast<int>(stroked), kStrokes - 1);
    const double share = minimum_jerk(stroked - whole);
    const double x = strokes ? kGuidedStrokeM * (whole % 2 == 0 ? share : 1 - share) : 0;
    const double z = touches ? -(kGapM + kGuidedDepthM) * minimum_jerk((t_s - 0.2) / kGuidedDownS) : 0;
    points.push_back({t_s, home + Vec3(x, 0, z)});
  }
  return Motion(std::move(points));
}

std::vector<LoopHand> hands_of(const Scene& scene, const GuidedPoint& point) {
  std::vector<LoopHand> hands;
  for (const bool guides : {true, false}) {
    SimPhantomOptions device;
    device.tremor_m = device.force_step_n = 0;
    device.hand = guides ? *hand_from_name("reference") : guided_hand(point.hand);
    const LinkSpec link{.latency = from_seconds((guides ? point.guide_rtt_ms : point.guided_rtt_ms) * 0.5e-3),
                        .jitter = from_seconds(point.jitter_ms * 1e-3),
                        .loss = point.loss_pct / 100,
                        .seed = point.seed + (guides ? 0 : 2)};
    hands.push_back({intention(scene, point.touches, guides), device, link});
  }
  hands[0].guides = 1;
  return hands;
}

/// Dampers of a tool that is led [N s/m]: those that a client displays, and that of the arm.
struct GuidedDampers {
  double stiffness_n_m = 0;  ///< K
  double displayed_n_s_m = 0, arm_n_s_m = 0;
  double slowest_s() const { return (displayed_n_s_m + arm_n_s_m) / stiffness_n_m; }
};

GuidedDampers dampers_of(const GuidedPoint& point, double round_s) {
  const double stiffness = GuidanceCoupling::stiffness_for(round_s);
  return {stiffness, stiffness * round_s / 2 + (point.touches ? HandsDamper::kMostGuidedNSM : 0),
          guided_hand(point.hand).damping_n_s_m};
}

/// Bounds of a hand at rest, whose dampers answer each step of the encoder.
RestBounds still_with(const SimPhantomOptions& device, double displayed_n_s_m) {
  const double speed_m_s = displayed_n_s_m * device.position_step_m / (device.device_mass_kg + device.hand.mass_kg);
  return {kStillM, std::max(kStillJ, 0.5 * device.device_mass_kg * speed_m_s * speed_m_s)};
}

StabilityVerdict rest_of(const ClosedLoopResult& loop, std::size_t from, const RestBounds& still) {
  std::vector<Vec3> position;
  std::vector<double> kinetic_j;
  for (std::size_t i = std::min(from, loop.ticks.size() - 1); i < loop.ticks.size(); ++i) {
    position.push_back(loop.ticks[i].position);
    kinetic_j.push_back(loop.ticks[i].kinetic_j);
  }
  return judge_motion(position, kinetic_j, loop.lost, still);
}

/// Root mean square of the distance of the guided tool to where the guide's was `lag` ticks before.
double distance_rms_m(const std::vector<ClosedLoopResult>& loops, std::size_t from, std::size_t to, std::size_t lag) {
  double sum = 0;
  for (std::size_t i = from; i < to; ++i) sum += (loops[1].ticks[i].position - loops[0].ticks[i - lag].position).squaredNorm();
  return to > from ? std::sqrt(sum / static_cast<double>(to - from)) : 0;
}

void compare_paths(GuidedResult& r, std::size_t from, std::size_t to) {
  constexpr std::size_t kLagMost = 1500, kLagStep = 5;
  r.error_rms_m = r.lagged_rms_m = distance_rms_m(r.loops, from, to, 0);
  for (std::size_t lag = kLagStep; lag <= std::min(kLagMost, from); lag += kLagStep)
    if (const double rms = distance_rms_m(r.loops, from, to, lag); rms < r.lagged_rms_m) {
      r.lagged_rms_m = rms;
      r.lag_s = 1e-3 * static_cast<double>(lag);
    }
}

void note_forces(GuidedResult& r, std::size_t from, std::size_t to) {
  double absorbed_j = 0;
  const std::size_t ticks = std::min(r.loops[0].ticks.size(), r.loops[1].ticks.size());
  for (std::size_t i = 1; i < ticks; ++i)
    for (const ClosedLoopResult& loop : r.loops) {
      const LoopTick &before = loop.ticks[i - 1], &now = loop.ticks[i];
      absorbed_j -= before.guidance.dot(now.position - before.position);
      r.generated_j = std::max(r.generated_j, -absorbed_j);
      r.step_max_n = std::max(r.step_max_n, (now.guidance - before.guidance).norm());
    }
  for (std::size_t i = 0; i < ticks; ++i)
    for (const ClosedLoopResult& loop : r.loops)
      r.body_max_n = std::max(r.body_max_n, (loop.ticks[i].force - loop.ticks[i].guidance).norm());
  const auto forces = [&](const ClosedLoopResult& loop, double& mean_n, double& max_n) {
    for (std::size_t i = from; i < to; ++i) {
      const double norm = loop.ticks[i].guidance.norm();
      mean_n += norm / static_cast<double>(to - from);
      max_n = std::max(max_n, norm);
    }
  };
  forces(r.loops[0], r.guide_mean_n, r.guide_max_n);
  forces(r.loops[1], r.guided_mean_n, r.guided_max_n);
}

}  // namespace

GuidedResult measure_guided(const Scene& scene, const GuidedPoint& point) {
  const std::vector<LoopHand> hands = hands_of(scene, point);
  const double settled_s = kMovesToS + kGuidedSettleS + 1e-3 * (point.guide_rtt_ms + point.guided_rtt_ms);
  const double filters_s = 2 * GuidanceCoupling::kTargetS;
  const double slowest_s = dampers_of(point, 1e-3 * (point.guide_rtt_ms + point.guided_rtt_ms) + filters_s).slowest_s();
  const double windows = std::max<double>(kWindowsSeen, std::ceil(kSlowestSeen * slowest_s / kWindowS));
  ClosedLoopOptions options;
  options.seed = point.seed;
  options.duration = from_seconds(settled_s + windows * kWindowS);
  GuidedResult r;
  r.loops = closed_loop(scene, hands, options);
  r.lost = r.loops[0].lost || r.loops[1].lost;
  const auto tick_at = [&](double t_s) { return static_cast<std::size_t>(std::lround(t_s * 1e3)); };
  const std::size_t ticks = std::min(r.loops[0].ticks.size(), r.loops[1].ticks.size());
  const std::size_t from = std::min(tick_at(kGuidedHoldS), ticks), to = std::min(tick_at(kMovesToS), ticks);
  const double round_s = seconds(r.loops[0].guidance_reach + r.loops[1].guidance_reach);
  const double displayed_n_s_m = dampers_of(point, round_s).displayed_n_s_m;
  r.guide = rest_of(r.loops[0], tick_at(settled_s), still_with(hands[0].device, displayed_n_s_m));
  r.guided = rest_of(r.loops[1], tick_at(settled_s), still_with(hands[1].device, displayed_n_s_m));
  r.stiffness_n_m = GuidanceCoupling::stiffness_for(round_s);
  r.damping_n_s_m = r.stiffness_n_m * round_s / 2;
  r.bound_j = GuidanceCoupling::kForceMostN * kGuidedBesideM;
  compare_paths(r, from, to);
  note_forces(r, from, to);
  return r;
}

std::vector<GuidedPoint> guided_points(bool quick, std::uint64_t seed) {
  using RoundTrips = std::vector<std::pair<double, double>>;
  const RoundTrips round_trips =
      quick ? RoundTrips{{0, 0}, {300, 300}, {20, 300}}
            : RoundTrips{{0, 0}, {50, 50}, {100, 100}, {200, 200}, {300, 300}, {0, 300}, {300, 0}, {20, 150}};
  std::vector<GuidedPoint> points;
  for (const bool touches : {false, true})
    for (const char* hand : {"free", "led", "resting"})
      for (const auto& [guide_ms, guided_ms] : round_trips) points.push_back({touches, hand, guide_ms, guided_ms, 0, 0, seed});
  for (const bool touches : {false, true}) points.push_back({touches, "led", 150, 150, 20, 5, seed});
  return points;
}

}  // namespace palpate
