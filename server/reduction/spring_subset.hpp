// A subset of a body's elements, and the sums of their tangents between their nodes:
//
//     K_ab, D_ab = sum over these elements of their blocks for nodes a and b
//                  (spring_kernel.hpp, element_loops.hpp)
//
// for each pair of nodes that one of them joins, summed before a coarse grid or reduction is applied.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "server/dynamics/dynamics.hpp"
#include "server/elements/spring_forces.hpp"
#include "server/reduction/tangent_matrices.hpp"

namespace palpate {

/// The nodes of a bunch, and the pairs of them that an element joins.
class BunchLinks {
 public:
  /// Nodes, ascending.
  const std::vector<std::uint32_t>& nodes() const { return nodes_; }
  struct Link {
    std::uint32_t a = 0, b = 0;  ///< index in nodes(), a <= b
  };
  const std::vector<Link>& links() const { return links_; }

 protected:
  /// Sets the nodes to those of its elements, which may repeat.
  void take_nodes(std::vector<std::uint32_t> nodes);
  /// Returns the index of a node in nodes().
  std::uint32_t place(std::uint32_t node) const;

  std::vector<std::uint32_t> nodes_;
  std::vector<Link> links_;
};

class SpringSubset : public BunchLinks {
 public:
  static constexpr int kNumbers = 6;  ///< per block, which is symmetric
  /// Elements far from tools whose tangents are renewed in a frame: more: slower frames; fewer: older tangents.
  static constexpr std::size_t kRenewedElementsMax = 6000;
  using Pair = SpringMatrices::Pair;

  SpringSubset() = default;
  /// `dynamics` must outlive it.
  SpringSubset(const Dynamics& dynamics, std::span<const std::uint32_t> elements);
  /// Returns for each link the blocks of K and D with the rows of a and the columns of b; `clamp`: compressed springs do not
  /// soften.
  std::vector<Pair> sums(const BodyState& state, bool clamp) const;
  static const Pair& transposed(const Pair& pair) { return pair; }

  /// Forces of all elements on all nodes.
  struct Forces : SpringForces {
    explicit Forces(const Dynamics& dynamics) : SpringForces(dynamics.body()) {}
    const NodeArrays& at(const BodyState& state) { return SpringForces::at(state.x, state.v); }
  };

 private:
  struct Spring {
    std::uint32_t element = 0, a = 0, b = 0;  // ends in nodes(); the links of nodes to themselves come first, in their order
  };
  const LumpedBody* body_ = nullptr;
  std::vector<Spring> springs_;  // their links follow, in this order
};

class SolidBunch : public BunchLinks {
 public:
  static constexpr int kNumbers = 9;                        ///< per block
  static constexpr std::size_t kRenewedElementsMax = 1500;  ///< as for springs; an element costs more
  using Pair = SolidMatrices::Pair;

  SolidBunch() = default;
  /// `dynamics` must outlive it.
  SolidBunch(const Dynamics& dynamics, std::span<const std::uint32_t> elements);
  /// Returns the sums as for springs; see ElementLoops for `clamp`.
  std::vector<Pair> sums(const BodyState& state, bool clamp) const;
  static Pair transposed(const Pair& pair);

  class Forces {
   public:
    explicit Forces(const Dynamics& dynamics) : dynamics_(&dynamics), f_(dynamics.nodes()) {}
    const NodeArrays& at(const BodyState& state);

   private:
    const Dynamics* dynamics_;
    NodeArrays f_;
  };

 private:
  template <typename Batch>
  void take_links(const std::vector<Batch>& batches);
  template <typename Elements>
  void add_sums(const Elements& elements, const std::vector<typename Elements::Batch>& batches, const Vector& x, bool clamp,
                std::vector<Pair>& sums) const;

  const Dynamics* dynamics_ = nullptr;
  std::vector<Tetrahedra::Batch> tetrahedra_;
  std::vector<Hexahedra::Batch> hexahedra_;
  // For each pair of nodes of an element (pair_index): twice the link, plus one if the link is reversed. In the order of the
  // batches.
  std::vector<std::uint32_t> targets_;
};

}  // namespace palpate
