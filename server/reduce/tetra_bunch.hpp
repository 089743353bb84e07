// Some tetrahedra of a body, and what they put between the nodes that they have:
//
//     K_ab, D_ab = sum over these tetrahedra of their blocks for nodes a and b      (tetra_kernel.hpp)
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
  TetraBunch(const Dynamics& dynamics, std::span<const std::uint32_t> tetrahedra);

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
  const Tetrahedra* tetrahedra_ = nullptr;
  std::vector<Tetrahedra::Batch> batches_;
  std::vector<std::uint32_t> nodes_;
  std::vector<Link> links_;
  /// Of a tetrahedron, for its pairs of nodes (pair_index): twice the link, and one more where that is the other way round.
  using Targets = std::array<std::uint32_t, 10>;
  std::vector<Targets> targets_;  // in the order of the batches
};

/// to += N^T A N over the corners of a cell, A being the sums of a bunch and N the shapes of its nodes there.
void add_over_corners(const TetraBunch& bunch, std::span<const TetraBunch::Pair> sums, std::span<const FarField::Shape> shapes,
                      CornerTangent<TetraBunch::kNumbers>& to);

}  // namespace palpate
