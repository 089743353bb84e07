#include "server/scene/cuts.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <span>
#include <utility>

#include "server/scene/cell_points.hpp"
#include "server/scene/cut_walls.hpp"
#include "server/scene/grid.hpp"
#include "server/scene/hexa_mesh.hpp"
#include "server/scene/scene_text.hpp"
#include "server/scene/tetra_mesh.hpp"

namespace palpate {
namespace {

constexpr double kOnSheet = 0.02;          // share of a link's length
constexpr double kLeastShare = 1.0 / 128;  // of a cell's volume, for a copy that has none of its points

std::vector<CutSheet> sheets_of(const CutSettings& cut) {
  std::vector<CutSheet> sheets;
  for (std::size_t i = 0; i + 1 < cut.path_m.size(); ++i)
    sheets.emplace_back(cut.path_m[i], cut.path_m[i + 1], cut.depth_m * cut.direction);
  return sheets;
}

std::optional<double> crossing(const std::vector<CutSheet>& sheets, const Vec3& a, const Vec3& b) {
  for (const CutSheet& sheet : sheets)
    if (const auto t = sheet.crossing(a, b)) return t;
  return std::nullopt;
}

/// Adds the sheets whose boxes meet that of the cell.
void add_near(const std::vector<CutSheet>& sheets, const Eigen::AlignedBox3d& box, std::vector<CutSheet>& to) {
  const double slack = kOnSheet * box.diagonal().norm();
  for (const CutSheet& sheet : sheets)
    if (sheet.box.exteriorDistance(box) <= slack) to.push_back(sheet);
}

template <class Body>
auto& cells_of(Body& body, const Hexahedron*) {
  return body.hexahedra;
}
template <class Body>
auto& cells_of(Body& body, const Tetrahedron*) {
  return body.tetrahedra;
}

}  // namespace

CutSheet::CutSheet(const Vec3& from, const Vec3& to, const Vec3& edge)
    : corner(from), along(to - from), down(edge), normal(along.cross(down).normalized()) {
  Mat3 axes;
  axes << along, down, normal;
  place = axes.inverse();
  for (const Vec3& x : {from, to, Vec3(from + edge), Vec3(to + edge)}) box.extend(x);
}

std::optional<double> CutSheet::crossing(const Vec3& a, const Vec3& b) const {
  constexpr double kSeam = 1e-6;  // sheets overlap by this share, so that nothing passes between two
  const double slack = kOnSheet * (b - a).norm();
  const auto height = [&](const Vec3& x) {
    const double h = normal.dot(x - corner);
    return std::abs(h) < slack ? slack : h;
  };
  const double from = height(a), to = height(b);
  if (from * to > 0) return std::nullopt;
  const double t = from / (from - to);
  const Vec3 at = place * (a + t * (b - a) - corner);
  const auto within = [](double r) { return r >= -kSeam && r <= 1 + kSeam; };
  return within(at[0]) && within(at[1]) ? std::optional(t) : std::nullopt;
}

CutChange both(const CutChange& first, const CutChange& second) {
  CutChange all{second.node_before, second.cell_before, first.loose + second.loose};
  for (std::uint32_t& node : all.node_before) node = first.node_before[node];
  for (std::uint32_t& cell : all.cell_before) cell = first.cell_before[cell];
  return all;
}

std::vector<std::uint32_t> nodes_now(const CutChange& change, std::size_t before) {
  std::vector<std::uint32_t> now(before, kNoNode);
  for (std::uint32_t k = static_cast<std::uint32_t>(change.node_before.size()); k-- > 0;) now[change.node_before[k]] = k;
  return now;
}

template <class Cell>
struct Cutter {
  CutBody& of;
  static const Cell* type() { return nullptr; }
  const std::vector<Cell>& uncut() const { return cells_of(std::as_const(of.uncut_), type()); }
  const CellTopology& kind() const { return *of.cut_.kind; }

