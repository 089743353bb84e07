// Tangent of sampled elements by central differences of their forces.
#pragma once

#include <Eigen/Dense>

namespace palpate::test {

/// Symmetric part of dg/du over the last `modes` of u, [modes x modes]: `force` is a SampledSpringForce or a SampledSolidForce,
/// and stays at the last place to which it was moved.
template <class Force>
Eigen::MatrixXd tangent_by_differences(Force& force, const typename Force::Values& u, int modes, float step) {
  Eigen::MatrixXd tangent(modes, modes);
  typename Force::Values more(u.size()), less(u.size());
  for (int i = 0; i < modes; ++i) {
    const typename Force::Values change = step * Force::Values::Unit(u.size(), u.size() - modes + i);
    force.move_to(u + change);
    force.gradient(more);
    force.move_to(u - change);
    force.gradient(less);
    tangent.col(i) = ((more - less) / (2 * step)).tail(modes).template cast<double>();
  }
  return 0.5 * (tangent + tangent.transpose());
}

}  // namespace palpate::test
