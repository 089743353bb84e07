// The forces of a patch beyond the linear model: some of the body's own elements, with weights. Scheme `hyper`.
//
// The n variables are u = (d, q) for a grasp (d the tool's displacement from the stamp [m]), u = q for touch (r modes [m kg^1/2],
// n = r + 3 or r). The elements are springs (sampled_springs.hpp) or, in a solid, finite elements (sampled_tetrahedra.hpp), and
// have
//
//     E(u) [J], of third order in u and higher;  f [N for d, kg^1/2 m/s^2 for q]
//     elastic:  f = - dE/du - dE2/du,   E2(u) = sum_{i<=j} e2_ij u_i u_j
//     dampers rotate with their elements:  f -= D1(u) u', their damping force beyond that at the stamp, minus what the patch has
//     of it
//
// so that an element deforms like the body, however far, and stores the energy that it returns. Their weights are not negative.
//
// Dampers that have rotated may push. Their push is kept below the patch's own dampers D as they act, |D1 u'| <= c |D u'| in the
// norm x^T D^-1 x: so it never exceeds their damping; what is clipped from it is clipped from the part at the stamp too. c =
// kDamperShareMax is below 1, at which there would be no damping and what a tick adds to a fast damper would grow from tick to
// tick. Dampers that damp more after rotating may do so by any factor (those of a solid grow with the square of its stretch):
// where g = D1 u' is beyond that bound and u'^T g > 0, they are evaluated at the end of the step, along g alone, as R = g g^T /
// (u'^T g), which acts on u' like D1 and not at all across (R <= D1 where D1 >= 0). With C f the rates due to a force f on the
// modes at a step's end, f_b the force that the step has used already, and b the part at the stamp (B u of sampled_springs.hpp, 0
// for a solid), its end has u'_e = u' + C (b - f_b) - C R u'_e:
//     f = -alpha (g - b),   alpha = g^T (u' + C (b - f_b)) / (u'^T g + g^T C g)
// of second order where C g is small; from step to step, b = 0, u' - C f_b is multiplied by 1 - W R (1 + C R)^-1, W the effect of
// a force over a whole step, W / 2 <= C <= W, so nothing grows in the norm of W^-1 however large R is. One direction is not
// enough for a solid that is grasped and released: there S, D1 as it was some milliseconds ago (lagged_damping.hpp), is evaluated
// at the end of the step, and g = (D1 - S) u' remains for all this:
//     f = -S u'_e - alpha g,   u'_e = u' + C (f - f_b),   alpha as above with (1 + C S)^-1 C for C and the u'_e of g = 0.
// A touch has S where D damps its modes many times within a step.
//
// E2 restores what PSD projection removed from the stiffness of the linear patch; it is zero elsewhere. It is unbounded, so it is
// omitted unless patch and springs, these stretched without limit, keep the body stable in spite of it.
//
// The terms of a touch extend the surface beyond the part that fitted into the patch's own datagram: the tool can slide on where
// the patch's own piece ends. Those of a linear patch are that surface alone, without elements.
//
// Shapes: D, D1, S n x n, e2 n (n + 1) / 2 numbers, C r x r [s], f_b, g n. What can go wrong: springs that are too stiff for the
// step get twice as many steps; if they are still too stiff, their modes get more mass, or all is empty and only the linear patch
// is played. With a D that is not positive definite no damper rotates. Dampers that push more than c of D are felt too little;
// elastic forces stay those of an energy.
//
// Source: hyper-reduction, Farhat, Avery, Chapman and Cortial, IJNME 98 (2014).
#pragma once

#include <Eigen/Core>
#include <variant>
#include <vector>

#include "common/base/limits.hpp"
#include "common/patch/lagged_damping.hpp"
#include "common/patch/patch.hpp"
#include "common/patch/sampled_springs.hpp"
#include "common/patch/sampled_tetrahedra.hpp"