  std::vector<CutSheet> near(std::span<const std::vector<CutSheet>> cuts, const Cell& cell) const {
    Eigen::AlignedBox3d box;
    for (const std::uint32_t node : cell.nodes) box.extend(of.uncut_.nodes[node]);
    std::vector<CutSheet> found;
    for (const std::vector<CutSheet>& sheets : cuts) add_near(sheets, box, found);
    return found;
  }

  void begin() {
    std::vector<CellNodes> nodes;
    for (const Cell& cell : uncut()) std::copy(cell.nodes.begin(), cell.nodes.end(), nodes.emplace_back().begin());
    of.cut_ = uncut_cells(kind_of(type()), std::move(nodes), of.uncut_.nodes.size());
    const std::size_t own = own_nodes(of.uncut_);
    const std::vector<double> volumes = lumped_masses(uncut(), of.uncut_.nodes, 1);
    of.density_kg_m3_ =
        std::accumulate(of.uncut_.masses_kg.begin(), of.uncut_.masses_kg.begin() + static_cast<std::ptrdiff_t>(own), 0.0) /
        std::accumulate(volumes.begin(), volumes.end(), 0.0);
    for (std::uint32_t cell = 0; cell < uncut().size(); ++cell)
      of.parts_.push_back({cell, static_cast<std::uint8_t>((1U << kind().corners) - 1)});
    of.number_.resize(of.uncut_.nodes.size());
    std::iota(of.number_.begin(), of.number_.end(), 0U);
  }

  /// Adds the links that the sheets of a cut cross; returns their number.
  std::size_t add_links(std::size_t k) {
    std::size_t added = 0;
    for (const Cell& cell : uncut()) {
      const std::vector<CutSheet> close = near(std::span(of.sheets_).subspan(k, 1), cell);
      if (close.empty()) continue;
      for (const auto& [a, b] : kind().links) {
        const CellLink link = link_of(cell.nodes[a], cell.nodes[b]);
        if (of.cut_.links.contains(link)) continue;
        const auto t = crossing(close, of.uncut_.nodes[link.first], of.uncut_.nodes[link.second]);
        if (t) of.cut_.cut(link, *t);
        added += t.has_value();
      }
    }
    return added;
  }

  /// Returns the share of each part of a cell.
  std::vector<double> shares(std::uint32_t cell) const {
    const std::vector<Vec3>& x = of.uncut_.nodes;
    const std::size_t parts = of.cut_.first_copy[cell + 1] - of.cut_.first_copy[cell];
    if (parts == 1) return {1.0};
    const std::vector<CutSheet> close = near(of.sheets_, uncut()[cell]);
    std::vector<double> shares(parts, 0.0);
    for (const Vec3& point : points_in(uncut()[cell], x)) {
      std::vector<std::pair<double, std::size_t>> corners;
      for (std::size_t c = 0; c < kind().corners; ++c) corners.emplace_back((x[uncut()[cell].nodes[c]] - point).norm(), c);
      std::sort(corners.begin(), corners.end());
      const auto joined = std::find_if(corners.begin(), corners.end(), [&](const auto& corner) {
        return !crossing(close, x[uncut()[cell].nodes[corner.second]], point);
      });
      ++shares[of.cut_.part[cell][(joined == corners.end() ? corners.front() : *joined).second]];
    }
    const double points = std::accumulate(shares.begin(), shares.end(), 0.0);
    for (double& share : shares) share = std::max(share / points, kLeastShare);
    const double sum = std::accumulate(shares.begin(), shares.end(), 0.0);
    for (double& share : shares) share /= sum;
    return shares;
  }

  /// Corners of each part of a cell, a bit for each.
  std::vector<std::uint8_t> corners_of(std::uint32_t cell) const {
    std::vector<std::uint8_t> own(of.cut_.first_copy[cell + 1] - of.cut_.first_copy[cell], 0);
    for (std::size_t c = 0; c < kind().corners; ++c) own[of.cut_.part[cell][c]] |= static_cast<std::uint8_t>(1U << c);
    return own;
  }

