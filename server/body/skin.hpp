// The skin that a tool meets: the surface of the body, with the motion of each vertex averaged over the vertices around it.
//
//     s_i = X_i + sum_j S_ij (x_j - X_j),   S_ij ~ m(|X_i - X_j|),  sum_j S_ij = 1,   m(d) = (1 - (d/R)^2)^2 for d < R, else 0
//
// X rest positions, x node positions, over the surface's own vertices j; R the contact radius of the tool. A point of the skin is
// p = sum_k w_k s_k = X_p + B^T (x - X), and a force on it acts on the nodes through the same B, so that energy is conserved.
// The displacement of a vertex of a cut body that is embedded in an element is the mean of its nodes' by weight. On a cut body,
// and on one of several members, S has only vertices j to which a path along edges leads that is at most kLongestPath R long: a
// tip on one side of a cut, or on one member, does not move the other. With R = 0 (or below the distance to the next vertex) S is
// the identity and the tool is a point. Reason: a tip that touches a single node pushes that node between its neighbours; a real
// tip has a width, and slides smoothly.
//
// Where tools have several contact radii, the skin has a copy of the surface for each, with vertices and triangles of its own:
// vertex i of the body is k V + i of copy k, V the number of the body's vertices, and triangle t is k T + t, T that of its
// triangles. A point of the skin is on one copy, and stays on it where it slides.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <span>
#include <utility>
#include <vector>

#include "common/patch/onset.hpp"
#include "common/patch/surface.hpp"
#include "server/scene/scene.hpp"
#include "server/solve/block_matrix.hpp"

namespace palpate {

class Skin {
 public:
  /// An empty skin, without contact.
  Skin() = default;
  /// `body` must outlive the skin. A body without triangles has an empty skin.
  explicit Skin(const LumpedBody& body, double radius_m = 0) : Skin(body, std::span(&radius_m, 1)) {}
  /// The same with a copy for each of `radii_m`, of which there is at least one.
  Skin(const LumpedBody& body, std::span<const double> radii_m);

  bool empty() const { return surface_.empty(); }
  /// All copies.
  SurfaceView view() const { return surface_.view(); }
  /// Number of vertices of a copy.
  std::size_t vertices() const { return smooth_.size() / std::max<std::size_t>(copies_, 1); }
  /// Returns the vertex of the body that a vertex of any copy is.
  std::uint32_t of_body(std::uint32_t vertex) const { return vertex % static_cast<std::uint32_t>(vertices()); }
  /// nearest_point() and look_for_contact() on one copy. `positions`: those of place() or rest().
  NearestPoint nearest(std::size_t copy, Positions positions, const Vec3& query) const;
  Onset look_for_contact(std::size_t copy, Positions positions, const Vec3& tool, double radius_m, Clearance& clearance) const;
  /// Computes vertex positions, 3 per vertex of each copy; those off the surface keep their rest positions, and all are nodes of
  /// a body without one, a sheet. `positions`: empty, or the output of an earlier call.
  void place(const Vector& x, std::vector<double>& positions) const;
  std::vector<double> place(const Vector& x) const;
  /// Returns a lower bound of the distance from a point to the skin [m]: that to the box around the rest positions, less the
  /// largest displacement. Takes much less time than the distance. Requires a skin that is not empty.
  double distance_at_least(const Vec3& point, const Vector& x) const;
  /// Returns B of a point.
  NodeWeights weights(const SurfacePoint& point) const;
  /// Returns the position of the point, with `b` = weights(point).
  Vec3 position(const SurfacePoint& point, const NodeWeights& b, const Vector& x) const;
  /// Returns true for a point in the body at rest, by the winding number: the walls of cuts, in pairs there, do not count.
  bool holds(const Vec3& at_rest) const;
  /// Returns the rest positions of the vertices.
  Positions rest() const { return {rest_.front().data(), 3 * rest_.size()}; }
  /// Returns the row of S for one vertex, over nodes.
  const NodeWeights& vertex_weights(std::uint32_t vertex) const { return smooth_[vertex]; }

 private:
  class Reach;
  void add_copy(double radius_m, Reach* reach);
  SurfaceView one() const { return one_.empty() ? surface_.view() : one_.view(); }
  std::uint32_t first_triangle(std::size_t copy) const { return static_cast<std::uint32_t>(copy * one().triangles.size()); }

  const LumpedBody* body_ = nullptr;
  std::size_t copies_ = 0;
  Surface surface_, one_;                // all copies; where there are several, one of them
  std::vector<Vec3> rest_;               // of all vertices
  std::vector<std::uint32_t> vertices_;  // those on the surface, ascending
  Eigen::AlignedBox3d box_;              // around their rest positions
  std::vector<NodeWeights> smooth_;      // per vertex; empty for those that are not on the surface
};

/// Returns B^T y for node vectors y (3 N): displacement, velocity or basis column at the point.
Vec3 gather(const NodeWeights& b, const Vector& y);
/// Computes y += B f.
void scatter(const NodeWeights& b, const Vec3& f, Vector& y);

}  // namespace palpate
