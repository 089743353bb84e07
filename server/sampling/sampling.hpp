// A few elements of a body whose weighted forces represent those of all (hyper-reduction by energy-conserving sampling and
// weighting): the problem and the fit, for springs and finite elements alike (sample_elements.hpp).
//
// For likely displacements u_s, with r_e(u) the contribution of element e beyond the linear force on the variables, the fit looks
// for weights w_e >= 0, few of them not zero, such that
//
//     sum_s | sum_e w_e r_e(u_s) - sum_(all e) r_e(u_s) |^2 / g_s^2       is small,
//     g_s = |sum_(all e) r_e(u_s)| + kLinearForceShare |K u_s|
//
// with forces in units that make the stiffness of each variable 1, except that those at the port count kPortWeight times. The
// method is a greedy non-negative least squares (sparse_nnls.hpp) in which elements between nodes that are sent anyway are cheap:
// candidates are those with the largest contributions at the samples, and weights are fitted once more to the nodes' motions as
// sent. As no w_e is negative, the chosen elements stiffen and buckle as the body's do, and store energy as they do beyond its
// second order at the stamp.
//
// Samples are the displacements from which a patch's basis was made: the likeliest alone, once and doubled, with both signs, and
// random mixtures of all, the same in every run. Instead of all samples the fit uses kSampleSums orthogonal sums of them.
//
// Shapes: n variables; u_s, r_e: n; K the diagonal of the stiffness, n numbers. There is no result if no weight is positive; if
// the bytes run out first, the sum above is not small.
//
// Source: see common/patch/sampled_springs.hpp; sums of samples: Woodruff, FnTTCS 10 (2014), chapter 2.
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "common/patch/terms_pieces.hpp"
#include "server/elements/body_state.hpp"
#include "server/sampling/sparse_nnls.hpp"

namespace palpate {

inline constexpr double kLinearForceShare = 0.1;  ///< smaller errors relative to the linear force are imperceptible
inline constexpr int kSamples = 72;               ///< measured: more take longer than they gain (docs/notebook.md, 23)
inline constexpr float kPortWeight = 4;    ///< for grasped solids; measured: 1 costs 1.3 dB, 8 costs 0.2 (docs/notebook.md, 43)
inline constexpr float kFitError = 3e-3F;  ///< tolerance relative to |t|: a third of it gains nothing (docs/notebook.md, 40)

using Rows = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using SampleMatrix = Eigen::Matrix<float, Eigen::Dynamic, kSamples, Eigen::RowMajor>;

struct Sampling {
  Matrix likely;                        ///< u of likely displacements of the body, each in its likely size, one per column
  std::vector<Eigen::Index> likeliest;  ///< of these columns: the first three are also samples by themselves
  Vector stiffness;                     ///< of each variable, > 0
  Matrix at_port;                       ///< forces f on the variables are at_port^T f at the port; may have no columns
  TermsBudget budget;                   ///< bytes available to elements
  int tool = -1;                        ///< the node that a tool holds; the first three variables are its motion
};

/// Returns u_s, one per column.
Matrix samples(const Sampling& sampling);
/// Returns L with fewer columns than u such that |G u_s| over all samples is |G L|: L L^T = sum u_s u_s^T.
Matrix root_of(const Matrix& u);

/// Returns the candidates: the indices of the largest contributions, at most `most`, ascending.
std::vector<std::uint32_t> largest(const Eigen::VectorXf& parts, std::size_t most);

/// Contributions of elements beyond the linear force at the samples, one matrix for each number of an element, one row per
/// element.
struct ElementForces {
  std::vector<Rows> motion;         ///< of each number with the variables, elements x n
  std::vector<SampleMatrix> force;  ///< nonlinear force of each number at the samples
};

/// Forces on the variables at sums of samples, in units in which every sample counts equally.
class SampledResiduals {
 public:
  /// `all`: forces of all elements together, n x samples.
  SampledResiduals(const Eigen::MatrixXf& all, const Matrix& u, const Sampling& sampling);
  const Eigen::VectorXf& all() const { return all_; }
  /// Returns the forces of each element, one per column; valid until the next call.
  const Eigen::MatrixXf& parts(const ElementForces& elements) const;

 private:
  Eigen::VectorXf unit_, all_;
  Eigen::MatrixXf at_port_;  // orthonormal, any columns
  Eigen::MatrixXf mix_;
};

/// Number of values that elements need on the wire: few if their nodes are sent already.
class ByteCosts : public ColumnCosts {
 public:
  /// `nodes`: of each candidate, `of_each` of them one after the other; `numbers`: values for given numbers of nodes and
  /// elements.
  ByteCosts(std::vector<std::uint32_t> nodes, int of_each, std::size_t body_nodes, std::function<int(int, int)> numbers)
      : nodes_(std::move(nodes)), of_each_(of_each), numbers_(std::move(numbers)), used_(body_nodes, 0) {}
  void with(const std::vector<Eigen::Index>& there) override;
  float of(Eigen::Index column) const override { return cost_[static_cast<std::size_t>(new_nodes(column))]; }

 private:
  std::span<const std::uint32_t> nodes_of(Eigen::Index column) const {
    return std::span(nodes_).subspan(static_cast<std::size_t>(column * of_each_), static_cast<std::size_t>(of_each_));
  }
  int new_nodes(Eigen::Index column) const;
  std::vector<std::uint32_t> nodes_;
  int of_each_;
  std::function<int(int, int)> numbers_;
  std::vector<std::uint8_t> used_;
  std::array<float, 5> cost_{};  // by number of new nodes
};

/// Numbers the nodes that elements join, in the order in which they occur.
class NodeNumbering {
 public:
  int number_of(std::uint32_t node);
  const std::vector<std::uint32_t>& nodes() const { return nodes_; }
  /// Returns the rows of `moved`, the motion of the body with each variable, as sent. `tool`: as in Sampling.
  NodeMotion motion(const Rows& moved, int tool, int tool_axes) const;
  /// Returns positions relative to the first node.
  Eigen::Matrix3Xf places(const Vector& x) const;

 private:
  std::vector<std::uint32_t> nodes_;
  std::vector<int> numbers_;
};

}  // namespace palpate
