// A subset of a body's elements, and the sums of their tangents between their nodes:
//
//     K_ab, D_ab = sum over these elements of their blocks for nodes a and b (element_loops.hpp)
//
// for each pair of nodes that one of them joins, summed before a coarse grid or reduction is applied.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/body/dynamics.hpp"
#include "server/operators/tangent_matrices.hpp"

namespace palpate {

class ElementSubset {
 public:
  using Pair = TangentMatrices::Pair;

  ElementSubset() = default;
  /// `elements`: as elements_of() counts them (local_body.hpp); `dynamics` must outlive it.
  ElementSubset(const Dynamics& dynamics, std::span<const std::uint32_t> elements);

  /// Nodes, ascending.
  const std::vector<std::uint32_t>& nodes() const { return nodes_; }
  /// The pairs of nodes that an element joins.
  struct Link {
    std::uint32_t a = 0, b = 0;  ///< index in nodes(), a <= b
  };
  const std::vector<Link>& links() const { return links_; }
  /// Returns for each link the blocks of K and D with the rows of a and the columns of b; see Dynamics::assemble for `clamp`.
  std::vector<Pair> sums(const BodyState& state, bool clamp) const;
  static Pair transposed(const Pair& pair);

 private:
  using Target = std::vector<std::uint32_t>::const_iterator;
  void find_links();
  template <typename Elements>
  void add_batches(const Elements& elements, const std::vector<typename Elements::Batch>& batches, const BodyState& state,
                   bool clamp, Target& target, std::vector<Pair>& sums) const;

  const Dynamics* dynamics_ = nullptr;
  std::vector<std::uint32_t> nodes_;
  std::vector<Link> links_;
  std::vector<Springs::Batch> springs_;
  std::vector<Tetrahedra::Batch> tetrahedra_;
  std::vector<Hexahedra::Batch> hexahedra_;
  // For each pair of nodes of an element (pair_index): twice the link, plus one if the link is reversed. In the order of the
  // batches.
  std::vector<std::uint32_t> targets_;
};

}  // namespace palpate
