#include "server/scene/cut_walls.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>

namespace palpate {
namespace {

using Corners3 = std::array<std::uint32_t, 3>;

Corners3 sorted(Corners3 of) {
  std::sort(of.begin(), of.end());
  return of;
}

/// Cells around a link, in order; a fan has an outer face at both ends, a ring has none.
struct Around {
  std::vector<std::uint32_t> cells;
  std::array<std::uint32_t, 2> ends{kNoCell, kNoCell};  // faces
  bool is_open() const { return ends[0] != kNoCell; }
};

class Walls {
 public:
  Walls(const CutCells& cut, const std::vector<Vec3>& x, const std::vector<std::uint8_t>& kept)
      : cut_(cut), x_(x), kept_(kept), nodes_(static_cast<std::uint32_t>(cut.origin.size())) {}

  void add_outer(const std::vector<Triangle>& triangles) {
    std::map<Corners3, std::uint32_t> face_of;
    for (std::uint32_t f = 0; f < cut_.faces.size(); ++f)
      if (cut_.faces[f].is_outer())
        for (std::size_t k = 0; k < cut_.kind->face_corners; ++k) {
          const std::size_t n = cut_.kind->face_corners;
          face_of[sorted({node_at(f, k), node_at(f, (k + 1) % n), node_at(f, (k + 2) % n)})] = f;
        }
    for (const Triangle& t : triangles) {
      const std::uint32_t f = face_of.at(sorted(t));
      if (!is_cut(f) && kept_[cut_.copy_at(cut_.faces[f].cells[0], corner_at(f, 0))] != 0) surface_.triangles.push_back(t);
    }
    for (std::uint32_t f = 0; f < cut_.faces.size(); ++f)
      if (cut_.faces[f].is_outer() && is_cut(f)) split(f);
  }

  void add_walls() {
    std::map<CellLink, std::vector<std::uint32_t>> cells_at;
    for (std::uint32_t cell = 0; cell < cut_.cells.size(); ++cell)
      for (const auto& [a, b] : cut_.kind->links) {
        const CellLink link = link_of(cut_.cells[cell][a], cut_.cells[cell][b]);
        if (cut_.links.contains(link)) cells_at[link].push_back(cell);
      }
    for (const auto& [link, cells] : cells_at)
      for (const Around& around : order(link, cells)) add_wall(link, around);
  }

  CutSurface take() {
    drop_pockets();
    return std::move(surface_);
  }

 private:
  std::size_t corner_at(std::uint32_t face, std::size_t k) const {
    return cut_.kind->faces[cut_.faces[face].number[0]][k % cut_.kind->face_corners];
  }
  std::uint32_t node_at(std::uint32_t face, std::size_t k) const {
    return cut_.cells[cut_.faces[face].cells[0]][corner_at(face, k)];
  }
  CellLink edge_at(std::uint32_t face, std::size_t k) const { return link_of(node_at(face, k), node_at(face, k + 1)); }
  bool is_cut(std::uint32_t face) const {
    for (std::size_t k = 0; k < cut_.kind->face_corners; ++k)
      if (cut_.links.contains(edge_at(face, k))) return true;
    return false;
  }
  bool has(std::uint32_t face, const CellLink& link) const {
    for (std::size_t k = 0; k < cut_.kind->face_corners; ++k)
      if (edge_at(face, k) == link) return true;
    return false;
  }

