// Few elements of a body whose weighted forces stand for those of all (hyper-reduction by energy-conserving sampling and
// weighting): what is asked of them, and how well they do it, for springs (sample_springs.hpp) and tetrahedra
// (sample_tetrahedra.hpp).
//
// For displacements u_s that are likely to come, with r_e(u) what element e adds to the linear force on the variables, weights
// w_e >= 0, few of them not zero, are sought for which
//
//     sum_s | sum_e w_e r_e(u_s) - sum_(all e) r_e(u_s) |^2 / g_s^2       is small,
//     g_s = |sum_(all e) r_e(u_s)| + kLinearForceShare |K u_s|
//
// forces in units that make the stiffness of each variable 1, but those at the port are kPortWeight times as large. A greedy
// non-negative least squares (sparse_nnls.hpp), elements between nodes that travel anyway being cheap: candidates are those
// with the largest part in the samples, and weights are found once more for the nodes' motions as they travel. As no w_e is
// negative, what is sent stiffens and buckles as elements do, and stores energy as they do beyond its second order at the stamp.
//
// Samples are the displacements that a patch's basis was made of: the likeliest alone, doubled and back, and all mixed by chance,
// the same in every run. Instead of all samples the fit has kSampleSums orthogonal sums of them.
//
// Shapes: n variables; u_s, r_e: n; K the diagonal of the stiffness, n numbers. Nothing comes of it where no weight stays
// positive; where the bytes run out first, the sum above is not small.
//
// Source: see common/port/sampled_springs.hpp; sums of samples: Woodruff, FnTTCS 10 (2014), chapter 2.
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "common/port/terms_pieces.hpp"
#include "server/body/body_state.hpp"
#include "server/reduce/sparse_nnls.hpp"

namespace palpate {

inline constexpr double kLinearForceShare = 0.1;  ///< an error that small beside the linear force is felt by nobody
inline constexpr int kSamples = 72;               ///< measured: more take longer than they gain (docs/notebook.md, 23)
inline constexpr float kPortWeight = 4;    ///< of grasped solids; measured: 1 is 1.3 dB less true, 8 0.2 (docs/notebook.md, 43)
inline constexpr float kFitError = 3e-3F;  ///< that is close enough, of |t|: a third of it gains nothing (docs/notebook.md, 40)

using Rows = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using AtSamples = Eigen::Matrix<float, Eigen::Dynamic, kSamples, Eigen::RowMajor>;

struct Sampling {
  Matrix likely;  ///< u of displacements of the body, each as large as it is likely to become, a column each
  std::vector<Eigen::Index> likeliest;  ///< of these: the first three are samples by themselves as well
  Vector stiffness;                     ///< of each variable, > 0
  Matrix at_port;                       ///< forces f on the variables are at_port^T f at the port; may have no columns
  TermsBudget budget;                   ///< that elements have
  int tool = -1;                        ///< the node that a tool holds; the first three variables are how it moves
};

/// u_s, a column each.
Matrix samples(const Sampling& sampling);
/// |G u_s| over all samples is |G L|, L L^T = sum u_s u_s^T: L, of fewer columns.
Matrix root_of(const Matrix& u);

/// The candidates: those with the largest parts, at most `most`.
std::vector<std::uint32_t> largest(const std::vector<std::uint32_t>& elements, const Eigen::VectorXf& parts, std::size_t most);

/// What elements add to the linear force at the samples, numbers of an element one after the other: a row each element.
struct ElementForces {
  std::vector<Rows> motion;      ///< of each number with the variables, elements x n
  std::vector<AtSamples> force;  ///< with which it resists
};

/// Forces on the variables at sums of samples, in units in which every sample counts alike.
class Fit {
 public:
  /// `all`: of all elements together, n x samples.
  Fit(const Eigen::MatrixXf& all, const Matrix& u, const Sampling& sampling);
  const Eigen::VectorXf& all() const { return all_; }
  /// Of each element, a column each; until they are asked for again.
  const Eigen::MatrixXf& parts(const ElementForces& elements) const;

 private:
  Eigen::VectorXf unit_, all_;
  Eigen::MatrixXf at_port_;  // orthonormal, any columns
  Eigen::MatrixXf mix_;
};

/// Numbers that elements take on their way: few where their nodes are there already.
class ByteCosts : public ColumnCosts {
 public:
  /// `nodes`: of each candidate, `of_each` of them one after the other; `numbers`: of so many nodes and elements.
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
  std::array<float, 5> cost_{};  // with so many new nodes
};

/// Nodes that elements join, numbered in the order in which they are met.
class MetNodes {
 public:
  int number_of(std::uint32_t node);
  const std::vector<std::uint32_t>& nodes() const { return nodes_; }
  /// Of `moved`, how the body moves with each variable, as it travels. `tool`: as in Sampling.
  NodeMotion motion(const Rows& moved, int tool, int tool_axes) const;
  /// Places from that of the first.
  Eigen::Matrix3Xf places(const Vector& x) const;

 private:
  std::vector<std::uint32_t> nodes_;
  std::vector<int> numbers_;
};

/// Elements of one kind, `Elements` (of sample_springs.cpp, sample_tetrahedra.cpp), chosen and weighed as said above. `u`:
/// samples.
template <typename Elements>
std::optional<typename Elements::Sample> sample(const Elements& all, const Matrix& u, const Sampling& sampling) {
  Eigen::VectorXf parts;
  const Fit fit(all.all_together(parts), u, sampling);
  const std::vector<std::uint32_t> candidates = largest(all.elements(), parts, Elements::kCandidatesMax);
  std::vector<std::uint32_t> nodes;
  for (const std::uint32_t e : candidates)
    for (int i = 0; i < Elements::kElementNodes; ++i) nodes.push_back(all.node(e, i));
  ByteCosts costs(std::move(nodes), Elements::kElementNodes, all.nodes(),
                  [&](int met, int count) { return numbers_of(sampling.budget, met, count); });
  const SparseSolution few = sparse_nnls(fit.parts(all.forces_of(candidates, all.motions(candidates))), fit.all(),
                                         Elements::kChosenMax, kFitError, costs);
  if (few.columns.empty()) return std::nullopt;
  std::vector<std::uint32_t> elements;
  for (const Eigen::Index column : few.columns) elements.push_back(candidates[static_cast<std::size_t>(column)]);
  typename Elements::Sample chosen = all.taken(elements, sampling.tool);
  const SparseSolution w =
      positive_weights(fit.parts(all.forces_of(elements, chosen.motions(sampling.tool < 0 ? 0 : 3))), fit.all());
  if (w.columns.empty()) return std::nullopt;
  return Elements::weighed(std::move(chosen), w);
}

}  // namespace palpate
