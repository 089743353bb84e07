#include "server/scene/cut_walls.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>
#include <span>
#include <tuple>
#include <utility>

#include "server/scene/disjoint_sets.hpp"

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
    std::vector<std::pair<Corners3, std::uint32_t>> face_of;
    for (std::uint32_t f = 0; f < cut_.faces.size(); ++f)
      if (cut_.faces[f].is_outer())
        for (std::size_t k = 0; k < cut_.kind->face_corners; ++k) {
          const std::size_t n = cut_.kind->face_corners;
          face_of.emplace_back(sorted({node_at(f, k), node_at(f, (k + 1) % n), node_at(f, (k + 2) % n)}), f);
        }
    std::sort(face_of.begin(), face_of.end());
    for (const Triangle& t : triangles) {
      const auto at = std::lower_bound(face_of.begin(), face_of.end(), std::pair{sorted(t), std::uint32_t{0}});
      assert(at != face_of.end() && at->first == sorted(t));
      const std::uint32_t f = at->second;
      if (!is_cut(f) && kept_[cut_.copy_at(cut_.faces[f].cells[0], corner_at(f, 0))] != 0) add(t, t[0]);
    }
    for (std::uint32_t f = 0; f < cut_.faces.size(); ++f)
      if (cut_.faces[f].is_outer() && is_cut(f)) split(f);
  }

  void add_walls() {
    std::map<CellLink, std::vector<std::uint32_t>> cells_at;
    for (std::uint32_t cell = 0; cell < cut_.cells.size(); ++cell)
      for (const auto& [a, b] : cut_.kind->links) {
        const CellLink link = link_of(cut_.cells[cell][a], cut_.cells[cell][b]);
        if (cut_.is_cut(link)) cells_at[link].push_back(cell);
      }
    for (const auto& [link, cells] : cells_at)
      for (const Around& around : order(link, cells)) add_wall(link, around);
  }

  CutSurface take() {
    drop_pockets();
    part_pinches();
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
      if (cut_.is_cut(edge_at(face, k))) return true;
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
      if (cut_.is_cut(link)) add_crossing(link, copy, 1, weights);
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

  /// `side`: the node of the body on whose side of the cut it lies.
  void add(const Triangle& t, std::uint32_t side) {
    if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) return;
    surface_.triangles.push_back(t);
    side_.push_back(side);
  }

  /// Splits an outer face into a polygon for each run of corners between its cut edges.
  void split(std::uint32_t face) {
    const std::size_t n = cut_.kind->face_corners;
    const std::uint32_t cell = cut_.faces[face].cells[0];
    for (std::size_t begin = 0; begin < n; ++begin) {
      const CellLink before = edge_at(face, begin + n - 1);
      if (!cut_.is_cut(before)) continue;
      const std::uint32_t copy = cut_.copy_at(cell, corner_at(face, begin));
      if (kept_[copy] == 0) continue;
      const std::uint32_t middle = face_vertex(face, copy);
      std::uint32_t last = link_vertex(before, copy);
      std::size_t k = begin;
      for (;; ++k) {
        const std::uint32_t next = node_at(face, k);
        add({middle, last, next}, next);
        last = next;
        if (cut_.is_cut(edge_at(face, k))) break;
      }
      add({middle, last, link_vertex(edge_at(face, k), copy)}, last);
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
          add({p[0], p[k], p[k + 1]}, side);
        else
          add({p[0], p[k + 1], p[k]}, side);
      }
    }
  }

  /// Drops pairs of triangles with the same corners, which a cut has made: they face each other and never part.
  void drop_pockets() {
    std::map<Corners3, std::vector<std::size_t>> alike;
    for (std::size_t t = 0; t < surface_.triangles.size(); ++t)
      if (std::ranges::any_of(surface_.triangles[t], [&](std::uint32_t v) { return v >= nodes_; }))
        alike[sorted(surface_.triangles[t])].push_back(t);
    std::vector<std::uint8_t> drop(surface_.triangles.size(), 0);
    for (const auto& [corners, pair] : alike)
      if (pair.size() == 2) drop[pair[0]] = drop[pair[1]] = 1;
    std::size_t t = 0;
    std::erase_if(surface_.triangles, [&](const Triangle&) { return drop[t++] != 0; });
    t = 0;
    std::erase_if(side_, [&](std::uint32_t) { return drop[t++] != 0; });
  }

  /// An edge of a triangle, and the numbers of its corners at the edge's lower and higher vertex.
  struct Use {
    std::uint32_t low, high, at_low, at_high;
    bool rises;
    std::uint32_t triangle() const { return at_low / 3; }
  };
  using Neighbours = std::pair<Use, Use>;  // the first rises, the second falls

  /// Edges with a vertex that cuts made, in order.
  std::vector<Use> edges() const {
    std::vector<Use> uses;
    for (std::uint32_t t = 0; t < surface_.triangles.size(); ++t)
      for (std::uint32_t k = 0; k < 3; ++k) {
        const std::uint32_t a = surface_.triangles[t][k], b = surface_.triangles[t][(k + 1) % 3];
        const std::uint32_t at_a = 3 * t + k, at_b = 3 * t + (k + 1) % 3;
        if (std::max(a, b) < nodes_) continue;
        uses.push_back(a < b ? Use{a, b, at_a, at_b, true} : Use{b, a, at_b, at_a, false});
      }
    std::sort(uses.begin(), uses.end(),
              [](const Use& p, const Use& q) { return std::tie(p.low, p.high, p.at_low) < std::tie(q.low, q.high, q.at_low); });
    return uses;
  }

  /// Returns the triangles of one edge in pairs of neighbours: first those on one side of the cut.
  std::vector<Neighbours> neighbours(std::span<const Use> uses) const {
    std::vector<Use> rising, falling;
    for (const Use& use : uses) (use.rises ? rising : falling).push_back(use);
    std::vector<Neighbours> pairs;
    for (const bool of_one_side : {true, false})
      std::erase_if(rising, [&](const Use& use) {
        const auto other = std::ranges::find_if(
            falling, [&](const Use& u) { return !of_one_side || side_[u.triangle()] == side_[use.triangle()]; });
        if (other == falling.end()) return false;
        pairs.emplace_back(use, *other);
        falling.erase(other);
        return true;
      });
    return pairs;
  }

  /// Corners of triangles that are one vertex: a run of neighbours around it.
  DisjointSets runs(const std::vector<Neighbours>& pairs) const {
    DisjointSets corners(3 * surface_.triangles.size());
    for (const auto& [rising, falling] : pairs) {
      corners.join(rising.at_low, falling.at_low);
      corners.join(rising.at_high, falling.at_high);
    }
    return corners;
  }

  /// Where walls touch themselves along an edge, as where opposite corners of a cell are cut off, gives each its own vertices.
  void part_pinches() {
    const std::vector<Use> uses = edges();
    std::vector<Neighbours> pairs;
    std::vector<std::pair<std::size_t, std::size_t>> pinches;  // edges with several pairs
    for (auto begin = uses.begin(); begin != uses.end();) {
      const auto end =
          std::find_if(begin, uses.end(), [&](const Use& u) { return u.low != begin->low || u.high != begin->high; });
      const std::vector<Neighbours> here = neighbours({begin, end});
      if (here.size() > 1) pinches.emplace_back(pairs.size(), pairs.size() + here.size());
      pairs.insert(pairs.end(), here.begin(), here.end());
      begin = end;
    }
    if (pinches.empty()) return;
    DisjointSets corners = runs(pairs);
    // Two pairs between the same two runs: the other neighbours make two runs of each.
    for (const auto& [first, last] : pinches)
      for (std::size_t p = first; p < last; ++p)
        for (std::size_t q = first; q < p; ++q) {
          const auto is_one = [&](std::uint32_t Use::*at) {
            return corners.find(pairs[p].first.*at) == corners.find(pairs[q].first.*at);
          };
          if (!is_one(&Use::at_low) || !is_one(&Use::at_high)) continue;
          std::swap(pairs[p].second, pairs[q].second);
          corners = runs(pairs);
        }
    name_runs(corners);
  }

  /// Makes each run of corners a vertex: the first of a vertex keeps its number.
  void name_runs(DisjointSets& corners) {
    std::map<std::uint32_t, std::uint32_t> vertex_of;  // of a run, named by its lowest corner
    std::vector<std::uint8_t> taken(surface_.embedded.size(), 0);
    for (std::uint32_t corner = 0; corner < 3 * surface_.triangles.size(); ++corner) {
      std::uint32_t& vertex = surface_.triangles[corner / 3][corner % 3];
      if (vertex < nodes_) continue;
      const std::uint32_t v = vertex - nodes_;
      const auto [at, fresh] = vertex_of.try_emplace(corners.find(corner), vertex);
      if (fresh && taken[v] != 0) {
        at->second = nodes_ + static_cast<std::uint32_t>(surface_.embedded.size());
        surface_.embedded.push_back(EmbeddedVertex(surface_.embedded[v]));
      }
      taken[v] = 1;
      vertex = at->second;
    }
  }

  const CutCells& cut_;
  const std::vector<Vec3>& x_;
  const std::vector<std::uint8_t>& kept_;
  std::uint32_t nodes_;
  std::map<NodeWeights, std::uint32_t> known_;
  CutSurface surface_;
  std::vector<std::uint32_t> side_;  // of each triangle
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