  /// Returns the vertex with these weights; the same weights are the same vertex.
  std::uint32_t vertex(NodeWeights weights, bool is_wall) {
    NodeWeights each = merged(std::move(weights));
    const auto next = nodes_ + static_cast<std::uint32_t>(surface_.embedded.size());
    const auto [at, fresh] = known_.try_emplace(each, next);
    if (fresh) surface_.embedded.push_back({std::move(each), is_wall});
    return at->second;
  }
  /// Adds the point where the cut crosses a link, by the nodes of a copy, with this weight.
  void add_crossing(const CellLink& link, std::uint32_t copy, double weight, NodeWeights& to) const {
    const CellCopy& of = cut_.copies[copy];
    const double t = cut_.links.at(link);
    to.emplace_back(of.nodes[cut_.corner_of(of.cell, link.first)], weight * (1 - t));
    to.emplace_back(of.nodes[cut_.corner_of(of.cell, link.second)], weight * t);
  }
  std::uint32_t mean_of(const std::vector<CellLink>& links, std::uint32_t copy, bool is_wall) {
    NodeWeights weights;
    for (const CellLink& link : links)
      if (cut_.links.contains(link)) add_crossing(link, copy, 1, weights);
    const double count = 0.5 * static_cast<double>(weights.size());
    for (auto& [node, weight] : weights) weight /= count;
    return vertex(std::move(weights), is_wall);
  }
  std::uint32_t link_vertex(const CellLink& link, std::uint32_t copy) { return mean_of({link}, copy, false); }
  std::uint32_t face_vertex(std::uint32_t face, std::uint32_t copy) {
    std::vector<CellLink> links;
    for (std::size_t k = 0; k < cut_.kind->face_corners; ++k) links.push_back(edge_at(face, k));
    return mean_of(links, copy, false);
  }
  std::uint32_t cell_vertex(std::uint32_t copy) {
    const CellNodes& nodes = cut_.cells[cut_.copies[copy].cell];
    std::vector<CellLink> links;
    for (const auto& [a, b] : cut_.kind->links) links.push_back(link_of(nodes[a], nodes[b]));
    return mean_of(links, copy, true);
  }

  void add(const Triangle& t) {
    if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) surface_.triangles.push_back(t);
  }

  /// Splits an outer face into a polygon for each run of corners between its cut edges.
  void split(std::uint32_t face) {
    const std::size_t n = cut_.kind->face_corners;
    const std::uint32_t cell = cut_.faces[face].cells[0];
    for (std::size_t begin = 0; begin < n; ++begin) {
      const CellLink before = edge_at(face, begin + n - 1);
      if (!cut_.links.contains(before)) continue;
      const std::uint32_t copy = cut_.copy_at(cell, corner_at(face, begin));
      if (kept_[copy] == 0) continue;
      const std::uint32_t middle = face_vertex(face, copy);
      std::uint32_t last = link_vertex(before, copy);
      std::size_t k = begin;
      for (;; ++k) {
        const std::uint32_t next = node_at(face, k);
        add({middle, last, next});
        last = next;
        if (cut_.links.contains(edge_at(face, k))) break;
      }
      add({middle, last, link_vertex(edge_at(face, k), copy)});
    }
  }

  /// Returns the two faces of a cell at a link.
  std::array<std::uint32_t, 2> faces_at(std::uint32_t cell, const CellLink& link) const {
    std::array<std::uint32_t, 2> found{};
    std::size_t count = 0;
    for (std::size_t number = 0; number < cut_.kind->faces.size(); ++number) {
      const std::uint32_t face = cut_.face_at(cell, number);
      if (has(face, link) && count < 2) found[count++] = face;
    }
    assert(count == 2);
    return found;
  }

  std::vector<Around> order(const CellLink& link, std::vector<std::uint32_t> cells) const {
    std::vector<Around> all;
    while (!cells.empty()) {
      Around around;
      std::uint32_t cell = cells.front(), into = kNoCell;  // `into`: the face by which the walk came
      for (const std::uint32_t c : cells)
        for (const std::uint32_t face : faces_at(c, link))
          if (cut_.faces[face].is_outer() && !around.is_open()) {
            around.ends[0] = into = face;
            cell = c;
          }
      if (into == kNoCell) into = faces_at(cell, link)[0];
      for (;;) {
        around.cells.push_back(cell);
        std::erase(cells, cell);
        const auto faces = faces_at(cell, link);
        const std::uint32_t out = faces[0] == into ? faces[1] : faces[0];
        const auto [one, other] = cut_.faces[out].cells;
        if (other == kNoCell) {
          around.ends[1] = out;
          break;
        }
        cell = one == cell ? other : one;
        into = out;
        if (cell == around.cells.front()) break;
      }
      all.push_back(std::move(around));
    }
    return all;
  }

  Vec3 middle_of_cell(std::uint32_t cell) const {
    Vec3 sum = Vec3::Zero();
    for (std::size_t c = 0; c < cut_.kind->corners; ++c) sum += x_[cut_.cells[cell][c]];
    return sum / static_cast<double>(cut_.kind->corners);
  }
  Vec3 middle_of_face(std::uint32_t face) const {
    Vec3 sum = Vec3::Zero();
    for (std::size_t k = 0; k < cut_.kind->face_corners; ++k) sum += x_[node_at(face, k)];
    return sum / static_cast<double>(cut_.kind->face_corners);
  }

