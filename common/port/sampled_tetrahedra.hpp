// The forces of a patch beyond the linear model, from some of the body's own finite elements: scheme `hyper`, solids.
//
// A tetrahedron e of the nodes x_0..x_3, at rest X_0..X_3, has b_i, the gradients of its shape functions at rest, the deformation
// gradient F = sum x_i b_i^T at the stamp, and F + dF, dF = H_e u, H_e u = sum_i (V_i u) b_i^T, when the variables of the patch
// are u (sampled_springs.hpp; V_i: node_motion.hpp). With the energy density U beyond its second order at the stamp
// (nonlinear_tetrahedron.hpp) and w_e V_e, its weight times its volume,
//
//     E(u) = sum_e w_e V_e U_e(phi(|dF|) dF / |dF|)      [J]
//     elastic:  f = - dE/du
//     dampers rotate with their elements:  f -= sum_e w_e V_e H_e^T (P_v(F + phi dF / |dF|, F') - P_v(F, F')),   F' = H_e u'
//
// A triangle of a membrane is a tetrahedron whose last node is its first (server/body/tetra_kernel.hpp), V its area.
//
// At u = 0 all these forces and stiffnesses vanish: those are the linear patch's. phi(r) = r up to a = kFreeGradient and a + c (r
// - a) / (r - a + c) beyond, c = kFurtherGradient: further deformation is resisted by the linear patch alone, so the forces are
// bounded, and stay those of an energy.
//
// The player evaluates these forces once in a step of length h, which is stable for a stiffness below 4 / h^2 of unit mass. The
// tangent of an element at another F exceeds that at the stamp by an amount that grows with the part of lambda that a mode
// without dilation meets once the element has rotated relative to it, lambda sin^2; so the element's stiffness is bounded by
//     S = sum w V [ (2 mu + lambda) H^T H + 2 lambda (G : H)^T (G : H) ],   G the cofactors of F, R of a corotational law,
//     mu for a law of both invariants: mu_1 (e + b e') + mu_2 at the stamp, for a membrane mu |F|^2; for ogden and fibres half
//     of a bound of their tangent's eigenvalues there,
// and where its largest eigenvalue s is beyond 4 / h^2, the modes get A = (h^2 / 4 - 1 / s) S more mass, as for springs. That is
// no bound for every F within the ball (which is a hundred times that for a nearly incompressible solid, and would slow motions
// that matter); phi keeps the rest finite. tests/player and palpate-lab stability test the result.
//
// Source: see sampled_springs.hpp; the elements' laws nonlinear_tetrahedron.hpp.
#pragma once

#include <array>

#include "common/port/nonlinear_tetrahedron.hpp"
#include "common/port/sampled_springs.hpp"

namespace palpate {

inline constexpr int kMaxTetrahedra = 112;  ///< 14 vectors of 8; a bound of the format, and so of a tick

/// H of one tetrahedron, 9 rows, row by row of dF, from its b_1, b_2, b_3 as rows and the motions of its nodes relative to the
/// first, V_i - V_0.
using GradientMotion = Eigen::Matrix<float, 9, Eigen::Dynamic>;
GradientMotion gradient_motion(const Eigen::Matrix3f& gradients, const std::array<Eigen::Matrix3Xf, 3>& edges);

struct SampledTetrahedra {
  LawParameters law;                            ///< law of all elements with a volume
  NodeMotion motion;                            ///< V_i
  Eigen::Matrix3Xf position;                    ///< x_i [m], with any origin
  Eigen::Matrix3Xf rest;                        ///< X_i [m], with any origin
  Eigen::Matrix<int, 4, Eigen::Dynamic> nodes;  ///< each with a positive volume at rest, or the last is the first: a triangle
  Eigen::VectorXf shear, dilation;              ///< w V times Lame's parameters of small strains [J], for a triangle w area
  Eigen::VectorXf damping_s;                    ///< t of the viscous law
  int count() const { return static_cast<int>(shear.size()); }
  bool is_triangle(int tetrahedron) const { return nodes(3, tetrahedron) == nodes(0, tetrahedron); }
  /// Returns b_1, b_2, b_3 of one element as rows [1/m], and six times its volume or twice its area; b_0 = -(b_1 + b_2 + b_3).
  Eigen::Matrix3f gradients(int tetrahedron, float& volume) const;
  /// Returns H_e, 9 rows a tetrahedron [1/m for the tool, 1/(m kg^1/2) for q]; `tool` as for springs.
  Eigen::MatrixXf motions(int tool) const;
};

/// Tetrahedra compiled for the haptic thread. Stands at u = 0 when it is new.
class SampledSolidForce {
 public:
  /// Parameters of phi(|dF|): identity up to the first; the second is the largest excess. 1 and 2 cost up to 6 dB where elements
  /// rotate far (docs/notebook.md, 29).
  static constexpr float kFreeGradient = 2, kFurtherGradient = 3;
  using Values = SampledForce::Values;
  using Square = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxVariables, kMaxVariables>;

  SampledSolidForce() = default;
  /// `slowed`: adds as much mass as the step needs.
  SampledSolidForce(const SampledTetrahedra& solid, int tool, double step_s, bool slowed);

  /// True without tetrahedra, or when they are too stiff for the step and not slowed.
  bool empty() const { return groups() == 0; }
  /// A; empty where none is needed.
  const ModeMatrix& added_mass() const { return added_mass_; }
  /// Moves to u: the closer to the last one, the cheaper. No allocation, nor below.
  void move_to(const Values& u) noexcept;
  /// dE/du
  void gradient(Values& g) const noexcept;
  /// E [J]
  double energy() const noexcept;
  /// Computes the negative of the force on u due to the dampers' rotation, and the patch's part of it at the stamp, which is
  /// zero.
  void damping(const Values& rate, Values& change, Values& at_stamp) const noexcept;

  int variables() const { return variables_; }
  /// Number of groups of kTetraLane tetrahedra.
  int groups() const { return groups_; }
  /// Adds the sum of D_e over a group (lagged_damping.hpp).
  void add_dampers(int group, Square& dampers) const noexcept;

 private:
  static constexpr int kGroupsMax = (kMaxTetrahedra + kTetraLane - 1) / kTetraLane + 1;  // triangles are in groups of their own

  struct Group {
    ElementLinearisation stamp;
    TetraLane viscous_mu, viscous_lambda;  // times w V
    TetraLanes df;                         // phi dF / |dF|, in their frames
    bool free;                             // true: no |dF| is beyond kFreeGradient,
    TetraLane part, slope;                 // else phi / |dF| and phi'
    ElementRotation turned;
  };
  // sums over elements of the quantities of a variable, one lane each
  using Sums = std::array<TetraLane, kMaxVariables>;

  /// H of a group, in its elements' frames, for one variable: entry by entry, lane by lane.
  const float* motion(int group, int variable) const { return motion_.col(group * variables_ + variable).data(); }
  void moved(int group, const Values& u, TetraLanes& df) const noexcept;
  void collect(int group, const TetraLanes& f, Sums& sums) const noexcept;
  Values total(const Sums& sums) const noexcept;

  int groups_ = 0, variables_ = 0;  // padded with tetrahedra without stiffness to a whole register
  bool damped_ = false;
  std::array<Group, kGroupsMax> group_;
  Eigen::Matrix<float, 9 * kTetraLane, Eigen::Dynamic, Eigen::ColMajor, 9 * kTetraLane, kGroupsMax * kMaxVariables> motion_;
  ModeMatrix added_mass_;
};

}  // namespace palpate
