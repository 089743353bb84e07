// One point of the stability sweep: hands and their gesture, on a body of a given stiffness, through a scheme over a link each.
//
// The caller provides the body. Its springs or materials are scaled so that its port, at rest, has the wanted static stiffness;
// dampers are scaled by the square root of that, so that a stiffer body keeps its damping ratios and is no easier to calm. A
// touch feels the body through the contact stiffness: the two in series have the wanted stiffness.
//
// The hand (hand.hpp) is light or firm and performs the whole gesture, or it is `free`: the reference hand performs it and opens
// in the middle, after which the device's 75 g are alone with the display. In a release the reference hand presses and becomes
// the named one at still_s. There is no tremor, the force is not quantised, the position has the device's steps. The guard limits
// force and slew and does not damp, so that the scheme alone is judged.
//
// A tool with a body, or a needle (`tool`), is held by a wrist (SimWrist) as light or firm as the hand, and renders its torque.
// It is judged by its point and by two that are kLeverM from it along its x and z axes: a tool at rest does not turn either.
//
// Several hands touch one body at places `apart_mm` from each other (place_apart), hand k begins k kHandsLaterS later than the
// first, and each is judged like a hand alone against the same hands on the full model. The point has the worst verdict.
#pragma once

#include <string>

#include "bench/measure/gestures.hpp"
#include "bench/measure/stability.hpp"

namespace palpate {

struct StabilityPoint {
  Scheme scheme = Scheme::port;
  ContactKind contact = ContactKind::attach;
  std::string hand = "free";
  Gesture gesture = Gesture::release;
  double stiffness_n_m = 100;
  double rate_hz = 20, rtt_ms = 0, jitter_ms = 0, loss_pct = 0, burst = 0;
  std::uint64_t seed = 1;
  int hands = 1;
  double apart_mm = 0, others_rtt_ms = 0;  ///< for several hands: `rtt_ms` is that of the first
  std::string tool = {};                   ///< of scenes/tools, or kNeedle; empty: a point
  bool operator==(const StabilityPoint&) const = default;
};

inline constexpr double kHandsLaterS = 0.07;
inline constexpr std::string_view kNeedle = "needle";

/// Returns true if the combination exists: a tool released on a surface flies off, and there is no loop; a node has one hand,
/// which grasps it with a point; a needle is inserted.
bool is_possible(const StabilityPoint& point);

/// Static stiffness of the port at rest, along the direction into the body [N/m]; for a touch with the contact stiffness in
/// series.
double port_stiffness_n_m(const Scene& scene);
/// Returns the scene with its springs or materials and dampers scaled. Throws InputError if the contact stiffness alone is less
/// than `stiffness_n_m`.
Scene with_port_stiffness(Scene scene, double stiffness_n_m);

/// Reference of a point whose force is never cut; depends only on contact, hands, gesture and stiffness.
struct StabilityReference {
  Scene scene;
  std::vector<ClosedLoopResult> loops;  ///< one for each hand
};
StabilityReference stability_reference(const Scene& body, const StabilityPoint& point);

struct StabilityResult {
  LoopVerdict verdict;    ///< that of hand `worst`
  std::size_t worst = 0;  ///< the first hand that is not stable, or else the one that moves most when nothing drives
  std::vector<ClosedLoopResult> loops, references;  ///< `references` are the loops that they were judged against
  std::size_t rest_tick = 0;
  double step_max_n = 0;  ///< largest force step at a hand-over of any hand, before the cross-fade
  double cut_s = 0;       ///< longest time for which a hand's force faded or was zero: no patch came while the last was valid
};
/// A cut force drives the hand, whatever the display. If there were cuts, the reference is the hands on the full model whose
/// forces are cut at the same times. Throws what closed_loop() throws.
StabilityResult measure_stability(const StabilityPoint& point, const StabilityReference& reference);

}  // namespace palpate
