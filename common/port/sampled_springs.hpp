// The forces of a patch beyond the linear model, from some of the body's own springs: scheme `hyper`, lattices.
//
// A spring e between nodes a and b has the span d = x_b - x_a at the stamp, and d + delta_e, delta_e = G_e u, G_e = V_b - V_a,
// when the variables of the patch are u: u = (displacement of the tool, q) for a grasp, u = q for touch, V_i the motion of node i
// with them, of shape 3 x n (node_motion.hpp). Springs share their nodes: in a mesh some five springs for two nodes, and a spring
// needs a tenth of the bytes of its nodes. With its energy U_e(|d|), tension T = U', axis n_e = d / |d| and damper c_e, and
// weights w_e >= 0 chosen so that few springs represent all (server/reduce/sample_springs.hpp),
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

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "common/base/limits.hpp"
#include "common/port/node_motion.hpp"
#include "common/port/patch.hpp"

namespace palpate {

inline constexpr int kMaxVariables = kMaxModes + 3;  ///< n: the modes, and the three axes of a tool that grasps
/// Bounds of the format, and so of a tick: four datagrams hold some 130 springs between 55 nodes (docs/reference/wire.md).
inline constexpr int kMaxSprings = 160, kMaxSpringNodes = 80;

struct SampledSprings {
  NodeMotion motion;                    ///< V_i
  Eigen::Matrix3Xf position;            ///< x_i [m], with any origin
  Eigen::Matrix2Xi ends;                ///< a and b
  Eigen::VectorXf rest_length;          ///< L [m]
  Eigen::VectorXf stiffness;            ///< w k [N/m]
  Eigen::VectorXf damping;              ///< w c [N s/m]
  float stiffening = 0;                 ///< c of the law, 0: linear
  std::vector<std::uint8_t> max_slope;  ///< 16 log2 sigma, for a law that stiffens
  int count() const { return static_cast<int>(rest_length.size()); }
  /// d
  Eigen::Matrix3Xf spans() const;
  /// sigma
  Eigen::ArrayXd steepest() const;
  /// Returns the bytes of such slopes, rounded up, from 1 to 6e4.
  static std::vector<std::uint8_t> steep_of(const Eigen::ArrayXd& slopes);
  /// Returns G_e, 3 rows a spring [1 for the tool, 1/kg^1/2 for q]; `tool`: number of variables, the first ones, that the tool
  /// prescribes.
  Eigen::MatrixXf motions(int tool) const;
};

/// Springs compiled for the haptic thread. Stands at u = 0 when it is new.
class SampledForce {
 public:
  static constexpr double kStableStiffness = 4;  ///< in 1 / h^2, for unit mass: an explicit step is stable below
  using Values = Eigen::Matrix<float, Eigen::Dynamic, 1, 0, (kMaxVariables + 7) / 8 * 8>;

  SampledForce() = default;
  /// `rate`: u'*; `slowed`: adds as much mass as the step needs.
  SampledForce(const SampledSprings& springs, int tool, const Eigen::VectorXd& rate, double step_s, bool slowed);

  /// True without springs, or when they are too stiff for the step and not slowed.
  bool empty() const { return count_ == 0; }
  /// A; empty where the springs need none.
  const ModeMatrix& added_mass() const { return added_mass_; }
  /// Least strain beyond which the law of a spring continues linearly; 0 for a linear one.
  double linear_from() const { return linear_from_; }
  /// sum w G^T (k - K_e) G: the least stiffness that E has far away, where every spring is stretched along its direction.
  Eigen::MatrixXd far_stiffness() const { return far_stiffness_; }
  /// Moves to u. No allocation, nor below.
  void move_to(const Values& u) noexcept;
  /// dE/du
  void gradient(Values& g) const noexcept;
  /// E [J]
  double energy() const noexcept;
  /// Computes the negative of the force on u due to the dampers' rotation, and B u, which is to be subtracted from it.
  void damping(const Values& rate, Values& change, Values& at_stamp) const noexcept;

 private:
  static constexpr int kFloatLanes = 8;  // lanes of a vector register of 256 bits
  static constexpr int kPaddedSprings = (kMaxSprings + kFloatLanes - 1) / kFloatLanes * kFloatLanes;  // whole registers
  using Each = Eigen::Array<float, Eigen::Dynamic, 1, 0, kPaddedSprings, 1>;
  using Vectors = Eigen::Array<float, Eigen::Dynamic, 3, Eigen::ColMajor, kPaddedSprings, 3>;  // a vector per spring
  using OfVariables = BoundedMatrix<kMaxVariables, kMaxVariables>;

  struct Deformed {  // delta, a, Delta, |d + delta|, T_2
    Vectors delta;
    Each along, longer, length, more;
  };
  /// Compute a v + b w, and v . w, for every spring.
  static Vectors sum(const Each& a, const Vectors& v, const Each& b, const Vectors& w) noexcept;
  static Each dot(const Vectors& v, const Vectors& w) noexcept;
  Vectors moved(const Values& u) const noexcept;
  Values collect(const Vectors& f) const noexcept;

  int count_ = 0, variables_ = 0;  // springs, padded with ones without stiffness to a whole register
  double linear_from_ = 0;
  // G, axis by axis
  Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, 3 * kPaddedSprings, kMaxVariables> motion_;
  Vectors axis_;
  Each length_, turning_, damping_;                    // l, kappa_e, w c_e
  Each stiffening_, elongation_, in_law_, linear_at_;  // w k c / L^2, and at the stamp e, b_0; where it is linear from: of
                                                       // a law that stiffens
  OfVariables damping_at_stamp_, far_stiffness_;       // B
  ModeMatrix added_mass_;
  Values u_;
  Deformed deformed_;
};

}  // namespace palpate
