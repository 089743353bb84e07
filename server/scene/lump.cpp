#include "server/scene/lump.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "common/patch/surface.hpp"
#include "server/scene/cell_points.hpp"

namespace palpate {
namespace {

constexpr int kLevels = 16;

int level_of(const std::vector<Vec3>& points, const LumpSettings& lump) {
  const auto inside =
      std::count_if(points.begin(), points.end(), [&](const Vec3& p) { return (p - lump.center_m).norm() <= lump.radius_m; });
  return static_cast<int>(std::lround(kLevels * static_cast<double>(inside) / static_cast<double>(points.size())));
}

/// Share of a spring's length in the ball.
double share_in(const Vec3& a, const Vec3& b, const LumpSettings& lump) {
  const Vec3 along = b - a, to_a = a - lump.center_m;
  const double aa = along.squaredNorm(), ab = along.dot(to_a), bb = to_a.squaredNorm() - lump.radius_m * lump.radius_m;
  const double root = ab * ab - aa * bb;
  if (root <= 0 || aa <= 0) return 0;
  const double half = std::sqrt(root);
  return std::max(0.0, std::min(1.0, (half - ab) / aa) - std::max(0.0, (-half - ab) / aa));
}

double factor_of(double share, const LumpSettings& lump) { return 1 + share * (lump.stiffness_ratio - 1); }

template <class Cells>
std::size_t change_cells(LumpedBody& body, Cells& cells, const LumpSettings& lump) {
  std::map<std::pair<std::uint32_t, int>, std::uint32_t> changed;  // (material, level) -> new material
  std::size_t count = 0;
  for (auto& cell : cells) {
    const int level = level_of(points_in(cell, body.nodes), lump);
    if (level == 0) continue;
    const auto [at, fresh] = changed.try_emplace({cell.material, level}, static_cast<std::uint32_t>(body.materials.size()));
    if (fresh) {
      SolidMaterial material = body.materials[cell.material];
      material.young_pa *= factor_of(static_cast<double>(level) / kLevels, lump);
      body.materials.push_back(material);
    }
    cell.material = at->second;
    ++count;
  }
  return count;
}

std::size_t change_springs(LumpedBody& body, const LumpSettings& lump) {
  std::size_t count = 0;
  for (Element& spring : body.elements) {
    const double share = share_in(body.nodes[spring.a], body.nodes[spring.b], lump);
    if (share <= 0) continue;
    spring.stiffness_n_m *= factor_of(share, lump);
    spring.damping_n_s_m *= factor_of(share, lump);
    ++count;
  }
  return count;
}

}  // namespace

void add_lump(LumpedBody& body, const LumpSettings& lump, const SceneText& text) {
  const Surface surface(body.triangles, body.nodes.size());
  const Positions x{body.nodes.front().data(), 3 * body.nodes.size()};
  if (surface.empty() || winding_number(surface.view(), x, lump.center_m) < 0.5) {
    const Vec3 near = surface.empty() ? body.nodes.front() : nearest_point(surface.view(), x, lump.center_m).position;
    text.refuse(
        "body.lump.center_m",
        fmt::format("body.lump.center_m [{:g}, {:g}, {:g}] is outside the body", lump.center_m.x(), lump.center_m.y(),
                    lump.center_m.z()),
        fmt::format("a point inside; the nearest of the surface is [{:.4f}, {:.4f}, {:.4f}]", near.x(), near.y(), near.z()));
  }
  const std::size_t changed =
      change_cells(body, body.hexahedra, lump) + change_cells(body, body.tetrahedra, lump) + change_springs(body, lump);
  if (changed == 0)
    text.refuse("body.lump.radius_m", fmt::format("body.lump.radius_m {:g} m is too small to change an element", lump.radius_m),
                fmt::format("at least about {:.4f} m here, or a finer body", 0.3 * mean_edge_m(body)));
}

}  // namespace palpate
