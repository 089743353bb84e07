#include "server/scene/sutures.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "server/scene/grid.hpp"
#include "server/scene/scene_text.hpp"

namespace palpate {
namespace {

constexpr double kBeyond = 1e-6;  // of a cell: a bite on its face is in it

/// Returns the trilinear weights of `x` in a hexahedron at rest, by Newton's method; empty outside.
std::vector<double> weights_in(const LumpedBody& body, const Hexahedron& cell, const Vec3& x) {
  Eigen::AlignedBox3d box;
  for (const std::uint32_t node : cell.nodes) box.extend(body.nodes[node]);
  if (box.exteriorDistance(x) > kBeyond * box.diagonal().norm()) return {};
  constexpr int kIterations = 30;
  Vec3 xi = Vec3::Constant(0.5);
  std::vector<double> w(8);
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    Vec3 at = Vec3::Zero();
    Mat3 slope = Mat3::Zero();
    for (std::size_t a = 0; a < 8; ++a) {
      Vec3 of, rate;
      for (int axis = 0; axis < 3; ++axis) {
        const bool high = ((a >> axis) & 1U) != 0;
        of[axis] = high ? xi[axis] : 1 - xi[axis];
        rate[axis] = high ? 1 : -1;
      }
      w[a] = of.prod();
      const Vec3 gradient(rate[0] * of[1] * of[2], of[0] * rate[1] * of[2], of[0] * of[1] * rate[2]);
      at += w[a] * body.nodes[cell.nodes[a]];
      slope += body.nodes[cell.nodes[a]] * gradient.transpose();
    }
    xi += slope.partialPivLu().solve(x - at);
    if (!xi.allFinite()) return {};
  }
  const bool inside = xi.minCoeff() >= -kBeyond && xi.maxCoeff() <= 1 + kBeyond;
  return inside ? w : std::vector<double>();
}

std::vector<double> weights_in(const LumpedBody& body, const Tetrahedron& cell, const Vec3& x) {
  if (cell.is_triangle()) return {};
  Mat3 edges;
  const Vec3& origin = body.nodes[cell.nodes[0]];
  for (std::size_t a = 1; a < 4; ++a) edges.col(static_cast<Eigen::Index>(a - 1)) = body.nodes[cell.nodes[a]] - origin;
  const Vec3 w = edges.partialPivLu().solve(x - origin);
  if (!w.allFinite() || w.minCoeff() < -kBeyond || w.sum() > 1 + kBeyond) return {};
  return {1 - w.sum(), w[0], w[1], w[2]};
}

/// Returns the bite at x; empty if no cell has it.
template <class Cell>
NodeWeights bite_in(const LumpedBody& body, const std::vector<Cell>& cells, const Vec3& x) {
  NodeWeights best;
  std::uint32_t first = kNoNode;
  for (const Cell& cell : cells) {
    const std::vector<double> w = weights_in(body, cell, x);
    if (w.empty()) continue;
    // Nodes of a copy that are not its own come after all others: the copy on this side has the lowest number at the nearest
    // corner.
    const std::size_t nearest = static_cast<std::size_t>(std::max_element(w.begin(), w.end()) - w.begin());
    if (cell.nodes[nearest] >= first) continue;
    first = cell.nodes[nearest];
    best.clear();
    for (std::size_t a = 0; a < w.size(); ++a) best.emplace_back(cell.nodes[a], w[a]);
  }
  return best.empty() ? best : merged(std::move(best));
}

}  // namespace

void add_sutures(LumpedBody& body, const std::vector<SutureSettings>& sutures, const SceneText& text) {
  for (std::size_t s = 0; s < sutures.size(); ++s) {
    const SutureSettings& in = sutures[s];
    Suture suture{in.name, in.radius_m, {}, {}, {}};
    suture.law = {
        static_cast<int>(in.bites_m.size()), in.stiffness_n_m, in.friction, in.drag_n, in.first_tied, in.last_tied, in.barbed};
    for (std::size_t j = 0; j < in.bites_m.size(); ++j) {
      const Vec3& x = in.bites_m[j];
      NodeWeights bite = body.hexahedra.empty() ? bite_in(body, body.tetrahedra, x) : bite_in(body, body.hexahedra, x);
      const std::string path = fmt::format("body.sutures[{}].bites[{}].at_m", s, j);
      if (bite.empty())
        text.refuse(path, fmt::format("{} = [{:.4g}, {:.4g}, {:.4g}] is outside the body", path, x.x(), x.y(), x.z()),
                    "a point in a cell of it");
      if (std::ranges::all_of(bite, [&](const auto& at) { return body.fixed[at.first] != 0; }))
        text.refuse(path, path + " is where the body is fixed", "a point that can move");
      suture.bites.push_back(std::move(bite));
    }
    suture.length_m[0] = in.first_tail_m;
    for (std::size_t i = 1; i < in.bites_m.size(); ++i)
      suture.length_m[i] = (in.bites_m[i] - in.bites_m[i - 1]).norm() + in.slack_m;
    suture.length_m[in.bites_m.size()] = in.tail_m;
    body.sutures.push_back(std::move(suture));
  }
}

}  // namespace palpate
