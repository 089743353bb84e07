// One point of the stability sweep: a hand, what it does, on a body of a given stiffness, through a scheme over a link.
//
// The body is the caller's, its springs or materials scaled so that its port, at rest, has the wanted static stiffness; dampers
// by the root of that, so that a stiffer body keeps its damping ratios and is no easier to calm. A touch feels the body behind
// its contact stiffness: the two in series have the wanted stiffness.
//
// The hand (hand.hpp) is light or firm and carries out the whole gesture, or `free`: the reference hand carries it out and opens
// in the middle of it, after which the device's 75 g are alone with the display. In a release the reference hand presses and
// becomes the named one at still_s. No tremor, force not quantised, position in the device's steps; the guard limits force and
// slew and does not damp: what is judged is the scheme.
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

/// Whether the combination exists: a tool that is let go of on a surface flies off, and there is no loop left.
bool is_possible(const StabilityPoint& point);

/// Static stiffness of the port at rest, along the way into the body [N/m]; of a touch with its contact stiffness in series.
double port_stiffness_n_m(const Scene& scene);
/// The scene with springs or materials and dampers so scaled. InputError when the contact stiffness alone is less than
/// `stiffness_n_m`.
Scene with_port_stiffness(Scene scene, double stiffness_n_m);

/// The reference of a point whose force is never cut: depends on contact, hand, gesture and stiffness alone.
struct StabilityReference {
  Scene scene;
  ClosedLoopResult loop;
};
StabilityReference stability_reference(const Scene& body, const StabilityPoint& point);

struct StabilityResult {
  LoopVerdict verdict;
  ClosedLoopResult loop, reference;  ///< reference: what it was judged against
  std::size_t rest_tick = 0;
  double cut_s = 0;  ///< for which the force faded, or was gone: no patch came for longer than the last was valid
};
/// A force that is cut drives the hand, whatever displays it: where it was, the reference is the hand on the full model whose
/// force is cut at the same times. Throws what closed_loop() throws.
StabilityResult measure_stability(const StabilityPoint& point, const StabilityReference& reference);

}  // namespace palpate
