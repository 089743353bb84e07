// The forces of a patch beyond the linear model, from some of the body's own springs: scheme `hyper`, lattices.
//
// A spring e has the span d = x_b - x_a at the stamp, and d + delta_e, delta_e = G_e u, when the variables of the patch are u
// (sampled_elements.hpp, with H_e = G_e). With its energy U_e(|d|), tension T = U', axis n_e = d / |d| and damper c_e, and
// weights w_e >= 0 chosen so that few springs represent all (server/sampling/sampling.hpp),
//
//     E(u) = sum_e w_e [ U_e(|d + delta|) - U_e(|d|) - T n . delta - delta^T K_e delta / 2 ]        [J]
//     K_e = T' n n^T + (T / |d|) (1 - n n^T)
//     elastic:  f = - dE/du
//     dampers rotate with their springs:  f -= sum_e w_e c_e G_e^T (m m^T - n n^T) G_e u' - B u
//     B = sum_e w_e c_e (n . G_e u'*) / |d| G_e^T (1 - n n^T) G_e
//
// m the axis at d + delta, u'* the rate at the stamp, B the part of the dampers' forces there that the stiffness of the linear
// patch includes. At u = 0 all these forces and stiffnesses vanish: those are the linear patch's. Laws: linear and stiffening, T
// = k e (1 + c (e / L)^2) with e = |d| - L.
//
// The player evaluates these forces once in a step of length h, which is stable for a stiffness below 4 / h^2 of unit mass. A
// spring with a stiffening law follows it at least up to a slope of sigma_e k, and continues linearly: sigma_e is the slope that
// the springs are likely to reach, chosen by the server; 1 for a linear law. Let kappa be the largest eigenvalue of sum w sigma k
// G_q^T G_q. The law continues linearly at 4 / (h^2 kappa) times that slope. Where that factor is below 1, the body is too stiff
// for the step: its modes get
//     A = (h^2 / 4 - 1 / s) S,   S = sum w sigma k G_q^T G_q min(max(1, L / |d|), 2)
// more mass, s the largest eigenvalue of S. Then no rotation of springs makes a motion stiffer than 4 / h^2 of its mass; motions
// for which S is far below 4 / h^2 are hardly affected. Springs so compressed at the stamp that their stiffness would exceed that
// after release (far_stiffness()) are not used at all.
//
// All is stored in single precision, so no difference of numbers that nearly cancel is computed: with l = |d|, a = n . delta,
//     Delta = |d + delta| - l = (2 l a + |delta|^2) / (|d + delta| + l),  a - Delta = (a Delta - |delta|^2) / (|d + delta| + l),
//     T_2 = T(|d + delta|) - T - T' Delta = k c / L^2 beta (3 e (b + b_0) + beta (b + 2 b_0)) with elongations b_0 and b at d
//           and d + delta up to the end of the law, beta = b - b_0, and e the elongation beyond b,
// a spring pulls its end b back with
//     ((kappa_e Delta + T_2) delta + (l T_2 - kappa_e (l (a - Delta) + a Delta)) n) / |d + delta|,   kappa_e = T' - T / l
// and has the energy kappa_e (Delta^2 - a^2) / 2 and that of T_2.
//
// Source: energy-conserving sampling and weighting, Farhat, Avery, Chapman and Cortial, IJNME 98 (2014); optimized cubature, An,
// Kim and James, SIGGRAPH Asia (2008); added mass, Olovsson, Simonsson and Unosson, IJNME 63 (2005).
#pragma once

#include "common/patch/sampled_force.hpp"

namespace palpate {

/// Springs side by side, at one u.
struct SampledSpringGroup {
  static constexpr int kRows = 3, kGroupsMax = (kMaxSprings + kSampledLanes - 1) / kSampledLanes;

  ElementLane axis[3], length, turning, damper;  ///< n, l, kappa_e, w c
  bool stiffens = false;
  ElementLane stiffening, elongation, in_law, linear_at;  ///< w k c / L^2, and at the stamp e, b_0; where it is linear from
  ElementLane delta[3], along, longer, reach, more;       ///< delta, a, Delta, |d + delta|, T_2

  /// Springs without stiffness.
  SampledSpringGroup();
  void move(const ElementLane (&change)[kRows]) noexcept;
  void force(ElementLane (&q)[kRows]) const noexcept;
  double energy() const noexcept;
  void damping(const ElementLane (&rate)[kRows], ElementLane (&q)[kRows]) const noexcept;
};

class SampledSpringForce : public SampledForce<SampledSpringGroup> {
 public:
  SampledSpringForce() = default;
  /// `rate`: u'*; `slowed`: adds as much mass as the step needs.
  SampledSpringForce(const SampledElements& springs, int tool, const Eigen::VectorXd& rate, double step_s, bool slowed);

  /// Least strain beyond which the law of a spring continues linearly; 0 for a linear one.
  double linear_from() const { return linear_from_; }
  /// sum w G^T (k - K_e) G: the least stiffness that E has far away, where every spring is stretched along its direction.
  Eigen::MatrixXd far_stiffness() const { return far_stiffness_; }

 private:
  double linear_from_ = 0;
  BoundedMatrix<kMaxVariables, kMaxVariables> far_stiffness_;
};

}  // namespace palpate
