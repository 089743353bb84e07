#include "server/scene/tetra_mesh.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <set>

#include "common/base/error.hpp"
#include "server/scene/disjoint_sets.hpp"
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
  DisjointSets pieces(mesh.vertices.size());
  for (const Tetrahedron& t : mesh.cells)
    for (const std::uint32_t node : t.nodes) pieces.join(node, t.nodes[0]);
  std::size_t parts = 0;
  for (std::uint32_t i = 0; i < mesh.vertices.size(); ++i) parts += pieces.find(i) == i;
  if (parts > 1) throw InputError(where, "falls apart into " + std::to_string(parts) + " pieces", "one body");
}

/// Drops duplicates, as some programs write a volume in two groups twice.
void drop_doubled_cells(TetraMesh& mesh, const std::string& where) {
  std::set<std::array<std::uint32_t, 4>> seen;
  const std::size_t doubled = std::erase_if(mesh.cells, [&](const Tetrahedron& t) {
    auto key = t.nodes;
    std::sort(key.begin(), key.end());
    return !seen.insert(key).second;
  });
  if (doubled > 0)
    std::fprintf(stderr,
                 "%s: %zu tetrahedra are there twice, as of a volume in two groups; read once, with the region of the first\n",
                 where.c_str(), doubled);
}

/// Drops cells with a corner twice: their neighbours share a face already.
void drop_collapsed_cells(TetraMesh& mesh, const std::string& where) {
  const std::size_t collapsed = std::erase_if(mesh.cells, [](const Tetrahedron& t) {
    auto nodes = t.nodes;
    std::sort(nodes.begin(), nodes.end());
    return std::adjacent_find(nodes.begin(), nodes.end()) != nodes.end();
  });
  if (mesh.cells.empty()) throw InputError(where, "has no tetrahedra of four corners", "cells with a volume");
  if (collapsed > 0) std::fprintf(stderr, "%s: %zu tetrahedra have a corner twice; left out\n", where.c_str(), collapsed);
}

/// Drops flat cells at the surface, which becomes that of the cells below them.
void peel(TetraMesh& mesh) {
  const auto is_outside = [](const std::map<Triangle, FaceUse>& uses, const Tetrahedron& t) {
    return std::ranges::any_of(kFaces, [&](const auto& corners) {
      Triangle key{t.nodes[corners[0]], t.nodes[corners[1]], t.nodes[corners[2]]};
      std::sort(key.begin(), key.end());
      return uses.at(key).count == 1;
    });
  };
  while (!mesh.flat.empty()) {
    const auto uses = uses_of_faces(all_of(mesh));
    if (std::erase_if(mesh.flat, [&](const Tetrahedron& t) { return is_outside(uses, t); }) == 0) return;
  }
}

void check_quality(TetraMesh& mesh, const std::string& where) {
  std::size_t flat = 0;
  double least = 1, all_m3 = 0, left_out_m3 = 0;
  std::string at;
  const std::size_t cells = mesh.cells.size();
  for (const Tetrahedron& t : mesh.cells) {
    const double quality = quality_of(t, mesh.vertices), volume_m3 = volume_of(t, mesh.vertices);
    all_m3 += volume_m3;
    if (quality >= kMinQuality) continue;
    ++flat;
    if (quality < kLeastQuality) {
      mesh.flat.push_back(t);
      left_out_m3 += volume_m3;
    }
    if (!at.empty() && !(quality < least)) continue;
    least = quality;
    at = in_words(centre_of(t, mesh.vertices));
  }
  if (flat == 0) return;
  const double share = static_cast<double>(flat) / static_cast<double>(cells);
  const std::string words = fmt::format("{} of {} tetrahedra ({:.2g} %) {} flat, the flattest of quality {:.2g} at {}", flat,
                                        cells, 100 * share, flat == 1 ? "is" : "are", least, at);
  if (!(share <= kMostFlat && left_out_m3 <= kMostFlat * all_m3))
    throw InputError(where, words, "quality 0.02 and more, but for 1 % of them");
  std::erase_if(mesh.cells, [&](const Tetrahedron& t) { return quality_of(t, mesh.vertices) < kLeastQuality; });
  std::vector<std::uint8_t> has_cell(mesh.vertices.size(), 0);
  for (const Tetrahedron& t : mesh.cells)
    for (const std::uint32_t node : t.nodes) has_cell[node] = 1;
  for (const Tetrahedron& t : mesh.flat)
    for (const std::uint32_t node : t.nodes)
      if (has_cell[node] == 0)
        throw InputError(where, "has nothing but flat tetrahedra at the node " + in_words(mesh.vertices[node]),
                         "a cell with a volume");
  const std::size_t below = mesh.flat.size();
  peel(mesh);
  const std::string left_out =
      below == 0 ? "" : fmt::format("; {} below 0.005 ({:.2g} % of the volume) left out", below, 100 * left_out_m3 / all_m3);
  fmt::print(stderr, "{}: {}{}; a better mesh has none below 0.02\n", where, words, left_out);
}

