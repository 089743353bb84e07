// Selection of a body's integrator: the cheapest that is stable, by how long its steps may be and what one costs.
//
//     explicit    (springs (with gaps) * kLeapfrogNs or kStageNs + hexahedra by their law) * stages / its step,
//                 which is shorter where it has several stages and the scene's tools touch
//     tr-bdf2     springs * kSpringNs or edges of elements * kTetraNs or kHexaNs / its longest step
//
// are the estimated costs of a second of body time. Steps of several stages ("stabilised") have to be kStabilisedWorth times
// cheaper than those of one, leapfrog, which is more accurate, and that has to take more than kLeapfrogMost of a core; explicit
// ones of either kind kExplicitWorth times cheaper than implicit ones, because the estimate leaves out what touching tools cost:
// of leapfrog a clipped lattice of 1,500 nodes takes a third more than it says with two of them, three times as much with
// sixteen. A solid with hardly any dampers is stepped explicitly only where the scene says so
// (ExplicitIntegrator::may_resonate()). One that is grasped has no stabilised steps: they follow what a node that is moved sends
// into a body that is nearly incompressible and damped to 1 % in steps of 1 ms, and not at all in longer ones. The constants of a
// step are a measured iteration (20 ns a spring, 46 an edge of hexahedra) times 6.6 iterations; no clock is read, so that a scene
// has the same integrator in every run. Finite elements that are stepped implicitly take shorter ones than the scene's longest as
// long as these cost no more than a tenth of a core: to 2.5 ms.
#pragma once

#include <memory>
#include <string>

#include "server/body/skin.hpp"
#include "server/dynamics/stepper.hpp"

namespace palpate {

struct ChosenStepper {
  std::unique_ptr<Stepper> stepper;
  std::string reason;  ///< one line for people: which one and why
  double cost = 0;     ///< estimate: share of a core
  double step_s = 0;   ///< the longest to ask it for
};

/// `dynamics` and `skin` must outlive it. Throws InputError where the scene asks for one that its body does not suit.
ChosenStepper choose_stepper(const Scene& scene, const Dynamics& dynamics, const Skin& skin);
/// Returns the stepper that was chosen for another body of the same scene, for this one.
ChosenStepper same_stepper(const ChosenStepper& other, const Dynamics& dynamics, const Skin& skin);

}  // namespace palpate
