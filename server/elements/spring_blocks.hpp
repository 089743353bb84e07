// All springs of a body in single precision, sixteen side by side: the force of element_loops.hpp for bodies whose nodes are
// numbered plane by plane, as those of a lattice are.
//
// Sixteen consecutive nodes are a block. Springs from them to nodes at one offset in the numbering form a group: lane i joins
// node a + i with node b + i, so that everything is read and written in order; a missing spring has zero stiffness and damping.
// The forces of a block's groups on its nodes are summed in registers.
//
// With D the vector from a to b at rest, L0 the rest length, e = u_b - u_a the difference of the displacements, d = D + e:
//
//     q = (e . (d + D) + |D|^2 - L0^2) / L0^2             |d|^2 = L0^2 (1 + q)
//     t = 1 - (1 + q)^(-1/2)                              elongation / |d|; the strain is q (1 - t) - t
//     force on a = (k t (1 + stiffening strain^2) + b (1 - t)^2 d . d' / L0^2) d
//
// loses no digits to the size of the body: forces are accurate to 1e-6 of the largest spring's. The root is computed by Newton's
// method, with additions and multiplications only, and its last step is applied to t. Every sum is computed in the same order on
// any processor and with any number of threads, and nothing is contracted: the bits are the same everywhere.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/base/types.hpp"
#include "server/elements/lane_variants.hpp"
#include "server/scene/scene.hpp"

namespace palpate {

/// A vector per node, stored by component; padded with zeros, so that whole blocks may be read from any node on.
struct NodeArrays {
  static constexpr std::size_t kBlock = 16;
  std::vector<float> x, y, z;
  explicit NodeArrays(std::size_t nodes = 0) : x(padded(nodes)), y(padded(nodes)), z(padded(nodes)) {}
  static std::size_t padded(std::size_t nodes) { return (nodes + 2 * kBlock - 1) / kBlock * kBlock; }
  Vec3 at(std::uint32_t i) const { return {x[i], y[i], z[i]}; }
  void set(std::uint32_t i, const Vec3& value) {
    x[i] = static_cast<float>(value.x());
    y[i] = static_cast<float>(value.y());
    z[i] = static_cast<float>(value.z());
  }
};

/// Shapes of sixteen springs; missing ones have the shape of another, and zero coefficients.
struct alignas(64) SpringShapes {
  float dx[NodeArrays::kBlock], dy[NodeArrays::kBlock], dz[NodeArrays::kBlock];  ///< D [m]
  float excess[NodeArrays::kBlock], per_rest2[NodeArrays::kBlock];               ///< |D|^2 / L0^2 - 1, 1 / L0^2 [1/m^2]
};
struct alignas(64) SpringCoefficients {
  float stiffness_n_m[NodeArrays::kBlock], damping_n_s_m[NodeArrays::kBlock];
};
struct SpringsOfBlock {
  std::uint32_t to = 0;  ///< b - a
  std::uint32_t shapes = 0, coefficients = 0;
};
struct SpringTables {
  std::vector<SpringShapes> shapes;              ///< without repetition: those of a lattice stay in the first-level cache
  std::vector<SpringCoefficients> coefficients;  ///< without repetition
  std::vector<SpringsOfBlock> groups;            ///< block by block
  std::vector<std::uint32_t> first;              ///< of each block, in groups; one more entry than blocks
  float stiffening = 0;
};

/// Returns the variants that this processor can run, the widest last, of: add the forces of the springs of blocks begin to end to
/// f, at displacements u [m] and velocities v [m/s].
std::span<const Variant<const SpringTables&, std::size_t, std::size_t, const NodeArrays&, const NodeArrays&, NodeArrays&>>
spring_block_loops();

class SpringBlocks {
 public:
  explicit SpringBlocks(const LumpedBody& body);
  /// Returns true if it supports everything that the body is made of: springs, linear or stiffening.
  static bool covers(const LumpedBody& body);

  struct Slab {
    std::size_t begin = 0, end = 0;  ///< blocks
  };
  /// All blocks, in slabs such that no spring reaches further than the next slab: even slabs may be added in parallel, and then
  /// odd ones, so that every sum has a fixed order.
  const std::vector<Slab>& even_slabs() const { return even_; }
  const std::vector<Slab>& odd_slabs() const { return odd_; }
  /// Adds the forces of the springs of a slab's blocks to f.
  void add_forces(const Slab& slab, const NodeArrays& u, const NodeArrays& v, NodeArrays& f) const;
  /// Returns the largest T' / k of any spring: 1 for linear ones.
  double stiffest(const NodeArrays& u) const;
  /// Number of springs and gaps, the cost of an evaluation.
  std::size_t size() const { return NodeArrays::kBlock * tables_.groups.size(); }
  const SpringTables& tables() const { return tables_; }

 private:
  void cut_into_slabs();
  std::size_t blocks() const { return tables_.first.size() - 1; }
  SpringTables tables_;
  std::vector<Slab> even_, odd_;
};

}  // namespace palpate
