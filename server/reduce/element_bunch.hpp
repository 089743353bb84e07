// Some elements of a body, and what they put between the nodes that they have:
//
//     K_ab, D_ab = sum over these elements of their blocks for nodes a and b
//                  (element_kernel.hpp, tetra_kernel.hpp, hexa_kernel.hpp)
//
// for each two nodes that one of them joins, summed before anything coarser is made of it.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "server/body/dynamics.hpp"
#include "server/body/spring_forces.hpp"
#include "server/reduce/tangent_matrices.hpp"

namespace palpate {

/// The nodes of a bunch, and between which of them there is something.
class BunchLinks {
 public:
  /// Ascending.
  const std::vector<std::uint32_t>& nodes() const { return nodes_; }
  struct Link {
    std::uint32_t a = 0, b = 0;  ///< among nodes(), a <= b
  };
  const std::vector<Link>& links() const { return links_; }

 protected:
  /// Of elements that have these nodes, more than once maybe.
  void take_nodes(std::vector<std::uint32_t> nodes);
  /// Where a node is among nodes().
  std::uint32_t place(std::uint32_t node) const;

  std::vector<std::uint32_t> nodes_;
  std::vector<Link> links_;
};

class SpringBunch : public BunchLinks {
 public:
  static constexpr int kNumbers = 6;  ///< of a block, which is symmetric
  /// Elements whose tangents far from tools are found anew in a frame: more, dearer frames; fewer, older tangents.
  static constexpr std::size_t kRenewedElementsMax = 6000;
  using Pair = SpringMatrices::Pair;

  SpringBunch() = default;
  /// `dynamics` must outlive it.
  SpringBunch(const Dynamics& dynamics, std::span<const std::uint32_t> elements);
  /// For each link the blocks of K and D with the rows of a and the columns of b; `clamp`: compressed springs do not soften.
  std::vector<Pair> sums(const BodyState& state, bool clamp) const;
  static const Pair& transposed(const Pair& pair) { return pair; }

  /// Of all elements on all nodes.
  struct Forces : SpringForces {
    explicit Forces(const Dynamics& dynamics) : SpringForces(dynamics.body()) {}
    const NodeArrays& at(const BodyState& state) { return SpringForces::at(state.x, state.v); }
  };

 private:
  struct Spring {
    std::uint32_t element = 0, a = 0, b = 0;  // ends among nodes(), whose links to themselves come first, in their order
  };
  const LumpedBody* body_ = nullptr;
  std::vector<Spring> springs_;  // their links after those, in their order
};

class SolidBunch : public BunchLinks {
 public:
  static constexpr int kNumbers = 9;                        ///< of a block
  static constexpr std::size_t kRenewedElementsMax = 1500;  ///< as of springs; an element costs more
  using Pair = SolidMatrices::Pair;

  SolidBunch() = default;
  /// `dynamics` must outlive it.
  SolidBunch(const Dynamics& dynamics, std::span<const std::uint32_t> elements);
  /// As of springs; see TetraTangent for `clamp`.
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
  // Of an element, for its pairs of nodes (pair_index): twice the link, and one more where that is the other way round. In the
  // order of the batches.
  std::vector<std::uint32_t> targets_;
};

}  // namespace palpate