  /// Returns the share of a part that was, of those that it is now: 1 of a whole cell.
  double share_of(std::uint8_t was, const std::vector<std::uint8_t>& own, const std::vector<double>& share) const {
    if (was == static_cast<std::uint8_t>((1U << kind().corners) - 1)) return 1;
    double together = 0;
    for (std::size_t k = 0; k < own.size(); ++k)
      if ((was & own[k]) != 0) together += share[k];
    return together;
  }

  CutChange part() {
    copy_cells(of.cut_);
    std::vector<std::uint8_t> kept = held_copies(of.cut_, of.uncut_.fixed, of.uncut_.elements);
    if (std::ranges::none_of(kept, [](std::uint8_t is_kept) { return is_kept != 0; }))
      std::fill(kept.begin(), kept.end(), 1);  // of a body that nothing holds all stays
    CutChange change;
    const std::vector<Cell> before = cells_of(of.body_, type());
    const std::vector<CutBody::Part> parts_before = std::exchange(of.parts_, {});
    std::vector<Cell> cells;
    std::size_t first = 0;  // of the parts of a cell before
    for (std::uint32_t cell = 0; cell < uncut().size(); ++cell) {
      while (first < parts_before.size() && parts_before[first].cell < cell) ++first;
      const auto part_with = [&](std::uint8_t corners) {
        std::size_t from = first;
        while (from < parts_before.size() && parts_before[from].cell == cell && (parts_before[from].own & corners) != corners)
          ++from;
        return from < parts_before.size() && parts_before[from].cell == cell ? std::optional(from) : std::nullopt;
      };
      const std::vector<std::uint8_t> own = corners_of(cell);
      std::vector<double> share;
      for (std::size_t k = 0; k < own.size(); ++k) {
        const std::uint32_t copy = of.cut_.first_copy[cell] + static_cast<std::uint32_t>(k);
        const std::optional<std::size_t> from = part_with(own[k]);
        if (!from) continue;  // it was left out before
        change.loose += kept[copy] == 0;
        if (kept[copy] == 0) continue;
        Cell& made = cells.emplace_back(before[*from]);
        const std::uint8_t whole = parts_before[*from].own;
        if (whole != own[k]) {
          if (share.empty()) share = shares(cell);
          made.share *= share[k] / share_of(whole, own, share);
        }
        std::copy_n(of.cut_.copies[copy].nodes.begin(), kind().corners, made.nodes.begin());
        of.parts_.push_back({cell, own[k]});
        change.cell_before.push_back(static_cast<std::uint32_t>(*from));
      }
    }
    CutSurface surface = cut_surface(of.cut_, of.uncut_.nodes, of.uncut_.triangles, kept);
    const std::vector<std::uint32_t> number_before = of.number_;
    renumber(std::move(cells), std::move(surface));
    change.node_before.resize(of.body_.nodes.size());
    for (std::size_t i = 0; i < of.number_.size(); ++i)
      if (of.number_[i] != kNoNode) change.node_before[of.number_[i]] = number_before[i];
    const std::vector<Cell>& now = cells_of(of.body_, type());
    for (std::size_t k = 0; k < now.size(); ++k)
      for (std::size_t c = 0; c < kind().corners; ++c)
        change.node_before[now[k].nodes[c]] = before[change.cell_before[k]].nodes[c];
    return change;
  }