using Face = std::vector<std::size_t>;
const std::map<CellKind, std::vector<Face>> kFacesOf = {
    {CellKind::tetrahedron, {{0, 1, 2}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}}},
    {CellKind::pyramid, {{0, 1, 2, 3}, {0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}}},
    {CellKind::prism, {{0, 1, 2}, {3, 4, 5}, {0, 1, 4, 3}, {1, 2, 5, 4}, {2, 0, 3, 5}}},
    {CellKind::hexahedron, {{0, 1, 2, 3}, {4, 5, 6, 7}, {0, 1, 5, 4}, {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}}}};

}  // namespace

std::vector<Tetrahedron> all_of(const TetraMesh& mesh) {
  std::vector<Tetrahedron> all = mesh.cells;
  all.insert(all.end(), mesh.flat.begin(), mesh.flat.end());
  return all;
}

void add_cell(CellKind kind, std::span<const std::uint32_t> corners, std::uint32_t region, std::vector<Tetrahedron>& out) {
  if (kind == CellKind::tetrahedron) {
    out.push_back({{corners[0], corners[1], corners[2], corners[3]}, region});
    return;
  }
  const std::uint32_t apex = *std::min_element(corners.begin(), corners.end());
  for (const Face& places : kFacesOf.at(kind)) {
    std::vector<std::uint32_t> face;
    for (const std::size_t place : places) face.push_back(corners[place]);
    if (std::ranges::find(face, apex) != face.end()) continue;
    std::rotate(face.begin(), std::ranges::min_element(face), face.end());
    for (std::size_t i = 1; i + 1 < face.size(); ++i) out.push_back({{apex, face[0], face[i], face[i + 1]}, region});
  }
}

std::vector<std::uint32_t> parts_by_faces(std::span<const Tetrahedron> cells) {
  DisjointSets parts(cells.size());
  std::map<Triangle, std::uint32_t> first_with;
  for (std::uint32_t i = 0; i < cells.size(); ++i)
    for (const auto& corners : kFaces) {
      Triangle key{cells[i].nodes[corners[0]], cells[i].nodes[corners[1]], cells[i].nodes[corners[2]]};
      std::sort(key.begin(), key.end());
      parts.join(i, first_with.try_emplace(key, i).first->second);
    }
  std::vector<std::uint32_t> part;
  for (std::uint32_t i = 0; i < cells.size(); ++i) part.push_back(parts.find(i));
  return part;
}

std::vector<Tetrahedron> split_cells(const CellSet& cells, const Grid& grid, std::span<const std::uint32_t> number) {
  constexpr std::array<std::array<std::size_t, 3>, 6> kWays = {
      {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}}};
  std::vector<Tetrahedron> out;
  cells.each([&](const Index3& c) {
    if (!cells.has(c)) return;
    for (const auto& way : kWays) {  // from the lowest corner to the highest, one axis after the other
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
    for (const std::uint32_t node : t.nodes) masses[node] += 0.25 * t.share * density_kg_m3 * volume_of(t, x);
  return masses;
}

void check_mesh(TetraMesh& mesh, const std::string& where) {
  drop_collapsed_cells(mesh, where);
  drop_unused_vertices(mesh);
  check_place(mesh.vertices, where);
  for (Tetrahedron& t : mesh.cells)
    if (volume_of(t, mesh.vertices) < 0) std::swap(t.nodes[2], t.nodes[3]);
  drop_doubled_cells(mesh, where);
  for (const auto& [key, use] : uses_of_faces(mesh.cells))
    if (use.count > 2)
      throw InputError(where, "has a face with more than two tetrahedra at " + in_words(mesh.vertices[key[0]]),
                       "cells side by side");
  check_quality(mesh, where);
  check_in_one_piece(mesh, where);
}

}  // namespace palpate
