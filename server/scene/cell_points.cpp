#include "server/scene/cell_points.hpp"

#include <array>

namespace palpate {
namespace {

constexpr int kCuts = 4;  // a hexahedron's, along each axis

/// Cuts a tetrahedron into eight of the same volume.
std::vector<std::array<Vec3, 4>> eighths(const std::array<Vec3, 4>& t) {
  const auto mid = [&](std::size_t a, std::size_t b) -> Vec3 { return 0.5 * (t[a] + t[b]); };
  const Vec3 m01 = mid(0, 1), m02 = mid(0, 2), m03 = mid(0, 3), m12 = mid(1, 2), m13 = mid(1, 3), m23 = mid(2, 3);
  return {{{t[0], m01, m02, m03}}, {{m01, t[1], m12, m13}}, {{m02, m12, t[2], m23}}, {{m03, m13, m23, t[3]}},
          {{m01, m02, m03, m13}},  {{m01, m02, m12, m13}},  {{m02, m03, m13, m23}},  {{m02, m12, m13, m23}}};
}

}  // namespace

std::vector<Vec3> points_in(const Hexahedron& cell, const std::vector<Vec3>& x) {
  std::vector<Vec3> points;
  for (int p = 0; p < kCuts * kCuts * kCuts; ++p) {
    const std::array share{(p % kCuts + 0.5) / kCuts, (p / kCuts % kCuts + 0.5) / kCuts, (p / (kCuts * kCuts) + 0.5) / kCuts};
    Vec3 point = Vec3::Zero();
    for (unsigned corner = 0; corner < 8; ++corner) {
      double weight = 1;
      for (unsigned axis = 0; axis < 3; ++axis) weight *= (corner >> axis & 1u) != 0 ? share[axis] : 1 - share[axis];
      point += weight * x[cell.nodes[corner]];
    }
    points.push_back(point);
  }
  return points;
}

std::vector<Vec3> points_in(const Tetrahedron& cell, const std::vector<Vec3>& x) {
  std::vector<Vec3> points;
  const std::array<Vec3, 4> whole{x[cell.nodes[0]], x[cell.nodes[1]], x[cell.nodes[2]], x[cell.nodes[3]]};
  for (const auto& part : eighths(whole))
    for (const auto& t : eighths(part)) points.push_back(0.25 * (t[0] + t[1] + t[2] + t[3]));
  return points;
}

}  // namespace palpate