  /// Makes `of.body_` of these cells and this surface, with the nodes that are left: its own, new ones, ends of ligaments.
  void renumber(std::vector<Cell> cells, CutSurface surface) {
    const std::vector<std::uint32_t>& origin = of.cut_.origin;
    const LumpedBody& uncut = of.uncut_;
    const std::size_t before = uncut.nodes.size(), own = own_nodes(uncut);
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

    LumpedBody& body = of.body_;
    for (Cell& cell : cells)
      for (std::uint32_t& node : cell.nodes) node = number[node];
    body.elements = uncut.elements;
    for (Element& e : body.elements) {
      e.a = number[e.a];
      e.b = number[e.b];
    }
    const std::vector<std::uint8_t> fixed = fixed_nodes(of.cut_, uncut.fixed);
    body.nodes.clear();
    body.fixed.clear();
    for (const std::uint32_t i : order) {
      body.nodes.push_back(uncut.nodes[origin[i]]);
      body.fixed.push_back(fixed[i]);
    }
    body.masses_kg = lumped_masses(cells, std::span(body.nodes).first(own_now), of.density_kg_m3_);
    for (std::size_t k = own_now; k < order.size(); ++k) body.masses_kg.push_back(uncut.masses_kg[order[k]]);
    cells_of(body, type()) = std::move(cells);

    for (EmbeddedVertex& vertex : surface.embedded)
      for (auto& [node, weight] : vertex.weights) node = number[node];
    const auto shift = static_cast<std::uint32_t>(origin.size() - body.nodes.size());
    for (Triangle& t : surface.triangles)
      for (std::uint32_t& v : t) v = v < origin.size() ? number[v] : v - shift;
    body.triangles = std::move(surface.triangles);
    body.embedded = std::move(surface.embedded);
    number.resize(before);
    of.number_ = std::move(number);
  }
};

namespace {

/// Calls f with the cutter of the body's cells.
template <class F>
auto with_cutter(CutBody& body, const F& f) {
  if (!body.uncut().hexahedra.empty()) return f(Cutter<Hexahedron>{body});
  return f(Cutter<Tetrahedron>{body});
}

}  // namespace

CutBody::CutBody(LumpedBody uncut) : uncut_(std::move(uncut)), body_(uncut_) {
  with_cutter(*this, [](auto cutter) { cutter.begin(); });
}

std::size_t CutBody::set(std::size_t k, const CutSettings& cut) {
  assert(k <= sheets_.size());
  if (k == sheets_.size()) {
    cuts_.emplace_back();
    sheets_.emplace_back();
  }
  cuts_[k] = cut;
  sheets_[k] = sheets_of(cut);
  return with_cutter(*this, [&](auto cutter) { return cutter.add_links(k); });
}

CutChange CutBody::part() {
  return with_cutter(*this, [](auto cutter) { return cutter.part(); });
}

CutChange CutBody::repeat(const std::vector<CutStep>& steps) {
  CutChange all;
  const auto follow = [](std::vector<std::uint32_t>& now, const std::vector<std::uint32_t>& before) {
    std::vector<std::uint32_t> first;
    for (const std::uint32_t k : before) first.push_back(now[k]);
    now = std::move(first);
  };
  all.node_before.resize(body_.nodes.size());
  std::iota(all.node_before.begin(), all.node_before.end(), 0U);
  all.cell_before.resize(parts_.size());
  std::iota(all.cell_before.begin(), all.cell_before.end(), 0U);
  for (const CutStep& step : steps) {
    set(step.cut, step.to);
    if (!step.parts) continue;
    const CutChange change = part();
    follow(all.node_before, change.node_before);
    follow(all.cell_before, change.cell_before);
    all.loose += change.loose;
  }
  return all;
}

CutBody begun_cuts(const Scene& scene) { return scene.tearing ? *scene.tearing : CutBody(scene.body); }

CutBody cut_body(LumpedBody body, const std::vector<CutSettings>& cuts, const SceneText& text) {
  CutBody cut(std::move(body));
  for (std::size_t i = 0; i < cuts.size(); ++i) {
    const std::string path = "body.cuts[" + std::to_string(i) + "]";
    if (cut.set(i, cuts[i]) == 0)
      text.refuse(path, path + " crosses no edge of the body's cells", "a path through the body, or a finer body");
  }
  if (const CutChange change = cut.part(); change.loose > 0)
    std::fprintf(stderr, "cuts: %zu of %zu cells hang on nothing that is held; they are left out\n", change.loose,
                 change.loose + change.cell_before.size());
  return cut;
}

}  // namespace palpate
