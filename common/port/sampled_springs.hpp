// What the forces of a patch have beyond the linear model, from some of the body's own springs: scheme `cubic`, where a body
// bends beyond any polynomial.
//
// A spring e between nodes a and b has d = x_b - x_a at the stamp, and delta_e = G_e u more, G_e = V_b - V_a, when the variables
// of the patch are u: u = (displacement of the tool, q) for a grasp, u = q for touch, V_i how node i moves with them, of shape
// 3 x n (node_motion.hpp). Springs share their nodes: in a mesh some five springs for two nodes, of which one takes a tenth of
// what its nodes take. With its energy U_e(|d|), tension T = U', axis n_e = d / |d| and damper c_e, and weights w_e >= 0 chosen
// so that few springs bend as all do (server/reduce/sample_springs.hpp),
//
//     E(u) = sum_e w_e [ U_e(|d + delta|) - U_e(|d|) - T n . delta - delta^T K_e delta / 2 ]        [J]
//     K_e = T' n n^T + (T / |d|) (1 - n n^T)
//     elastic:  f = - dE/du
//     dampers turn with their springs:  f -= sum_e w_e c_e G_e^T (m m^T - n n^T) G_e u' - B u
//     B = sum_e w_e c_e (n . G_e u'*) / |d| G_e^T (1 - n n^T) G_e
//
// m the axis at d + delta, u'* the rate at the stamp, B what the stiffness of the linear patch has of the dampers' forces there.
// At u = 0 nothing of all this pushes or holds, that is the linear patch's. Laws: linear and stiffening, T = k e (1 + c (e /
// L)^2) with e = |d| - L. The player takes these forces a tick at a time, which is stable for a stiffness below 4 /
// tick^2 of unit mass. With kappa the largest eigenvalue of sum w k G_q^T G_q, the law goes on straight where its slope is
// kStiffest / (tick^2 kappa) times k; springs for which that is below 1 are not taken at all, nor those that are so compressed at
// the stamp that, let go of, they add more than that to K_e (far_stiffness()). All is kept in single precision.
//
// Source: energy-conserving sampling and weighting, Farhat, Avery, Chapman and Cortial, IJNME 98 (2014); optimized cubature, An,
// Kim and James, SIGGRAPH Asia (2008).
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>

#include "common/base/limits.hpp"
#include "common/port/node_motion.hpp"

namespace palpate {

inline constexpr int kMaxVariables = kMaxModes + 3;
inline constexpr int kMaxSprings = 160, kMaxSpringNodes = 80;

struct SampledSprings {
  NodeMotion motion;            ///< V_i
  Eigen::Matrix3Xf position;    ///< x_i [m], of any origin
  Eigen::Matrix2Xi ends;        ///< a and b
  Eigen::VectorXf rest_length;  ///< L [m]
  Eigen::VectorXf stiffness;    ///< w k [N/m]
  Eigen::VectorXf damping;      ///< w c [N s/m]
  float stiffening = 0;         ///< c of the law, 0: linear
  int count() const { return static_cast<int>(rest_length.size()); }
  /// d
  Eigen::Matrix3Xf spans() const;
  /// G_e, 3 rows a spring [1 for the tool, 1/kg^1/2 for q]; `tool`: variables that the tool prescribes, the first.
  Eigen::MatrixXf motions(int tool) const;
};

/// Compiled for the haptic thread.
class SampledForce {
 public:
  static constexpr double kStiffest = 4;
  using Values = Eigen::Matrix<float, Eigen::Dynamic, 1, 0, (kMaxVariables + 7) / 8 * 8>;

  SampledForce() = default;
  /// `rate`: u'*.
  SampledForce(const SampledSprings& springs, int tool, const Eigen::VectorXd& rate, double tick_s);

  /// No springs, or none that are stable.
  bool empty() const { return count_ == 0; }
  /// Strain beyond which the law goes on straight; 0 for a linear one.
  double straight_from() const { return straight_from_; }
  /// sum w G^T (k - K_e) G: the least stiffness that E has far away, where every spring is stretched along its way.
  Eigen::MatrixXd far_stiffness() const { return far_stiffness_; }
  /// dE/du. No allocation.
  void gradient(const Values& u, Values& g) const noexcept;
  /// E [J]
  double energy(const Values& u) const noexcept;
  /// Minus what the dampers' turning adds to the force on u, and B u, which is to be taken from that.
  void damping(const Values& u, const Values& rate, Values& change, Values& at_stamp) const noexcept;

 private:
  static constexpr int kRoom = (kMaxSprings + 7) / 8 * 8, kNodeRoom = (kMaxSpringNodes + 7) / 8 * 8;
  using Each = Eigen::Array<double, Eigen::Dynamic, 1, 0, kRoom, 1>;
  using Exact = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, (kMaxVariables + 7) / 8 * 8>;
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kNodeRoom, kMaxVariables>;
  using OfNodes = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kNodeRoom>;

  struct Vectors {  // of every spring
    Each x, y, z;
    Each dot(const Vectors& v) const { return x * v.x + y * v.y + z * v.z; }
  };
  Vectors moved(const Exact& u) const noexcept;
  Exact collect(const Vectors& f) const noexcept;
  Each tension(const Each& elongation) const noexcept;
  Each slope(const Each& elongation) const noexcept;
  Each stored(const Each& elongation) const noexcept;

  int count_ = 0, variables_ = 0;
  double stiffening_ = 0, straight_from_ = 0;
  Rows rows_x_, rows_y_, rows_z_;  // V
  std::array<std::uint8_t, kMaxSprings> a_{}, b_{};
  Vectors span_, axis_;
  Each length_, rest_length_, stiffness_, damping_;
  Each tension_, along_, across_, stored_;  // at the stamp: T, T' - T / |d|, T / |d|, U
  using OfVariables = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxVariables, kMaxVariables>;
  OfVariables braked_;  // B
  OfVariables far_stiffness_;
};

}  // namespace palpate
