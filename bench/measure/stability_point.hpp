// One point of the stability sweep: a hand and its gesture, on a body of a given stiffness, through a scheme over a link.
//
// The caller provides the body. Its springs or materials are scaled so that its port, at rest, has the wanted static stiffness;
// dampers are scaled by the square root of that, so that a stiffer body keeps its damping ratios and is no easier to calm. A
// touch feels the body through the contact stiffness: the two in series have the wanted stiffness.
//
// The hand (hand.hpp) is light or firm and performs the whole gesture, or it is `free`: the reference hand performs it and opens
// in the middle, after which the device's 75 g are alone with the display. In a release the reference hand presses and becomes
// the named one at still_s. There is no tremor, the force is not quantised, the position has the device's steps. The guard limits
// force and slew and does not damp, so that the scheme alone is judged.
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
  bool operator==(const StabilityPoint&) const = default;
};

/// Returns true if the combination exists: a tool released on a surface flies off, and there is no loop.
bool is_possible(const StabilityPoint& point);

/// Static stiffness of the port at rest, along the direction into the body [N/m]; for a touch with the contact stiffness in
/// series.
double port_stiffness_n_m(const Scene& scene);
/// Returns the scene with its springs or materials and dampers scaled. Throws InputError if the contact stiffness alone is less
/// than `stiffness_n_m`.
Scene with_port_stiffness(Scene scene, double stiffness_n_m);

/// Reference of a point whose force is never cut; depends only on contact, hand, gesture and stiffness.
struct StabilityReference {
  Scene scene;
  ClosedLoopResult loop;
};
StabilityReference stability_reference(const Scene& body, const StabilityPoint& point);

struct StabilityResult {
  LoopVerdict verdict;
  ClosedLoopResult loop, reference;  ///< `reference` is the loop that it was judged against
  std::size_t rest_tick = 0;
  double cut_s = 0;  ///< time for which the force faded or was zero: no patch came for longer than the last was valid
};
/// A cut force drives the hand, whatever the display. If there were cuts, the reference is the hand on the full model whose force
/// is cut at the same times. Throws what closed_loop() throws.
StabilityResult measure_stability(const StabilityPoint& point, const StabilityReference& reference);

}  // namespace palpate