namespace palpate {

/// Index of u_i u_j, i <= j, among the products of n variables, and their number.
constexpr int pair_at(int i, int j) { return i + j * (j + 1) / 2; }
constexpr int pairs_of(int n) { return pair_at(0, n); }

struct NonlinearTerms {
  int variables = 0;     ///< 0: there are no terms
  bool grasp = false;    ///< true: u starts with the tool's displacement
  Eigen::VectorXd rate;  ///< u'* at the stamp [m/s, m kg^1/2 / s]
  Eigen::VectorXf e2;    ///< coefficient of u_i u_j at pair_at(i, j) [J/m^2 for d, J/(m^2 kg) for q], or empty
  SampledElements elements;
  // for a touch: vertices numbered after the patch's own, and triangles between any of them
  std::vector<PortVertex> vertices;
  std::vector<Triangle> triangles;
};

/// True when patch and terms together respect the limits of a surface.
bool has_room(const PortSurface& surface, const NonlinearTerms& terms);
/// Returns `patch` with the surface of its terms added. Requires has_room().
Patch extended(Patch patch, const NonlinearTerms& terms);

/// Number of steps in a tick, with terms: contact law and terms are of second order in the step. Doubled where springs are too
/// stiff for that.
inline constexpr int kTouchSteps = 2, kGraspSteps = 1;
inline constexpr float kDamperShareMax = 0.9F;  ///< c
/// Stiffness of u, with these stiffnesses of the modes: H = [[K_p, -B_k^T], [-B_k, diag(stiffness)]] for a grasp, diag(stiffness)
/// for touch.
Eigen::MatrixXd joint_stiffness(const Patch& patch, const Eigen::VectorXd& stiffness);
/// Damping of u, D: [[D_p, -B_d^T], [-B_d, D]] for a grasp, D for touch.
Eigen::MatrixXd joint_damping(const Patch& patch);

/// The terms, compiled for the haptic thread.
class NonlinearForce {
 public:
  using Variables = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxVariables, 1>;

  NonlinearForce() = default;
  /// `patch`: the patch of the terms; if its damping is not positive definite no damper rotates. Empty where no step is stable.
  /// Uses no heap memory afterwards, but takes some microseconds.
  NonlinearForce(const NonlinearTerms& terms, const Patch& patch);

  bool empty() const { return variables_ == 0; }
  /// Number of the player's steps in a tick.
  int steps() const { return steps_; }
  /// Mass of the modes in addition to 1, which springs need for a step; size 0: none (sampled_springs.hpp).
  const ModeMatrix& added_mass() const;
  /// Moves to u, for all that follows. No allocation, nor below.
  void move_to(const Variables& u) noexcept;
  /// Computes the elastic force on u.
  void elastic(Variables& force) const noexcept;
  /// Computes the force on u, with rate u', of dampers that have rotated. `closing`: C, of the modes, the last of u; `before`:
  /// f_b, of u.
  void damping(const Variables& u_rate, const ModeMatrix& closing, const Variables& before, Variables& force) noexcept;
  /// E + E2 [J], for tests of energy.
  double energy() const noexcept;

 private:
  using Values = SampledValues;

  /// For a solid's dampers, whose push exceeds that at the stamp by `change`. `most`: bound of their force beyond S.
  void brake_at_end(const Variables& change, const Variables& u_rate, const ModeMatrix& closing, const Variables& before,
                    float most, Variables& force) const noexcept;

  template <typename Of>
  decltype(auto) of_sampled(const Of& of) const {
    return std::visit(of, sampled_);
  }
  void take_e2(const NonlinearTerms& terms, const Patch& patch);
  /// Uses `steps_` steps a tick; false where that is not stable.
  bool take_elements(const NonlinearTerms& terms, bool slowed);

  int variables_ = 0, steps_ = 1;
  std::variant<SampledSpringForce, SampledSolidForce> sampled_;
  LaggedDamping lagged_damping_;  // only for a solid
  int since_asked_ = 0;           // steps since the last renew()
  bool has_e2_ = false, has_damping_ = false;
  Values u_;
  // second derivatives of E2; L^T and L^-1, D = L L^T
  Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxVariables, kMaxVariables> e2_, root_, inverse_;
};

}  // namespace palpate
