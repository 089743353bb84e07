// All springs of a body at once, in single precision, eight or sixteen side by side: the force of element_kernel.hpp for bodies
// whose springs repeat, as those of a lattice do.
//
// Springs whose ends are the same number of nodes apart, and that are alike at rest, make a run: spring i of a run joins node
// a + i with node b + i, so that everything is read and written in order. Where a spring is missing its stiffness and damping are
// zero. With D the vector from a to b at rest, L0 the rest length, and e = u_b - u_a the difference of the displacements,
//
//     d = D + e,   |d| - L0 = (e . (d + D) + |D|^2 - L0^2) / (|d| + L0)
//
// loses no digits to the size of the body: forces are right to 1e-6 of the largest spring's. Every sum is taken in the same order
// whatever the processor, and nothing is contracted: same bits on all of them.
#pragma once

#include <vector>

#include "common/base/types.hpp"
#include "server/scene/scene.hpp"

namespace palpate {

/// One number of each kind a node, by component.
struct NodeArrays {
  std::vector<float> x, y, z;
  explicit NodeArrays(std::size_t nodes = 0) : x(nodes), y(nodes), z(nodes) {}
  Vec3 at(std::uint32_t i) const { return {x[i], y[i], z[i]}; }
  void set(std::uint32_t i, const Vec3& value) {
    x[i] = static_cast<float>(value.x());
    y[i] = static_cast<float>(value.y());
    z[i] = static_cast<float>(value.z());
  }
};

class SpringRuns {
 public:
  explicit SpringRuns(const LumpedBody& body);
  /// Whether it knows all that the body is made of: springs, linear or stiffening.
  static bool covers(const LumpedBody& body);

  /// f += forces of the springs at displacements u [m] and velocities v [m/s].
  void add_forces(const NodeArrays& u, const NodeArrays& v, NodeArrays& f) const;
  /// Largest T' / k of any spring: 1 for linear ones.
  double stiffest(const NodeArrays& u) const;
  /// Springs and gaps: what an evaluation costs.
  std::size_t size() const { return stiffness_.size(); }

  struct Run {
    std::size_t a = 0, b = 0, count = 0, first = 0;  ///< first: of stiffness and damping
    float d[3] = {}, rest = 0;                       ///< D, L0 [m]
    float excess = 0;                                ///< |D|^2 - L0^2 [m^2]
  };

 private:
  std::vector<Run> runs_;
  std::vector<float> stiffness_, damping_;  // of the springs, run by run [N/m], [N s/m]
  float stiffening_ = 0;
};

}  // namespace palpate
