// Nonlinear forces of a patch, evaluated at one place.
#pragma once

namespace palpate {

template <typename Force, typename Values>
double energy_at(Force& force, const Values& u) {
  force.move_to(u);
  return force.energy();
}

}  // namespace palpate
