#include "server/scene/hexa_mesh.hpp"

#include <Eigen/LU>
#include <array>
#include <cmath>

namespace palpate {
namespace {

double sign_of(std::size_t node, std::size_t axis) { return (node >> axis & 1U) != 0 ? 1 : -1; }

/// N_i and its derivatives by xi, for a node and a point of the cube [-1, 1]^3.
struct Shape {
  double value = 1;
  Vec3 slope;
};
Shape shape_of(std::size_t node, const Vec3& xi) {
  Shape shape;
  Vec3 one;
  for (Eigen::Index a = 0; a < 3; ++a) one[a] = 0.5 * (1 + sign_of(node, static_cast<std::size_t>(a)) * xi[a]);
  shape.value = one.prod();
  for (Eigen::Index a = 0; a < 3; ++a)
    shape.slope[a] = 0.5 * sign_of(node, static_cast<std::size_t>(a)) * one[(a + 1) % 3] * one[(a + 2) % 3];
  return shape;
}

using AtPoints = Eigen::Array<double, 8, 1>;

/// Those of a node at the points of Gauss' rule with two points per axis, side by side.
struct GaussShape {
  AtPoints value;
  std::array<AtPoints, 3> slope;
};
std::array<GaussShape, 8> gauss_shapes() {
  std::array<GaussShape, 8> shapes;
  for (std::size_t i = 0; i < 8; ++i)
    for (std::size_t point = 0; point < 8; ++point) {
      const Shape at = shape_of(i, Vec3(sign_of(point, 0), sign_of(point, 1), sign_of(point, 2)) / std::sqrt(3.0));
      const auto lane = static_cast<Eigen::Index>(point);
      shapes[i].value[lane] = at.value;
      for (std::size_t a = 0; a < 3; ++a) shapes[i].slope[a][lane] = at.slope[static_cast<Eigen::Index>(a)];
    }
  return shapes;
}

/// Adds the nodal masses by Gauss' rule: exact with two points, as the volume density is of second order along each.
void add_volumes(const Hexahedron& cell, std::span<const Vec3> x, double density_kg_m3, std::vector<double>& to) {
  static const std::array<GaussShape, 8> shapes = gauss_shapes();
  std::array<std::array<AtPoints, 3>, 3> j;  // the Jacobian
  for (std::size_t r = 0; r < 3; ++r)
    for (std::size_t c = 0; c < 3; ++c) {
      j[r][c] = AtPoints::Zero();
      for (std::size_t i = 0; i < 8; ++i) j[r][c] += x[cell.nodes[i]][static_cast<Eigen::Index>(r)] * shapes[i].slope[c];
    }
  const auto part = [&](std::size_t a, std::size_t b, std::size_t c) -> AtPoints {
    return j[0][a] * (j[1][b] * j[2][c] - j[1][c] * j[2][b]);
  };
  const AtPoints mass_kg = density_kg_m3 * (part(0, 1, 2) - part(1, 0, 2) + part(2, 0, 1));
  for (std::size_t i = 0; i < 8; ++i) {
    const AtPoints of_node = mass_kg * shapes[i].value;
    for (const double each : of_node) to[cell.nodes[i]] += each;
  }
}

}  // namespace

std::vector<Hexahedron> cells_as_hexahedra(const CellSet& cells, const Grid& grid, std::span<const std::uint32_t> number) {
  std::vector<Hexahedron> out;
  cells.each([&](const Index3& c) {
    if (!cells.has(c)) return;
    Hexahedron& hexahedron = out.emplace_back();
    for (unsigned i = 0; i < 8; ++i) {
      const Index3 offset{static_cast<int>(i & 1U), static_cast<int>(i >> 1 & 1U), static_cast<int>(i >> 2 & 1U)};
      hexahedron.nodes[i] = number[grid.index(c + offset)];
    }
  });
  return out;
}

Vec3 centre_of(const Hexahedron& cell, std::span<const Vec3> x) {
  Vec3 sum = Vec3::Zero();
  for (const std::uint32_t node : cell.nodes) sum += x[node];
  return sum / 8;
}

std::vector<double> lumped_masses(std::span<const Hexahedron> cells, std::span<const Vec3> x, double density_kg_m3) {
  std::vector<double> masses(x.size(), 0);
  for (const Hexahedron& cell : cells) add_volumes(cell, x, cell.share * density_kg_m3, masses);
  return masses;
}

}  // namespace palpate
