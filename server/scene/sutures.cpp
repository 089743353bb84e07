#include "server/scene/sutures.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "common/patch/surface.hpp"
#include "server/scene/grid.hpp"
#include "server/scene/scene_text.hpp"

namespace palpate {
namespace {

constexpr double kBeyond = 1e-6;  // of a cell: a bite on its face is in it

/// A point of a cell at rest: weights of its nodes, and their gradients in the body at rest [1/m].
struct PointOfCell {
  std::vector<double> weight;
  std::vector<Vec3> slope;
  bool empty() const { return weight.empty(); }
};

/// Returns x in a hexahedron, trilinear, by Newton's method; empty outside.
PointOfCell point_in(const LumpedBody& body, const Hexahedron& cell, const Vec3& x) {
  Eigen::AlignedBox3d box;
  for (const std::uint32_t node : cell.nodes) box.extend(body.nodes[node]);
  if (box.exteriorDistance(x) > kBeyond * box.diagonal().norm()) return {};
  constexpr int kIterations = 30;
  Vec3 xi = Vec3::Constant(0.5);
  std::vector<double> w(8);
  std::vector<Vec3> rates(8);
  Mat3 slope;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    Vec3 at = Vec3::Zero();
    slope.setZero();
    for (std::size_t a = 0; a < 8; ++a) {
      Vec3 of, rate;
      for (int axis = 0; axis < 3; ++axis) {
        const bool high = ((a >> axis) & 1U) != 0;
        of[axis] = high ? xi[axis] : 1 - xi[axis];
        rate[axis] = high ? 1 : -1;
      }
      w[a] = of.prod();
      rates[a] = Vec3(rate[0] * of[1] * of[2], of[0] * rate[1] * of[2], of[0] * of[1] * rate[2]);
      at += w[a] * body.nodes[cell.nodes[a]];
      slope += body.nodes[cell.nodes[a]] * rates[a].transpose();
    }
    xi += slope.partialPivLu().solve(x - at);
    if (!xi.allFinite()) return {};
  }
  if (!(xi.minCoeff() >= -kBeyond && xi.maxCoeff() <= 1 + kBeyond)) return {};
  const Mat3 inverse = slope.inverse();
  for (Vec3& rate : rates) rate = inverse.transpose() * rate;
  return {w, rates};
}

PointOfCell point_in(const LumpedBody& body, const Tetrahedron& cell, const Vec3& x) {
  if (cell.is_triangle()) return {};
  Mat3 edges;
  const Vec3& origin = body.nodes[cell.nodes[0]];
  for (std::size_t a = 1; a < 4; ++a) edges.col(static_cast<Eigen::Index>(a - 1)) = body.nodes[cell.nodes[a]] - origin;
  const Mat3 inverse = edges.inverse();
  const Vec3 w = inverse * (x - origin);
  if (!w.allFinite() || w.minCoeff() < -kBeyond || w.sum() > 1 + kBeyond) return {};
  return {{1 - w.sum(), w[0], w[1], w[2]},
          {-inverse.colwise().sum().transpose(), inverse.row(0), inverse.row(1), inverse.row(2)}};
}

template <class Cell>
NodeWeights weights_at(const Cell& cell, const PointOfCell& point) {
  NodeWeights at;
  for (std::size_t a = 0; a < point.weight.size(); ++a) at.emplace_back(cell.nodes[a], point.weight[a]);
  return merged(std::move(at));
}

/// Returns the bite at x; one without weights if no cell has it.
template <class Cell>
SutureBite bite_in(const LumpedBody& body, const std::vector<Cell>& cells, const Vec3& x) {
  SutureBite best;
  std::uint32_t first = kNoNode;
  for (std::uint32_t k = 0; k < cells.size(); ++k) {
    const PointOfCell point = point_in(body, cells[k], x);
    if (point.empty()) continue;
    // Nodes of a copy that are not its own come after all others: the copy on this side has the lowest number at the nearest
    // corner.
    const std::vector<double>& w = point.weight;
    const std::size_t nearest = static_cast<std::size_t>(std::max_element(w.begin(), w.end()) - w.begin());
    if (cells[k].nodes[nearest] >= first) continue;
    first = cells[k].nodes[nearest];
    best = {weights_at(cells[k], point), x, k, 0};
  }
  return best;
}

/// Returns true if the way crosses the surface of the body at rest, or the wall of a cut.
bool leaves(const LumpedBody& body, const Vec3& from, const Vec3& to) {
  const std::vector<Vec3> rest = vertices_at_rest(body);
  return std::ranges::any_of(
      body.triangles, [&](const Triangle& t) { return way_out(from, to, rest[t[0]], rest[t[1]], rest[t[2]]).has_value(); });
}

template <class Cell>
std::size_t shared_nodes(const Cell& a, const Cell& b) {
  return static_cast<std::size_t>(
      std::ranges::count_if(a.nodes, [&](std::uint32_t node) { return std::ranges::count(b.nodes, node) > 0; }));
}

/// Returns the bite at x in its cell, or that which has most of its nodes: copies beyond a cut have none.
template <class Cell>
std::optional<SutureBite> next_bite(const LumpedBody& body, const std::vector<Cell>& cells, const SutureBite& from,
                                    const Vec3& x) {
  std::optional<SutureBite> best;
  std::size_t most = 0;
  for (std::uint32_t k = 0; k < cells.size(); ++k) {
    const std::size_t shared = shared_nodes(cells[from.cell], cells[k]);
    if (shared <= most) continue;
    const PointOfCell point = point_in(body, cells[k], x);
    if (point.empty()) continue;
    most = shared;
    best = {weights_at(cells[k], point), x, k, from.number};
  }
  return best;
}

template <class Cell>
std::optional<SutureBite> moved_in(const LumpedBody& body, const std::vector<Cell>& cells, std::span<const double> x,
                                   const SutureBite& bite, const Vec3& way) {
  const Vec3& from = bite.rest;
  const Cell& cell = cells[bite.cell];
  const PointOfCell here = point_in(body, cell, from);
  if (here.empty()) return std::nullopt;
  Mat3 gradient = Mat3::Zero();
  Eigen::AlignedBox3d box;
  for (std::size_t a = 0; a < here.weight.size(); ++a) {
    const Eigen::Map<const Vec3> at(&x[3 * std::size_t{cell.nodes[a]}]);
    gradient += at * here.slope[a].transpose();
    box.extend(body.nodes[cell.nodes[a]]);
  }
  Vec3 step = gradient.partialPivLu().solve(way);
  if (!step.allFinite()) return bite;
  constexpr double kOfCell = 0.25;  // so that the next cell is a neighbour
  step /= std::max(1.0, step.norm() / (kOfCell * box.diagonal().norm()));
  if (leaves(body, from, from + step)) return std::nullopt;
  return next_bite(body, cells, bite, from + step);
}

}  // namespace

