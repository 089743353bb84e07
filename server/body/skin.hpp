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
#pragma once

#include <Eigen/Geometry>
#include <utility>
#include <vector>

#include "common/patch/surface.hpp"
#include "server/scene/scene.hpp"
#include "server/solve/block_matrix.hpp"

namespace palpate {

class Skin {
 public:
  /// An empty skin, without contact.
  Skin() = default;
  /// `body` must outlive the skin. A body without triangles has an empty skin.
  explicit Skin(const LumpedBody& body, double radius_m = 0);

  bool empty() const { return surface_.empty(); }
  SurfaceView view() const { return surface_.view(); }
  /// Computes vertex positions, 3 per vertex of the body; those off the surface keep their rest positions, and all are nodes of a
  /// body without one, a sheet. `positions`: empty, or the output of an earlier call.
  void place(const Vector& x, std::vector<double>& positions) const;
  std::vector<double> place(const Vector& x) const;
  /// Returns a lower bound of the distance from a point to the skin [m]: that to the box around the rest positions, less the
  /// largest displacement. Takes much less time than the distance. Requires a skin that is not empty.
  double distance_at_least(const Vec3& point, const Vector& x) const;
  /// Returns B of a point.
  NodeWeights weights(const SurfacePoint& point) const;
  /// Returns the position of the point, with `b` = weights(point).
  Vec3 position(const SurfacePoint& point, const NodeWeights& b, const Vector& x) const;
  /// Returns the rest positions of the vertices.
  Positions rest() const { return {rest_.front().data(), 3 * rest_.size()}; }
  /// Returns the row of S for one vertex, over nodes.
  const NodeWeights& vertex_weights(std::uint32_t vertex) const { return smooth_[vertex]; }

 private:
  const LumpedBody* body_ = nullptr;
  Surface surface_;
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
