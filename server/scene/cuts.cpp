#include "server/scene/cuts.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <optional>

#include "server/scene/cell_points.hpp"
#include "server/scene/cut_walls.hpp"
#include "server/scene/grid.hpp"
#include "server/scene/hexa_mesh.hpp"
#include "server/scene/tetra_mesh.hpp"

namespace palpate {
namespace {

constexpr double kOnSheet = 0.02;          // share of a link's length
constexpr double kLeastShare = 1.0 / 128;  // of a cell's volume, for a copy that has none of its points

/// A parallelogram that the blade sweeps.
struct Sheet {
  Vec3 corner, along, down, normal;
  Eigen::AlignedBox3d box;

  Sheet(const Vec3& from, const Vec3& to, const Vec3& edge)
      : corner(from), along(to - from), down(edge), normal(along.cross(down).normalized()) {
    for (const Vec3& x : {from, to, Vec3(from + edge), Vec3(to + edge)}) box.extend(x);
  }

  /// Returns the share of the way from a to b at which the sheet crosses it.
  std::optional<double> crossing(const Vec3& a, const Vec3& b) const {
    constexpr double kSeam = 1e-6;  // sheets overlap by this share, so that nothing passes between two
    const double slack = kOnSheet * (b - a).norm();
    const auto height = [&](const Vec3& x) {
      const double h = normal.dot(x - corner);
      return std::abs(h) < slack ? slack : h;
    };
    const double from = height(a), to = height(b);
    if (from * to > 0) return std::nullopt;
    const double t = from / (from - to);
    const Vec3 at = a + t * (b - a) - corner;
    Mat3 axes;
    axes << along, down, normal;
    const Vec3 place = axes.inverse() * at;
    const auto within = [](double r) { return r >= -kSeam && r <= 1 + kSeam; };
    return within(place[0]) && within(place[1]) ? std::optional(t) : std::nullopt;
  }
};

std::vector<Sheet> sheets_of(const CutSettings& cut) {
  std::vector<Sheet> sheets;
  for (std::size_t i = 0; i + 1 < cut.path_m.size(); ++i)
    sheets.emplace_back(cut.path_m[i], cut.path_m[i + 1], cut.depth_m * cut.direction);
  return sheets;
}

std::optional<double> crossing(const std::vector<Sheet>& sheets, const Vec3& a, const Vec3& b) {
  for (const Sheet& sheet : sheets)
    if (const auto t = sheet.crossing(a, b)) return t;
  return std::nullopt;
}

/// Returns the sheets whose boxes meet that of the cell.
std::vector<Sheet> near(const std::vector<Sheet>& sheets, const Eigen::AlignedBox3d& box) {
  std::vector<Sheet> found;
  const double slack = kOnSheet * box.diagonal().norm();
  for (const Sheet& sheet : sheets)
    if (sheet.box.exteriorDistance(box) <= slack) found.push_back(sheet);
  return found;
}

template <class Cell>
struct Cutter {
  LumpedBody& body;
  std::vector<Cell>& cells;
  const CellTopology& kind = kind_of(static_cast<const Cell*>(nullptr));

  Eigen::AlignedBox3d box_of(const Cell& cell) const {
    Eigen::AlignedBox3d box;
    for (const std::uint32_t node : cell.nodes) box.extend(body.nodes[node]);
    return box;
  }

  /// Adds the links that sheets cross; returns their number.
  std::size_t add_links(const std::vector<Sheet>& sheets, CutLinks& links) const {
    std::size_t added = 0;
    for (const Cell& cell : cells) {
      const std::vector<Sheet> close = near(sheets, box_of(cell));
      if (close.empty()) continue;
      for (const auto& [a, b] : kind.links) {
        const CellLink link = link_of(cell.nodes[a], cell.nodes[b]);
        if (links.contains(link)) continue;
        const auto t = crossing(close, body.nodes[link.first], body.nodes[link.second]);
        if (t) links.emplace(link, *t);
        added += t.has_value();
      }
    }
    return added;
  }

  /// Returns the share of each part of a cell.
  std::vector<double> shares(const CutCells& cut, std::uint32_t cell, const std::vector<Sheet>& sheets) const {
    const std::size_t parts = cut.first_copy[cell + 1] - cut.first_copy[cell];
    if (parts == 1) return {1.0};
    const std::vector<Sheet> close = near(sheets, box_of(cells[cell]));
    std::vector<double> shares(parts, 0.0);
    for (const Vec3& point : points_in(cells[cell], body.nodes)) {
      std::vector<std::pair<double, std::size_t>> corners;
      for (std::size_t c = 0; c < kind.corners; ++c) corners.emplace_back((body.nodes[cells[cell].nodes[c]] - point).norm(), c);
      std::sort(corners.begin(), corners.end());
      const auto joined = std::find_if(corners.begin(), corners.end(), [&](const auto& corner) {
        return !crossing(close, body.nodes[cells[cell].nodes[corner.second]], point);
      });
      ++shares[cut.part[cell][(joined == corners.end() ? corners.front() : *joined).second]];
    }
    const double points = std::accumulate(shares.begin(), shares.end(), 0.0);
    for (double& share : shares) share = std::max(share / points, kLeastShare);
    const double sum = std::accumulate(shares.begin(), shares.end(), 0.0);
    for (double& share : shares) share /= sum;
    return shares;
  }

  /// Nodes that are fixed, or held by a ligament.
  std::vector<std::uint8_t> held() const {
    std::vector<std::uint8_t> nodes = body.fixed;
    for (const Element& e : body.elements) nodes[e.a] = nodes[e.b] = 1;
    return nodes;
  }

