#include "bench/measure/stability_point.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "bench/measure/tools_apart.hpp"
#include "common/base/error.hpp"
#include "server/body/dynamics.hpp"
#include "server/body/skin.hpp"
#include "server/room/room.hpp"
#include "server/solve/linear_solver.hpp"

namespace palpate {
namespace {

constexpr double kDepthM = 0.010;

struct Setup {
  std::vector<LoopHand> hands;
  double rest_s = 0;  ///< time from which nothing drives the loop
  double observe_s = 0;
};

/// Returns the motion at another place, begun `later_s` later.
Motion moved(const Motion& motion, const Vec3& by, double later_s) {
  std::vector<MotionPoint> points;
  if (later_s > 0) points.push_back({0, motion.position(0.0) + by});
  for (const MotionPoint& p : motion.points()) points.push_back({p.t_s + later_s, p.position + by});
  MotionHolds holds = motion.holds();
  if (later_s > 0 && motion.has_orientation()) holds.orientations.insert(holds.orientations.begin(), holds.orientations.front());
  return Motion(std::move(points), std::move(holds));
}

/// Wrist of a hand: as stiff against the reference's as its arm, with the same damping ratio and rendered without steps.
SimWrist wrist_of(const std::string& hand) {
  SimWrist wrist;
  const double share = hand_from_name(hand)->stiffness_n_m / hand_from_name("reference")->stiffness_n_m;
  wrist.inertia_kg_m2 *= share;
  wrist.damping_nm_s_rad *= share;
  wrist.stiffness_nm_rad *= share;
  wrist.torque_step_nm = 0;
  return wrist;
}

LinkSpec link_of(const StabilityPoint& point, std::size_t k) {
  constexpr std::uint64_t kSeedsEach = 2;  // up and down
  return {.latency = from_seconds((k == 0 ? point.rtt_ms : point.others_rtt_ms) * 0.5e-3),
          .jitter = from_seconds(point.jitter_ms * 1e-3),
          .loss = point.loss_pct / 100,
          .burst_mean = point.burst,
          .seed = point.seed + kSeedsEach * k};
}

Setup setup_of(const Scene& scene, const StabilityPoint& point, double rtt_ms) {
  constexpr double kWindows = 7;
  const GesturePlan plan = plan_gesture(scene, point.gesture, kDepthM);
  const bool free = point.hand == "free", changes = free || point.gesture == Gesture::release;
  const double last_s = kHandsLaterS * (point.hands - 1);
  Setup s{{}, (free ? plan.release_s : plan.still_s) + last_s, kWindows * kWindowS + 2e-3 * rtt_ms};
  SimPhantomOptions device;
  device.tremor_m = device.force_step_n = 0;
  device.hand = *hand_from_name(changes ? "reference" : point.hand);
  device.hand_after_release = *hand_from_name(point.hand);
  device.release_s = changes ? s.rest_s : std::numeric_limits<double>::infinity();
  if (scene.tool.has_body()) device.wrist = wrist_of(point.hand);
  for (int k = 0; k < point.hands; ++k) {
    Vec3 by = Vec3::Zero();
    by.head<2>() = place_apart(k, point.hands, 1e-3 * point.apart_mm);
    s.hands.push_back({moved(plan.intention, by, kHandsLaterS * k), device, link_of(point, static_cast<std::size_t>(k))});
  }
  return s;
}

/// Time for which the force of a hand was cut [ticks].
std::ptrdiff_t cut_ticks(const ClosedLoopResult& loop) {
  return std::ranges::count_if(loop.ticks, [](const LoopTick& tick) { return tick.gain < 1; });
}

/// Judges every hand; the result has the worst verdict.
void judge(StabilityResult& result, const RestBounds& still) {
  for (std::size_t k = 0; k < result.loops.size(); ++k) {
    const LoopVerdict v = judge_loop(result.loops[k], result.references[k], result.rest_tick, still);
    const bool was_stable = result.verdict.fault == LoopFault::none;
    if (k > 0 && !(was_stable && (v.fault != LoopFault::none || v.rest.tail_m() > result.verdict.rest.tail_m()))) continue;
    result.verdict = v;
    result.worst = k;
  }
}

/// Kinetic energy of the device when hand and device oscillate by kStillM, peak to peak, on the port's and the hand's stiffness,
/// and with a wrist also turn by as much at kLeverM.
RestBounds still_on(const StabilityPoint& point, const SimPhantomOptions& device) {
  const Hand hand = *hand_from_name(point.hand);
  const double stored_j = 0.5 * (point.stiffness_n_m + hand.stiffness_n_m) * 0.25 * kStillM * kStillM;
  RestBounds still{kStillM, stored_j * device.device_mass_kg / (device.device_mass_kg + hand.mass_kg)};
  if (const auto& wrist = device.wrist) {
    const double turned_j = 0.5 * wrist->stiffness_nm_rad * 0.25 * std::pow(kStillM / kLeverM, 2);
    still.kinetic_j += turned_j * wrist->device_inertia_kg_m2 / (wrist->device_inertia_kg_m2 + wrist->inertia_kg_m2);
  }
  return still;
}

/// n . C n of the body alone at rest, with n the direction into it [m/N].
double port_compliance_m_n(const Scene& scene) {
  const Dynamics dynamics(scene.body);
  const BodyState rest = dynamics.rest_state();
  const Vec3 into = into_body(scene);
  Vector force = Vector::Zero(rest.x.size());
  const bool attach = scene.tool.contact == ContactKind::attach;
  const Skin skin(scene.body, scene.tool.radius_m);
  if (attach)
    force.segment<3>(3 * static_cast<Eigen::Index>(scene.tool.node)) = into;
  else
    scatter(skin.weights(nearest_point(skin.view(), skin.place(rest.x), home_of(scene)).point), into, force);
  BlockMatrix a = dynamics.make_matrix();
  dynamics.assemble(rest, 0, 0, 1, scene.body.fixed, false, a);
  LinearSolver solver(dynamics.nodes());
  if (!solver.factorise(a)) throw InputError("scene " + scene.name, "has no stiffness at its port", "a body that is fixed");
  Vector shift = Vector::Zero(force.size());
  solver.solve(force, 1e-10, shift);
  return force.dot(shift);
}

}  // namespace

bool is_possible(const StabilityPoint& p) {
  const bool turns = p.gesture == Gesture::rock || p.gesture == Gesture::twist;
  const bool inserts = p.gesture == Gesture::insert || p.gesture == Gesture::withdraw;
  if (inserts != (p.tool == kNeedle) || (turns && p.tool.empty())) return false;
  if ((p.hands > 1 || !p.tool.empty()) && p.contact == ContactKind::attach) return false;
  if (p.contact == ContactKind::attach) return !(p.hand == "free" && p.gesture == Gesture::press);  // the same as a release
  return p.hand != "free";
}

double port_stiffness_n_m(const Scene& scene) {
  const bool soft_contact = scene.tool.contact == ContactKind::touch && scene.tool.contact_stiffness_n_m > 0;
  return 1 / (port_compliance_m_n(scene) + (soft_contact ? 1 / scene.tool.contact_stiffness_n_m : 0.0));
}

Scene with_port_stiffness(Scene scene, double stiffness_n_m) {
  const double compliance = port_compliance_m_n(scene), contact = 1 / port_stiffness_n_m(scene) - compliance;
  const double factor = compliance / (1 / stiffness_n_m - contact);
  if (!(factor > 0))
    throw InputError("stiffness", std::to_string(stiffness_n_m) + " N/m is more than the contact's own", "less than that");
  for (Element& e : scene.body.elements) {
    e.stiffness_n_m *= factor;
    e.damping_n_s_m *= std::sqrt(factor);
  }
  for (SolidMaterial& m : scene.body.materials) {
    m.young_pa *= factor;
    m.damping_s /= std::sqrt(factor);
  }
  return scene;
}

StabilityReference stability_reference(const Scene& body, const StabilityPoint& point) {
  StabilityReference reference{with_port_stiffness(body, point.stiffness_n_m), {}};
  const Setup s = setup_of(reference.scene, point, 0);
  reference.loops = reference_loop(reference.scene, s.hands, from_seconds(s.rest_s + s.observe_s));
  return reference;
}

StabilityResult measure_stability(const StabilityPoint& point, const StabilityReference& reference) {
  const Setup s = setup_of(reference.scene, point, point.hands > 1 ? std::max(point.rtt_ms, point.others_rtt_ms) : point.rtt_ms);
  ClosedLoopOptions options;
  options.scheme = point.scheme;
  options.rate_hz = point.rate_hz;
  options.seed = point.seed;
  options.duration = from_seconds(s.rest_s + s.observe_s);
  StabilityResult result;
  result.loops = closed_loop(reference.scene, s.hands, options);
  result.rest_tick = static_cast<std::size_t>(std::lround(s.rest_s * 1e3));
  std::ptrdiff_t cut = 0;
  for (const ClosedLoopResult& loop : result.loops) {
    cut = std::max(cut, cut_ticks(loop));
    for (const LoopTick& tick : loop.ticks) result.step_max_n = std::max(result.step_max_n, tick.hand_over_step_n);
  }
  result.cut_s = 1e-3 * static_cast<double>(cut);
  result.references = cut > 0 ? reference_loop(reference.scene, s.hands, options.duration, result.loops) : reference.loops;
  judge(result, still_on(point, s.hands.front().device));
  return result;
}

}  // namespace palpate
