#include "server/scene/tetra_mesh.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>

#include "common/base/error.hpp"
#include "server/scene/mesh_file.hpp"

namespace palpate {
namespace {

/// Corners of the faces opposite to nodes 0..3, counter-clockwise seen from outside.
constexpr std::array<std::array<std::size_t, 3>, 4> kFaces = {{{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}}};

struct FaceUse {
  int count = 0;
  Triangle face{};
};

std::map<Triangle, FaceUse> uses_of_faces(std::span<const Tetrahedron> cells) {
  std::map<Triangle, FaceUse> uses;
  for (const Tetrahedron& t : cells)
    for (const auto& corners : kFaces) {
      const Triangle face{t.nodes[corners[0]], t.nodes[corners[1]], t.nodes[corners[2]]};
      Triangle key = face;
      std::sort(key.begin(), key.end());
      FaceUse& use = uses[key];
      ++use.count;
      use.face = face;
    }
  return uses;
}

std::uint32_t root_of(std::vector<std::uint32_t>& parent, std::uint32_t i) {
  while (parent[i] != i) i = parent[i] = parent[parent[i]];
  return i;
}

void drop_unused_vertices(TetraMesh& mesh) {
  std::vector<std::uint32_t> number(mesh.vertices.size(), kNoNode);
  std::vector<Vec3> used;
  for (Tetrahedron& t : mesh.cells)
    for (std::uint32_t& node : t.nodes) {
      if (number[node] == kNoNode) {
        number[node] = static_cast<std::uint32_t>(used.size());
        used.push_back(mesh.vertices[node]);
      }
      node = number[node];
    }
  mesh.vertices = std::move(used);
}

void check_in_one_piece(const TetraMesh& mesh, const std::string& where) {
  std::vector<std::uint32_t> parent(mesh.vertices.size());
  for (std::uint32_t i = 0; i < parent.size(); ++i) parent[i] = i;
  for (const Tetrahedron& t : mesh.cells)
    for (const std::uint32_t node : t.nodes) parent[root_of(parent, node)] = root_of(parent, t.nodes[0]);
  std::size_t parts = 0;
  for (std::uint32_t i = 0; i < parent.size(); ++i) parts += root_of(parent, i) == i;
  if (parts > 1) throw InputError(where, "falls apart into " + std::to_string(parts) + " pieces", "one body");
}

}  // namespace

std::vector<Tetrahedron> split_cells(const CellSet& cells, const Grid& grid, std::span<const std::uint32_t> number) {
  constexpr std::array<std::array<std::size_t, 3>, 6> kWays = {
      {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}}};
  std::vector<Tetrahedron> out;
  cells.each([&](const Index3& c) {
    if (!cells.has(c)) return;
    for (const auto& way : kWays) {  // from the lowest corner to the highest, an axis after the other
      Index3 at = c;
      Tetrahedron t;
      t.nodes[0] = number[grid.index(at)];
      for (std::size_t n = 0; n < 3; ++n) {
        ++at[way[n]];
        t.nodes[n + 1] = number[grid.index(at)];
      }
      if ((way[0] + 1) % 3 != way[1]) std::swap(t.nodes[2], t.nodes[3]);  // an odd order of the axes is left-handed
      out.push_back(t);
    }
  });
  return out;
}

Vec3 centre_of(const Tetrahedron& t, std::span<const Vec3> x) {
  return 0.25 * (x[t.nodes[0]] + x[t.nodes[1]] + x[t.nodes[2]] + x[t.nodes[3]]);
}

double volume_of(const Tetrahedron& t, std::span<const Vec3> x) {
  const Vec3& o = x[t.nodes[0]];
  return (x[t.nodes[1]] - o).dot((x[t.nodes[2]] - o).cross(x[t.nodes[3]] - o)) / 6;
}

double quality_of(const Tetrahedron& t, std::span<const Vec3> x) {
  double squares = 0;
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t j = 0; j < i; ++j) squares += (x[t.nodes[i]] - x[t.nodes[j]]).squaredNorm();
  const double root = std::cbrt(3 * volume_of(t, x));
  return 12 * std::copysign(root * root, root) / squares;
}

std::vector<Triangle> outer_faces(std::span<const Tetrahedron> cells) {
  std::vector<Triangle> faces;
  for (const auto& [key, use] : uses_of_faces(cells))
    if (use.count == 1) faces.push_back(use.face);
  return faces;
}

std::vector<double> lumped_masses(std::span<const Tetrahedron> cells, std::span<const Vec3> x, double density_kg_m3) {
  std::vector<double> masses(x.size(), 0);
  for (const Tetrahedron& t : cells)
    for (const std::uint32_t node : t.nodes) masses[node] += 0.25 * density_kg_m3 * volume_of(t, x);
  return masses;
}

void check_mesh(TetraMesh& mesh, const std::string& where) {
  drop_unused_vertices(mesh);
  check_place(mesh.vertices, where);
  for (Tetrahedron& t : mesh.cells)
    if (volume_of(t, mesh.vertices) < 0) std::swap(t.nodes[2], t.nodes[3]);
  for (const Tetrahedron& t : mesh.cells)
    if (!(quality_of(t, mesh.vertices) >= kMinQuality))
      throw InputError(where, "has a flat tetrahedron at " + in_words(centre_of(t, mesh.vertices)), "a better mesh");
  for (const auto& [key, use] : uses_of_faces(mesh.cells))
    if (use.count > 2)
      throw InputError(where, "has a face with more than two tetrahedra at " + in_words(mesh.vertices[key[0]]),
                       "cells side by side");
  check_in_one_piece(mesh, where);
}

}  // namespace palpate
