// What the forces of a patch have beyond the linear model: some of the body's own elements, with weights. Scheme `hyper`.
//
// The n variables are u = (d, q) for a grasp (d the tool's displacement from the stamp [m]), u = q for touch (r modes [m kg^1/2],
// n = r + 3 or r). The elements are springs (sampled_springs.hpp) or, of a solid, finite elements (sampled_tetrahedra.hpp), and
// have
//
//     E(u) [J], of third order in u and higher;  f [N for d, kg^1/2 m/s^2 for q]
//     elastic:  f = - dE/du - dE2/du,   E2(u) = sum_{i<=j} e2_ij u_i u_j
//     dampers turn with their elements:  f -= D1(u) u', what they brake more than at the stamp, less what the patch has of it
//
// so that an element bends as the body does, however far, and stores what it gives back. Their weights are not negative.
//
// Dampers that have turned may push. What pushes is kept below the patch's own dampers D as it acts, |D1 u'| <= c |D u'| in the
// norm x^T D^-1 x: so it never pushes more than those brake; what is left out of it is left out of the part at the stamp too. c =
// kDamperShareMax, short of 1, where nothing would brake and what a tick adds to a fast brake would grow from tick to tick.
// Dampers that brake more for having turned may do so by any factor (those of a solid grow with the square of its stretch): where
// g = D1 u' is beyond that bound and u'^T g > 0, they are taken at the end of the step, along g alone, as R = g g^T / (u'^T g),
// which does to u' what D1 does and nothing across (R <= D1 where D1 >= 0). With C f the rates that a force f on the modes gives
// at a step's end, f_b the force that the step went with already, and b the part at the stamp (B u of sampled_springs.hpp, 0 of a
// solid), its end has u'_e = u' + C (b - f_b) - C R u'_e:
//     f = -alpha (g - b),   alpha = g^T (u' + C (b - f_b)) / (u'^T g + g^T C g)
// of second order where C g is small; from step to step, b = 0, u' - C f_b goes by 1 - W R (1 + C R)^-1, W what a whole step
// gives, W / 2 <= C <= W, which lets nothing grow in the norm of W^-1 however large R is. One direction is not enough for a solid
// that is grasped and let go of: there S, D1 as it was some milliseconds ago (lagged_damping.hpp), is taken at the end of the
// step, and g = (D1 - S) u' is what is left for all this:
//     f = -S u'_e - alpha g,   u'_e = u' + C (f - f_b),   alpha as above with (1 + C S)^-1 C for C and the u'_e of g = 0.
// A touch has S where D brakes its modes away many times within a step.
//
// E2 gives back what PSD projection took from the stiffness of the linear patch; it is zero elsewhere. It has no end, so
// it is left out unless patch and springs, these stretched without end, hold the body up in spite of it.
//
// The terms of a touch bring more of the surface too, what the patch's own datagram had no room for: the tool goes on where the
// patch's own piece ends.
//
// Shapes: D, D1, S n x n, e2 n (n + 1) / 2 numbers, C r x r [s], f_b, g n.
// What can go wrong: springs that are too stiff for the step have twice as many steps; elements that still are have more mass in
// their modes, or all is empty and the linear patch goes on. A D that is not positive definite lets no damper turn. Dampers that
// push are felt too little where they would push more than c of D; elastic forces stay those of an energy.
//
// Source: hyper-reduction, Farhat, Avery, Chapman and Cortial, IJNME 98 (2014).
#pragma once

#include <Eigen/Core>
#include <variant>
#include <vector>

#include "common/base/limits.hpp"
#include "common/port/lagged_damping.hpp"
#include "common/port/patch.hpp"
#include "common/port/sampled_springs.hpp"
#include "common/port/sampled_tetrahedra.hpp"

