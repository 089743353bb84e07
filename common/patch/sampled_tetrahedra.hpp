// The forces of a patch beyond the linear model, from some of the body's own finite elements: scheme `hyper`, solids.
//
// A finite element e has the deformation gradient F at the stamp, and F + dF, dF = H_e u, when the variables of the patch are u
// (sampled_elements.hpp). With the energy density U beyond its second order at the stamp (common/mechanics/residual.hpp) and w_e
// V_e, its weight times its volume,
//
//     E(u) = sum_e w_e V_e U_e(phi(|dF|) dF / |dF|)      [J]
//     elastic:  f = - dE/du
//     dampers rotate with their elements:  f -= sum_e w_e V_e H_e^T (P_v(F + phi dF / |dF|, F') - P_v(F, F')),   F' = H_e u'
//
// At u = 0 all these forces and stiffnesses vanish: those are the linear patch's. phi(r) = r up to a = kFreeGradient and a + c (r
// - a) / (r - a + c) beyond, c = kFurtherGradient: further deformation is resisted by the linear patch alone, so the forces are
// bounded, and stay those of an energy.
//
// The player evaluates these forces once in a step of length h, which is stable for a stiffness below 4 / h^2 of unit mass. The
// tangent of an element at another F exceeds that at the stamp by an amount that grows with the part of lambda that a mode
// without dilation meets once the element has rotated relative to it, lambda sin^2; so the element's stiffness is bounded by
//     S = sum w V [ (m + lambda_L) H^T H + 2 lambda_L (G : H)^T (G : H) ],   G the cofactors of F,
//     m the largest absolute row sum of A - lambda_L G G^T at the stamp, A the tangent; at rest 2 mu_L
// and where its largest eigenvalue s is beyond 4 / h^2, the modes get A = (h^2 / 4 - 1 / s) S more mass, as for springs. That is
// no bound for every F within the ball (which is a hundred times that for a nearly incompressible solid, and would slow motions
// that matter); phi keeps the rest finite. tests/common/player and palpate-lab stability test the result.
//
// Source: see sampled_springs.hpp; laws: common/mechanics/laws.hpp.
#pragma once

#include "common/mechanics/residual.hpp"
#include "common/patch/sampled_force.hpp"

namespace palpate {

/// Finite elements of one law side by side, at one u.
struct SampledSolidGroup {
  static constexpr int kRows = 9;
  static constexpr int kGroupsMax = (kMaxFiniteElements + kSampledLanes - 1) / kSampledLanes + 1;  // triangles have their own
  /// Parameters of phi(|dF|): identity up to the first; the second is the largest excess. 1 and 2 cost up to 6 dB where elements
  /// rotate far (docs/notebook.md, 29).
  static constexpr float kFreeGradient = 2, kFurtherGradient = 3;

  ElementLinearisation stamp;
  LaneMatrix<ElementLane> f;               ///< F
  ElementLane viscous_mu, viscous_lambda;  ///< times w V
  ElementLane df[kRows];                   ///< phi dF / |dF|
  bool free = true;                        ///< true: no |dF| is beyond kFreeGradient,
  ElementLane part, slope;                 ///< else phi / |dF| and phi'

  /// Elements at rest, without stiffness.
  explicit SampledSolidGroup(const LawParameters& law = {});
  void move(const ElementLane (&change)[kRows]) noexcept;
  void force(ElementLane (&q)[kRows]) const noexcept;
  double energy() const noexcept { return stamp.energy(df); }
  void damping(const ElementLane (&rate)[kRows], ElementLane (&q)[kRows]) const noexcept;
  /// F + phi dF / |dF|
  LaneMatrix<ElementLane> deformation() const noexcept;
};

class SampledSolidForce : public SampledForce<SampledSolidGroup> {
 public:
  using Square = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxVariables, kMaxVariables>;

  SampledSolidForce() = default;
  /// `slowed`: adds as much mass as the step needs.
  SampledSolidForce(const SampledElements& solid, int tool, double step_s, bool slowed);

  /// Adds the sum of D_e over a group (lagged_damping.hpp).
  void add_dampers(int group, Square& dampers) const noexcept;
};

}  // namespace palpate
