#include "bench/measure/stability_point.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/base/error.hpp"
#include "server/dynamics/dynamics.hpp"
#include "server/dynamics/skin.hpp"
#include "server/room/room.hpp"
#include "server/solve/linear_solver.hpp"

namespace palpate {
namespace {

constexpr double kDepthM = 0.010;

struct Setup {
  GesturePlan plan;
  SimPhantomOptions device;
  double rest_s = 0;  ///< time from which nothing drives the loop
  double observe_s = 0;
};

Setup setup_of(const Scene& scene, const StabilityPoint& point, double rtt_ms) {
  constexpr double kWindows = 7;
  Setup s{plan_gesture(scene, point.gesture, kDepthM), {}, 0, kWindows * kWindowS + 2e-3 * rtt_ms};
  const bool free = point.hand == "free", changes = free || point.gesture == Gesture::release;
  s.rest_s = free ? s.plan.let_go_s : s.plan.still_s;
  s.device.tremor_m = s.device.force_step_n = 0;
  s.device.hand = *hand_from_name(changes ? "reference" : point.hand);
  s.device.hand_after_release = *hand_from_name(point.hand);
  s.device.release_s = changes ? s.rest_s : std::numeric_limits<double>::infinity();
  return s;
}

/// Kinetic energy of the device when hand and device oscillate by kStillM, peak to peak, on the port's and the hand's stiffness.
RestBounds still_on(const StabilityPoint& point, double device_mass_kg) {
  const Hand hand = *hand_from_name(point.hand);
  const double stored_j = 0.5 * (point.stiffness_n_m + hand.stiffness_n_m) * 0.25 * kStillM * kStillM;
  return {kStillM, stored_j * device_mass_kg / (device_mass_kg + hand.mass_kg)};
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
  reference.loop = reference_loop(reference.scene, s.plan.intention, s.device, from_seconds(s.rest_s + s.observe_s));
  return reference;
}

StabilityResult measure_stability(const StabilityPoint& point, const StabilityReference& reference) {
  const Setup s = setup_of(reference.scene, point, point.rtt_ms);
  ClosedLoopOptions options;
  options.scheme = point.scheme;
  options.rate_hz = point.rate_hz;
  options.link = {.latency = from_seconds(point.rtt_ms * 0.5e-3),
                  .jitter = from_seconds(point.jitter_ms * 1e-3),
                  .loss = point.loss_pct / 100,
                  .burst_mean = point.burst,
                  .seed = point.seed};
  options.seed = point.seed;
  options.device = s.device;
  options.duration = from_seconds(s.rest_s + s.observe_s);
  StabilityResult result;
  result.loop = closed_loop(reference.scene, s.plan.intention, options);
  result.rest_tick = static_cast<std::size_t>(std::lround(s.rest_s * 1e3));
  const auto& ticks = result.loop.ticks;
  const auto cut = std::count_if(ticks.begin(), ticks.end(), [](const LoopTick& tick) { return tick.gain < 1; });
  result.cut_s = 1e-3 * static_cast<double>(cut);
  result.reference =
      cut > 0 ? reference_loop(reference.scene, s.plan.intention, s.device, options.duration, ticks) : reference.loop;
  result.verdict = judge_loop(result.loop, result.reference, result.rest_tick, still_on(point, s.device.device_mass_kg));
  return result;
}

}  // namespace palpate
