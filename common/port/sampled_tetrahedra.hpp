// What the forces of a patch have beyond the linear model, from some of the body's own finite elements: scheme `hyper`, solids.
//
// A tetrahedron e of the nodes x_0..x_3, at rest X_0..X_3, has b_i, the gradients of its shape functions at rest, the deformation
// gradient F = sum x_i b_i^T at the stamp, and dF = H_e u more, H_e u = sum_i (V_i u) b_i^T, when the variables of the patch are
// u (sampled_springs.hpp; V_i: node_motion.hpp). With the energy density U beyond its second order at the stamp
// (nonlinear_tetrahedron.hpp) and w_e V_e, what it counts times its volume,
//
//     E(u) = sum_e w_e V_e U_e(phi(|dF|) dF / |dF|)      [J]
//     elastic:  f = - dE/du
//     dampers turn with their elements:  f -= sum_e w_e V_e H_e^T (P_v(F + phi dF / |dF|, F') - P_v(F, F')),   F' = H_e u'
//
// A triangle of a membrane is a tetrahedron whose last node is its first (server/body/tetra_kernel.hpp), V its area.
//
// At u = 0 nothing of all this pushes or holds, that is the linear patch's. phi(r) = r up to a = kFreeGradient and
// a + c (r - a) / (r - a + c) beyond, c = kFurtherGradient: an element that is bent further is held by the linear patch alone, so
// the forces are bounded, and stay those of an energy.
//
// The player takes these forces a step of length h at a time, which is stable for a stiffness below 4 / h^2 of unit mass. What an
// element's tangent at another F is stiffer by than at the stamp grows with the part of lambda that a mode without dilation meets
// once the element has turned beyond it, lambda sin^2; so that of the element counts as
//     S = sum w V [ (2 mu + lambda) H^T H + 2 lambda (G : H)^T (G : H) ],   G the cofactors of F, R of a corotational law,
//     mu of a law of both invariants mu_1 (e + b e') + mu_2 at the stamp, of a membrane mu |F|^2; of ogden and fibres half of a
//     bound of their tangent's eigenvalues there,
// and where its largest eigenvalue s is beyond 4 / h^2, the modes are given A = (h^2 / 4 - 1 / s) S more mass, as for springs.
// That is no bound for every F within the ball (which is a hundred times that for a nearly incompressible solid, and would slow
// motions that matter); phi is what keeps the rest finite. tests/player and palpate-lab stability ask what comes of it.
//
// Source: see sampled_springs.hpp; the elements' laws nonlinear_tetrahedron.hpp.
#pragma once

#include <array>

#include "common/port/nonlinear_tetrahedron.hpp"
#include "common/port/sampled_springs.hpp"

namespace palpate {

inline constexpr int kMaxTetrahedra = 112;  ///< 14 vectors of 8; a bound of the format, and so of a tick

/// H of one, 9 rows, row by row of dF, from its b_1, b_2, b_3 as rows and how its nodes move from the first, V_i - V_0.
using GradientMotion = Eigen::Matrix<float, 9, Eigen::Dynamic>;
GradientMotion gradient_motion(const Eigen::Matrix3f& gradients, const std::array<Eigen::Matrix3Xf, 3>& edges);

struct SampledTetrahedra {
  LawParameters law;                            ///< of all that have a volume
  NodeMotion motion;                            ///< V_i
  Eigen::Matrix3Xf position;                    ///< x_i [m], of any origin
  Eigen::Matrix3Xf rest;                        ///< X_i [m], of any origin
  Eigen::Matrix<int, 4, Eigen::Dynamic> nodes;  ///< of each, a positive volume at rest, or the last is the first: a triangle
  Eigen::VectorXf shear, dilation;              ///< w V times Lame's parameters of small strains [J], of a triangle w area
  Eigen::VectorXf damping_s;                    ///< t of the viscous law
  int count() const { return static_cast<int>(shear.size()); }
  bool is_triangle(int tetrahedron) const { return nodes(3, tetrahedron) == nodes(0, tetrahedron); }
  /// b_1, b_2, b_3 of one as rows [1/m], and six times its volume or twice its area; b_0 = -(b_1 + b_2 + b_3).
  Eigen::Matrix3f gradients(int tetrahedron, float& volume) const;
  /// H_e, 9 rows a tetrahedron [1/m for the tool, 1/(m kg^1/2) for q]; `tool` as for springs.
  Eigen::MatrixXf motions(int tool) const;
};

/// Compiled for the haptic thread. Stands at u = 0 when it is new.
class SampledSolidForce {
 public:
  /// Of |dF|: taken as it is; then up to so much more. 1 and 2 cost up to 6 dB where elements turn far (docs/notebook.md, 29).
  static constexpr float kFreeGradient = 2, kFurtherGradient = 3;
  using Values = SampledForce::Values;
  using Square = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxVariables, kMaxVariables>;

  SampledSolidForce() = default;
  /// `slowed`: with as much mass as the step takes.
  SampledSolidForce(const SampledTetrahedra& solid, int tool, double step_s, bool slowed);

  /// No tetrahedra, or too stiff for the step and not slowed.
  bool empty() const { return groups() == 0; }
  /// A; nothing where none is needed.
  const ModeMatrix& added_mass() const { return added_mass_; }
  /// To u: the nearer to where it was, the less it takes. No allocation, nor below.
  void move_to(const Values& u) noexcept;
  /// dE/du
  void gradient(Values& g) const noexcept;
  /// E [J]
  double energy() const noexcept;
  /// Minus what the dampers' turning adds to the force on u, and what the patch has of that at the stamp, which is nothing.
  void damping(const Values& rate, Values& change, Values& at_stamp) const noexcept;

  int variables() const { return variables_; }
  /// Tetrahedra side by side, so many times.
  int groups() const { return groups_; }
  /// Adds sum of D_e over a group (lagged_damping.hpp).
  void add_dampers(int group, Square& dampers) const noexcept;

 private:
  static constexpr int kGroupsMax = (kMaxTetrahedra + kTetraLane - 1) / kTetraLane + 1;  // triangles by themselves

  struct Group {
    TetraStamp stamp;
    TetraLane viscous_mu, viscous_lambda;  // times w V
    TetraLanes df;                         // phi dF / |dF|, in their frames
    bool free;                             // no |dF| is beyond kFreeGradient,
    TetraLane part, slope;                 // else phi / |dF| and phi'
    TetraTurn turned;
  };
  // Sums over elements, a lane each, of what belongs to a variable.
  using Sums = std::array<TetraLane, kMaxVariables>;

  /// H of a group, in its elements' frames, for one variable: entry by entry, side by side.
  const float* motion(int group, int variable) const { return motion_.col(group * variables_ + variable).data(); }
  void moved(int group, const Values& u, TetraLanes& df) const noexcept;
  void collect(int group, const TetraLanes& f, Sums& sums) const noexcept;
  Values total(const Sums& sums) const noexcept;

  int groups_ = 0, variables_ = 0;  // with as many tetrahedra more, of no stiffness, as fill the last register
  bool damped_ = false;
  std::array<Group, kGroupsMax> group_;
  Eigen::Matrix<float, 9 * kTetraLane, Eigen::Dynamic, Eigen::ColMajor, 9 * kTetraLane, kGroupsMax * kMaxVariables> motion_;
  ModeMatrix added_mass_;
};

}  // namespace palpate