  /// Returns true if the cells go counter-clockwise around the link, seen from its second node.
  bool is_counter_clockwise(const CellLink& link, const Around& around) const {
    std::vector<Vec3> points;
    if (around.is_open()) points = {0.5 * (x_[link.first] + x_[link.second]), middle_of_face(around.ends[0])};
    for (const std::uint32_t cell : around.cells) points.push_back(middle_of_cell(cell));
    if (around.is_open()) points.push_back(middle_of_face(around.ends[1]));
    Vec3 area = Vec3::Zero();
    for (std::size_t k = 1; k + 1 < points.size(); ++k) area += (points[k] - points[0]).cross(points[k + 1] - points[0]);
    return area.dot(x_[link.second] - x_[link.first]) > 0;
  }

  std::vector<std::uint32_t> polygon(const CellLink& link, const Around& around, std::uint32_t side) {
    const auto copy = [&](std::uint32_t cell) { return cut_.copy_at(cell, cut_.corner_of(cell, side)); };
    std::vector<std::uint32_t> vertices;
    if (around.is_open()) {
      vertices.push_back(link_vertex(link, copy(around.cells.front())));
      vertices.push_back(face_vertex(around.ends[0], copy(around.cells.front())));
    }
    for (const std::uint32_t cell : around.cells) vertices.push_back(cell_vertex(copy(cell)));
    if (around.is_open()) vertices.push_back(face_vertex(around.ends[1], copy(around.cells.back())));
    return vertices;
  }

  Vec3 rest_of(std::uint32_t v) const {
    if (v < nodes_) return x_[cut_.origin[v]];
    Vec3 sum = Vec3::Zero();
    for (const auto& [node, weight] : surface_.embedded[v - nodes_].weights) sum += weight * x_[cut_.origin[node]];
    return sum;
  }

  /// Adds both walls at a link, split alike: four corners along the shorter diagonal, others from the first.
  void add_wall(const CellLink& link, const Around& around) {
    const bool forward = is_counter_clockwise(link, around);
    std::size_t from = 0;
    for (const std::uint32_t side : {link.first, link.second}) {
      if (kept_[cut_.copy_at(around.cells.front(), cut_.corner_of(around.cells.front(), side))] == 0) continue;
      std::vector<std::uint32_t> p = polygon(link, around, side);
      if (side == link.first && p.size() == 4 && !around.is_open())
        from = (rest_of(p[1]) - rest_of(p[3])).norm() < (rest_of(p[0]) - rest_of(p[2])).norm() ? 1 : 0;
      std::rotate(p.begin(), p.begin() + static_cast<std::ptrdiff_t>(from), p.end());
      for (std::size_t k = 1; k + 1 < p.size(); ++k) {
        if (forward == (side == link.first))
          add({p[0], p[k], p[k + 1]});
        else
          add({p[0], p[k + 1], p[k]});
      }
    }
  }

  /// Drops pairs of triangles with the same corners: they face each other and never part.
  void drop_pockets() {
    std::map<Corners3, std::vector<std::size_t>> alike;
    for (std::size_t t = 0; t < surface_.triangles.size(); ++t) alike[sorted(surface_.triangles[t])].push_back(t);
    std::vector<std::uint8_t> drop(surface_.triangles.size(), 0);
    for (const auto& [corners, pair] : alike)
      if (pair.size() == 2) drop[pair[0]] = drop[pair[1]] = 1;
    std::size_t t = 0;
    std::erase_if(surface_.triangles, [&](const Triangle&) { return drop[t++] != 0; });
  }

  const CutCells& cut_;
  const std::vector<Vec3>& x_;
  const std::vector<std::uint8_t>& kept_;
  std::uint32_t nodes_;
  std::map<NodeWeights, std::uint32_t> known_;
  CutSurface surface_;
};

}  // namespace

CutSurface cut_surface(const CutCells& cut, const std::vector<Vec3>& x, const std::vector<Triangle>& triangles,
                       const std::vector<std::uint8_t>& kept) {
  Walls walls(cut, x, kept);
  walls.add_outer(triangles);
  walls.add_walls();
  return walls.take();
}

}  // namespace palpate
