// Triangles in a tree of boxes, for the nearest point on them and the number of times they wind around a point.
//
// Generalised winding number (Jacobson, Kavan and Sorkine-Hornung, 2013):
//
//     w(p) = sum over triangles of their signed solid angle from p, over 4 pi
//
// For a closed surface it is the number of its shells that contain p, each counted with its orientation: 1 in a ball, 2 where two
// balls overlap, 0 in a cavity whose triangles face into it. Distant triangles count as one dipole of their summed area vectors
// (Barill et al., 2018), near ones exactly.
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "common/patch/patch.hpp"

namespace palpate {

struct TriangleMesh {
  std::vector<Vec3> vertices;
  std::vector<Triangle> triangles;  ///< counter-clockwise seen from outside
};

class TriangleTree {
 public:
  /// Requires at least one triangle.
  explicit TriangleTree(TriangleMesh mesh);

  Vec3 nearest(const Vec3& p) const;
  /// The same, faster where `candidate`, a point of the surface, is close to it.
  Vec3 nearest(const Vec3& p, const Vec3& candidate) const;
  double winding_number(const Vec3& p) const;
  const TriangleMesh& mesh() const { return mesh_; }
  const Eigen::AlignedBox3d& bounds() const { return boxes_[0].box; }

 private:
  struct Box {
    Eigen::AlignedBox3d box;
    std::uint32_t first = 0, count = 0;               ///< range in order_, for a leaf
    std::uint32_t left = 0, right = 0;                ///< indices into boxes_, when count is 0
    Vec3 area = Vec3::Zero(), centre = Vec3::Zero();  ///< sum of area vectors; their centre, weighted by area
    double reach = 0;                                 ///< distance from the centre to the farthest corner of the box
  };
  struct Hit {
    Vec3 point;
    double squared;
  };

  std::array<Vec3, 3> corners(std::uint32_t t) const;
  std::uint32_t build(std::uint32_t first, std::uint32_t last);
  void take_dipole(Box& node, std::uint32_t first, std::uint32_t last) const;
  void visit(std::uint32_t index, const Vec3& p, Hit& best) const;
  double solid_angle(std::uint32_t index, const Vec3& p) const;

  TriangleMesh mesh_;
  std::vector<std::uint32_t> order_;
  std::vector<Box> boxes_;
};

}  // namespace palpate
