// Some finite elements of a body, and what they put between the nodes that they have:
//
//     K_ab, D_ab = sum over these elements of their blocks for nodes a and b      (tetra_kernel.hpp, hexa_kernel.hpp)
//
// for each two nodes that one of them joins, summed before anything coarser is made of it.
#pragma once

#include <span>
#include <vector>

#include "server/body/dynamics.hpp"
#include "server/reduce/far_tangents.hpp"

namespace palpate {

class TetraBunch {
 public:
  static constexpr int kNumbers = 9;
  using Pair = SolidMatrices::Pair;

  TetraBunch() = default;
  /// `dynamics` must outlive it.
  TetraBunch(const Dynamics& dynamics, std::span<const std::uint32_t> elements);

  /// Ascending.
  const std::vector<std::uint32_t>& nodes() const { return nodes_; }
  struct Link {
    std::uint32_t a = 0, b = 0;  ///< among nodes(), a <= b
  };
  const std::vector<Link>& links() const { return links_; }
  /// For each link the blocks of K and D with the rows of a and the columns of b, at positions x; see TetraTangent for `clamp`.
  std::vector<Pair> sums(const Vector& x, bool clamp) const;
  static Pair transposed(const Pair& pair);

 private:
  template <typename Batch>
  void take_links(const std::vector<Batch>& batches);
  template <typename Elements>
  void add_sums(const Elements& elements, const std::vector<typename Elements::Batch>& batches, const Vector& x, bool clamp,
                std::vector<Pair>& sums) const;

  const Dynamics* dynamics_ = nullptr;
  std::vector<Tetrahedra::Batch> tetrahedra_;
  std::vector<Hexahedra::Batch> hexahedra_;
  std::vector<std::uint32_t> nodes_;
  std::vector<Link> links_;
  // Of an element, for its pairs of nodes (pair_index): twice the link, and one more where that is the other way round. In the
  // order of the batches.
  std::vector<std::uint32_t> targets_;
};

/// to += N^T A N over the corners of a cell, A being the sums of a bunch and N the shapes of its nodes there.
void add_over_corners(const TetraBunch& bunch, std::span<const TetraBunch::Pair> sums, std::span<const FarField::Shape> shapes,
                      CornerTangent<TetraBunch::kNumbers>& to);

}  // namespace palpate