namespace palpate {

/// Where u_i u_j stands, i <= j, among the products of n variables, and how many there are.
constexpr int pair_at(int i, int j) { return i + j * (j + 1) / 2; }
constexpr int pairs_of(int n) { return pair_at(0, n); }

struct NonlinearTerms {
  int variables = 0;     ///< 0: there are no terms
  bool grasp = false;    ///< u starts with the tool's displacement
  Eigen::VectorXd rate;  ///< u'* at the stamp [m/s, m kg^1/2 / s]
  Eigen::VectorXf e2;    ///< of u_i u_j at pair_at(i, j) [J/m^2 for d, J/(m^2 kg) for q], or nothing
  SampledSprings springs;
  SampledTetrahedra solid;  ///< never beside springs
  // of a touch: vertices numbered on from the patch's own, and triangles between any of them
  std::vector<PortVertex> vertices;
  std::vector<Triangle> triangles;
};

/// Whether patch and terms together keep to the limits of a surface.
bool has_room(const PortSurface& surface, const NonlinearTerms& terms);
/// `patch` with the surface that its terms bring, for which it has room.
Patch extended(Patch patch, const NonlinearTerms& terms);

/// Of the player in a tick, with terms: contact law and terms are of second order in the step. Twice as many where springs are
/// too stiff for that.
inline constexpr int kTouchSteps = 2, kGraspSteps = 1;
inline constexpr float kDamperShareMax = 0.9F;  ///< c
/// Of u, with these stiffnesses of the modes: H = [[K_p, -B_k^T], [-B_k, diag(stiffness)]] for a grasp, diag(stiffness) for
/// touch.
Eigen::MatrixXd joint_stiffness(const Patch& patch, const Eigen::VectorXd& stiffness);
/// D of u: [[D_p, -B_d^T], [-B_d, D]] for a grasp, D for touch.
Eigen::MatrixXd joint_damping(const Patch& patch);

/// Compiled for the haptic thread.
class NonlinearForce {
 public:
  using Variables = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxVariables, 1>;

  NonlinearForce() = default;
  /// Beside the patch that the terms go with; where its damping is not positive definite no damper turns. Empty where nothing
  /// is stable. Allocates nothing that outlives it, but takes some microseconds.
  NonlinearForce(const NonlinearTerms& terms, const Patch& patch);

  bool empty() const { return variables_ == 0; }
  /// In which the player takes them, in a tick.
  int steps() const { return steps_; }
  /// Of the modes beside 1, as springs need it for a step; of no size: none (sampled_springs.hpp).
  const ModeMatrix& added_mass() const;
  /// To u, for all that follows. No allocation, nor below.
  void move_to(const Variables& u) noexcept;
  /// Elastic force on u.
  void elastic(Variables& force) const noexcept;
  /// Force on u, that moves at u', of dampers that have turned. `closing`: C, of the modes, the last of u; `before`: f_b, of u.
  void damping(const Variables& u_rate, const ModeMatrix& closing, const Variables& before, Variables& force) noexcept;
  /// E + E2 [J], for tests of energy.
  double energy() const noexcept;

 private:
  using Values = SampledForce::Values;

  /// Of a solid's dampers that push `change` more than at the stamp, `most`: the bound of what they do beside S.
  void brake_at_end(const Variables& change, const Variables& u_rate, const ModeMatrix& closing, const Variables& before,
                    float most, Variables& force) const noexcept;

  template <typename Of>
  decltype(auto) of_sampled(const Of& of) const {
    return std::visit(of, sampled_);
  }
  void take_e2(const NonlinearTerms& terms, const Patch& patch);
  /// In steps of this many a tick; false where that is not stable.
  bool take_elements(const NonlinearTerms& terms, bool slowed);

  int variables_ = 0, steps_ = 1;
  std::variant<SampledForce, SampledSolidForce> sampled_;
  LaggedDamping lagged_damping_;  // of a solid
  int since_asked_ = 0;           // steps since those were asked
  bool has_e2_ = false, has_damping_ = false;
  Values u_;
  // The second derivatives of E2; L^T and L^-1, D = L L^T.
  Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxVariables, kMaxVariables> e2_, root_, inverse_;
};

}  // namespace palpate
