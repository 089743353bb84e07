// All hexahedra of a body in single precision, eight side by side: the forces of element_shape.hpp for explicit integrators, at
// displacements u [m] and velocities v [m/s].
//
//     (F - 1, q) = sum u_i g_i^T,   (F', q') = sum v_i g_i^T      single precision
//     P_elastic(F)                                                in single precision if the law has no terms that nearly cancel
//                                                                 (Elasticity::is_single_precision()), else in double
//     f_i -= (V P + stress of the modes) g_i                      single precision
//
// For a box the g_i are the signs of a corner times one number per column, and all sums over its corners are one Walsh-Hadamard
// transform: 24 additions per component instead of 49 products. Cells in a row along the numbering of the nodes, as in a lattice,
// are read and written in order.
//
// Forces are accurate to some 1e-6 of the largest in their element. Every sum is computed in the same order on any processor and
// with any number of threads, and nothing is contracted: the bits are the same everywhere.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "server/body/dynamics.hpp"
#include "server/elements/lane_variants.hpp"
#include "server/elements/spring_blocks.hpp"

namespace palpate {

/// Eight cells of one material.
struct HexaCells {
  static constexpr std::size_t kLanes = 8;
  /// Columns of a box's g as bits of a corner: b_1, b_2, b_3 change sign with bit 0, 1, 2, h_1 = xi_2 xi_3 with bits 1 and 2, and
  /// so on.
  static constexpr std::size_t kBoxBits[7] = {1, 2, 4, 6, 5, 3, 7};
  struct alignas(32) Lanes {
    float of[kLanes];
  };
  std::array<std::array<std::uint32_t, kLanes>, 8> nodes{};  ///< unused lanes repeat the first
  std::array<std::uint32_t, kLanes> cells{};                 ///< their indices, of lanes in use
  std::uint32_t material = 0, used = 0;                      ///< number of lanes in use, from the first on
  bool in_a_row = false;  ///< node i of lane l is nodes[i][0] + l, the one before that of i + 1 for even i
  /// For boxes of one shape: V, k_a, and the factor of the signs in g, column by column.
  float volume_m3 = 0, k[kModesOfHexa] = {}, times[7] = {};
  std::vector<Lanes> own;  ///< for other shapes: ShapeNumbers (element_loops.hpp); empty for boxes
};

/// For eight cells: the strain |F F^T - 1|, and the largest sum of a row of |F F^T|, a bound of its eigenvalues.
struct HexaStrains {
  HexaCells::Lanes strain, square;
};

/// Returns the variants of f += forces of the cells that this processor can run, the widest last.
std::span<const Variant<std::span<const ElementMaterial>, std::span<const HexaCells>, const NodeArrays&, const NodeArrays&,
                        NodeArrays&>>
hexa_force_loops();
/// Computes the strains of each of the cells.
void find_strains(std::span<const HexaCells> cells, const NodeArrays& u, std::span<HexaStrains> strains);

class HexaForces {
 public:
  /// `dynamics` must outlive it.
  explicit HexaForces(const Dynamics& dynamics);
  /// Returns true if the body consists of hexahedra without relaxation, and ligaments.
  static bool covers(const LumpedBody& body);

  std::size_t size() const { return count_; }  ///< elements
  /// Returns the measured duration of an evaluation of all forces [s]; it reads no clock.
  double evaluation_s() const;
  /// All cells, in slabs that share nodes only with their neighbours: even slabs may be added in parallel, and then odd ones, so
  /// that every sum has a fixed order.
  std::size_t slabs(bool odd) const { return (odd ? odd_ : even_).size(); }
  /// f += forces of a slab's cells.
  void add_forces(bool odd, std::size_t slab, const NodeArrays& u, const NodeArrays& v, NodeArrays& f) const;

  std::span<const ElementMaterial> materials() const { return materials_; }
  std::span<const HexaCells> cells(bool odd, std::size_t slab) const { return (odd ? odd_ : even_)[slab]; }

  /// Growth of the largest eigenvalues of K and D since the body was at rest, at least 1, estimated from the most strained
  /// elements: from the eigenvalues of dP/dF relative to those at rest, and from those of F F^T.
  struct Growth {
    double stiffness = 1, damping = 1;
  };
  Growth growth(const NodeArrays& u) const;

 private:
  using Slab = std::vector<HexaCells>;
  Mat3 deformation(const HexaCells& cells, std::size_t lane, const NodeArrays& u) const;
  const Hexahedra* hexahedra_;
  std::vector<ElementMaterial> materials_;
  std::vector<double> stiffest_at_rest_;  // per material: the largest eigenvalue of dP/dF at rest
  std::vector<Slab> even_, odd_;
  std::size_t count_ = 0;
};

}  // namespace palpate