std::optional<SutureBite> moved(const LumpedBody& body, std::span<const double> x, const SutureBite& bite, const Vec3& way) {
  return body.hexahedra.empty() ? moved_in(body, body.tetrahedra, x, bite, way) : moved_in(body, body.hexahedra, x, bite, way);
}

std::optional<SutureBite> bite_at(const LumpedBody& body, const Vec3& x) {
  SutureBite bite = body.hexahedra.empty() ? bite_in(body, body.tetrahedra, x) : bite_in(body, body.hexahedra, x);
  return bite.at.empty() ? std::nullopt : std::optional(std::move(bite));
}

bool can_move(const LumpedBody& body, const SutureBite& bite) {
  return std::ranges::any_of(bite.at, [&](const auto& at) { return body.fixed[at.first] == 0; });
}

std::optional<SutureBite> bite_at(const LumpedBody& body, std::uint32_t cell, const Vec3& x) {
  const auto in = [&](const auto& cells) -> std::optional<SutureBite> {
    if (cell >= cells.size()) return std::nullopt;
    const PointOfCell point = point_in(body, cells[cell], x);
    return point.empty() ? std::nullopt : std::optional(SutureBite{weights_at(cells[cell], point), x, cell, 0});
  };
  return body.hexahedra.empty() ? in(body.tetrahedra) : in(body.hexahedra);
}

void add_sutures(LumpedBody& body, const std::vector<SutureSettings>& sutures, const SceneText& text) {
  for (std::size_t s = 0; s < sutures.size(); ++s) {
    const SutureSettings& in = sutures[s];
    Suture suture{in.name, in.radius_m, {}, {}, {}, in.first_tail_m, in.slack_m};
    const double tear_n = body.tissue.empty() ? 0 : body.tissue.front().toughness_j_m2 * 2 * in.radius_m;
    suture.law = {static_cast<int>(in.bites_m.size()),
                  in.stiffness_n_m,
                  in.friction,
                  in.drag_n,
                  in.first_tied,
                  in.last_tied,
                  in.barbed,
                  tear_n};
    for (std::size_t j = 0; j < in.bites_m.size(); ++j) {
      const Vec3& x = in.bites_m[j];
      std::optional<SutureBite> bite = bite_at(body, x);
      const std::string path = fmt::format("body.sutures[{}].bites[{}].at_m", s, j);
      if (!bite)
        text.refuse(path, fmt::format("{} = [{:.4g}, {:.4g}, {:.4g}] is outside the body", path, x.x(), x.y(), x.z()),
                    "a point in a cell of it");
      if (!can_move(body, *bite)) text.refuse(path, path + " is where the body is fixed", "a point that can move");
      bite->number = static_cast<std::uint32_t>(j);
      suture.bites.push_back(std::move(*bite));
    }
    if (in.bites_m.empty()) {
      suture.length_m[0] = in.first_tail_m + in.tail_m;
      body.sutures.push_back(std::move(suture));
      continue;
    }
    suture.length_m[0] = in.first_tail_m;
    for (std::size_t i = 1; i < in.bites_m.size(); ++i)
      suture.length_m[i] = (in.bites_m[i] - in.bites_m[i - 1]).norm() + in.slack_m;
    suture.length_m[in.bites_m.size()] = in.tail_m;
    body.sutures.push_back(std::move(suture));
  }
}

}  // namespace palpate
