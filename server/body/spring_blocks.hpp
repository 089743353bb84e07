// All springs of a body at once, in single precision, sixteen side by side: the force of element_kernel.hpp for bodies whose
// nodes are numbered plane by plane, as those of a lattice are.
//
// Sixteen nodes in a row are a block. Springs from them to nodes as far on in the numbering make a group: lane i joins node a + i
// with node b + i, so that everything is read and written in order; where a spring is missing its stiffness and damping are zero.
// What the groups of a block have on its nodes is added up in registers.
//
// With D the vector from a to b at rest, L0 the rest length, e = u_b - u_a the difference of the displacements, d = D + e:
//
//     q = (e . (d + D) + |D|^2 - L0^2) / L0^2             |d|^2 = L0^2 (1 + q)
//     t = 1 - (1 + q)^(-1/2)                              elongation / |d|; the strain is q (1 - t) - t
//     force on a = (k t (1 + stiffening strain^2) + b (1 - t)^2 d . d' / L0^2) d
//
// lose no digits to the size of the body: forces are right to 1e-6 of the largest spring's. The root is taken by Newton's method,
// in additions and multiplications alone, the last step of it in t. Every sum is taken in the same order whatever the processor
// and the number of threads, and nothing is contracted: same bits on all of them.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/base/types.hpp"
#include "server/scene/scene.hpp"

namespace palpate {

/// One number of each kind a node, by component; zeros after the last, so that whole blocks may be read from any node on.
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

/// Of sixteen springs; those that are missing have the shape of another, and zeros else.
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
  std::vector<SpringShapes> shapes;              ///< each once: those of a lattice stay in the first-level cache
  std::vector<SpringCoefficients> coefficients;  ///< each once
  std::vector<SpringsOfBlock> groups;            ///< block by block
  std::vector<std::uint32_t> first;              ///< of each block, in groups; one more than blocks
  float stiffening = 0;
};

struct SpringBlockLoops {
  std::size_t width;  ///< springs in a vector
  /// f += forces of the springs of blocks begin to end at displacements u [m] and velocities v [m/s].
  void (*add_forces)(const SpringTables& springs, std::size_t begin, std::size_t end, const NodeArrays& u, const NodeArrays& v,
                     NodeArrays& f);
};
/// All that this processor can run, the widest last.
std::span<const SpringBlockLoops> spring_block_loops();

class SpringBlocks {
 public:
  explicit SpringBlocks(const LumpedBody& body);
  /// Whether it knows all that the body is made of: springs, linear or stiffening.
  static bool covers(const LumpedBody& body);

  struct Slab {
    std::size_t begin = 0, end = 0;  ///< blocks
  };
  /// All blocks, in slabs no spring reaches further than from one into the next: the even ones may be added up at the same time,
  /// and then the odd ones, which takes every sum in one order.
  const std::vector<Slab>& even_slabs() const { return even_; }
  const std::vector<Slab>& odd_slabs() const { return odd_; }
  /// f += forces of the springs of a slab's blocks.
  void add_forces(const Slab& slab, const NodeArrays& u, const NodeArrays& v, NodeArrays& f) const;
  /// Largest T' / k of any spring: 1 for linear ones.
  double stiffest(const NodeArrays& u) const;
  /// Springs and gaps: what an evaluation costs.
  std::size_t size() const { return NodeArrays::kBlock * tables_.groups.size(); }
  const SpringTables& tables() const { return tables_; }

 private:
  void cut_into_slabs();
  std::size_t blocks() const { return tables_.first.size() - 1; }
  SpringTables tables_;
  std::vector<Slab> even_, odd_;
};

}  // namespace palpate