  std::vector<std::uint32_t> apply(CutLinks links, const std::vector<Sheet>& sheets) {
    std::vector<CellNodes> uncut;
    for (const Cell& cell : cells) std::copy(cell.nodes.begin(), cell.nodes.end(), uncut.emplace_back().begin());
    const CutCells cut = copy_cells(kind, std::move(uncut), body.nodes.size(), std::move(links));
    std::vector<std::uint8_t> kept = held_copies(cut, held());
    if (const auto loose = static_cast<std::size_t>(std::count(kept.begin(), kept.end(), 0)); loose == kept.size())
      std::fill(kept.begin(), kept.end(), 1);
    else if (loose > 0)
      std::fprintf(stderr, "cuts: %zu of %zu cells hang on nothing that is held; they are left out\n", loose, kept.size());
    CutSurface surface = cut_surface(cut, body.nodes, body.triangles, kept);

    const std::vector<double> before = lumped_masses(cells, body.nodes, 1);
    const std::size_t own = own_nodes(body);
    const double density_kg_m3 =
        std::accumulate(body.masses_kg.begin(), body.masses_kg.begin() + static_cast<std::ptrdiff_t>(own), 0.0) /
        std::accumulate(before.begin(), before.end(), 0.0);
    std::vector<Cell> copies;
    for (std::uint32_t cell = 0; cell < cells.size(); ++cell) {
      const std::vector<double> share = shares(cut, cell, sheets);
      for (std::size_t part = 0; part < share.size(); ++part) {
        const std::uint32_t k = cut.first_copy[cell] + static_cast<std::uint32_t>(part);
        if (kept[k] == 0) continue;
        Cell& copy = copies.emplace_back(cells[cell]);
        copy.share = share[part];
        std::copy_n(cut.copies[k].nodes.begin(), kind.corners, copy.nodes.begin());
      }
    }
    cells = std::move(copies);
    body.fixed = fixed_nodes(cut, body.fixed);
    return renumber(cut.origin, own, std::move(surface), density_kg_m3);
  }

  /// Numbers the nodes that are left: the body's own, new ones, ends of ligaments.
  std::vector<std::uint32_t> renumber(const std::vector<std::uint32_t>& origin, std::size_t own, CutSurface surface,
                                      double density_kg_m3) {
    const std::size_t before = body.nodes.size();
    std::vector<std::uint8_t> used(origin.size(), 0);
    for (const Cell& cell : cells)
      for (const std::uint32_t node : cell.nodes) used[node] = 1;
    for (std::size_t i = own; i < before; ++i) used[i] = 1;
    std::vector<std::uint32_t> number(origin.size(), kNoNode), order;
    const auto take = [&](std::size_t from, std::size_t to) {
      for (std::size_t i = from; i < to; ++i)
        if (used[i] != 0) {
          number[i] = static_cast<std::uint32_t>(order.size());
          order.push_back(static_cast<std::uint32_t>(i));
        }
    };
    take(0, own);
    take(before, origin.size());
    const std::size_t own_now = order.size();
    take(own, before);

    for (Cell& cell : cells)
      for (std::uint32_t& node : cell.nodes) node = number[node];
    for (Element& e : body.elements) {
      e.a = number[e.a];
      e.b = number[e.b];
    }
    const std::vector<Vec3> x = std::move(body.nodes);
    const std::vector<std::uint8_t> fixed = std::move(body.fixed);
    const std::vector<double> masses = std::move(body.masses_kg);
    body.nodes.clear();
    body.fixed.clear();
    for (const std::uint32_t i : order) {
      body.nodes.push_back(x[origin[i]]);
      body.fixed.push_back(fixed[i]);
    }
    body.masses_kg = lumped_masses(cells, std::span(body.nodes).first(own_now), density_kg_m3);
    for (std::size_t k = own_now; k < order.size(); ++k) body.masses_kg.push_back(masses[order[k]]);

    for (EmbeddedVertex& vertex : surface.embedded)
      for (auto& [node, weight] : vertex.weights) node = number[node];
    const auto shift = static_cast<std::uint32_t>(origin.size() - body.nodes.size());
    for (Triangle& t : surface.triangles)
      for (std::uint32_t& v : t) v = v < origin.size() ? number[v] : v - shift;
    body.triangles = std::move(surface.triangles);
    body.embedded = std::move(surface.embedded);
    number.resize(before);
    return number;
  }
};

}  // namespace

std::vector<std::uint32_t> cut_body(LumpedBody& body, const std::vector<CutSettings>& cuts, const SceneText& text) {
  std::vector<Sheet> all;
  CutLinks links;
  const auto with = [&](const auto& f) {
    if (!body.hexahedra.empty()) return f(Cutter<Hexahedron>{body, body.hexahedra});
    return f(Cutter<Tetrahedron>{body, body.tetrahedra});
  };
  for (std::size_t i = 0; i < cuts.size(); ++i) {
    const std::vector<Sheet> sheets = sheets_of(cuts[i]);
    const std::string path = "body.cuts[" + std::to_string(i) + "]";
    if (with([&](const auto& cutter) { return cutter.add_links(sheets, links); }) == 0)
      text.refuse(path, path + " crosses no edge of the body's cells", "a path through the body, or a finer body");
    all.insert(all.end(), sheets.begin(), sheets.end());
  }
  return with([&](auto cutter) { return cutter.apply(std::move(links), all); });
}

}  // namespace palpate
