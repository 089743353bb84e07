#include "server/scene/cauchy_lattice.hpp"

#include <algorithm>
#include <cassert>
#include <map>

namespace palpate {
namespace {

/// Least stiffness of an edge, in mu V / a^2, so that no edge goes slack.
constexpr double kLeastEdge = 0.2;

std::optional<CellSprings> of_sheet(const Vec3& cell) {
  constexpr double kMu = 3.0 / 8;
  const double a2 = cell.x() * cell.x(), b2 = cell.y() * cell.y(), mu_v = kMu * cell.prod();
  CellSprings springs;
  springs.edge = Vec3(mu_v / a2 * (3 - a2 / b2), mu_v / b2 * (3 - b2 / a2), 0);
  springs.face.z() = mu_v * (a2 + b2) / (2 * a2 * b2);
  if (springs.edge.x() * a2 < kLeastEdge * mu_v || springs.edge.y() * b2 < kLeastEdge * mu_v) return std::nullopt;
  return springs;
}

std::optional<CellSprings> of_box(const Vec3& cell) {
  constexpr double kMu = 2.0 / 5;
  const Vec3 a2 = cell.cwiseAbs2();
  const double mu_v = kMu * cell.prod(), l2 = a2.sum();
  // theta = 4 k_abc / (mu V) / L^2, limited so that the widest face keeps a spring.
  double theta = 0;
  const auto others = [](int i) { return std::array{(i + 1) % 3, (i + 2) % 3}; };
  for (int i = 0; i < 3; ++i) {
    const auto [p, q] = others(i);
    theta = std::max(theta, (kLeastEdge - 3 + a2[i] / a2[p] + a2[i] / a2[q]) / (a2[i] * a2[i]));
  }
  CellSprings springs;
  springs.body = theta * mu_v * l2 / 4;
  for (int i = 0; i < 3; ++i) {
    const auto [p, q] = others(i);
    springs.edge[i] = mu_v * ((3 - a2[i] / a2[p] - a2[i] / a2[q]) / a2[i] + theta * a2[i]);
    const double share = 1 - theta * a2[p] * a2[q];
    if (share < 0) return std::nullopt;
    springs.face[i] = mu_v * share * (a2[p] + a2[q]) / (2 * a2[p] * a2[q]);
  }
  return springs;
}

/// A spring between two corners of a cell, given by the bits of their numbers, and the number of cells that share it inside a
/// body.
struct Link {
  unsigned from, to;
  int shared_by;
};

/// All links of a cell. A sheet lacks the corners with the third bit.
std::vector<Link> links_of_cell(bool planar) {
  std::vector<Link> links;
  const unsigned corners = planar ? 4 : 8;
  for (unsigned from = 0; from < corners; ++from)
    for (unsigned to = from + 1; to < corners; ++to) {
      const int axes = __builtin_popcount(from ^ to);
      links.push_back({from, to, planar ? 3 - axes : axes == 1 ? 4 : axes == 2 ? 2 : 1});
    }
  return links;
}

double stiffness_of(const CellSprings& springs, unsigned axes) {
  switch (axes) {
    case 1:
      return springs.edge.x();
    case 2:
      return springs.edge.y();
    case 4:
      return springs.edge.z();
    case 6:
      return springs.face.x();
    case 5:
      return springs.face.y();
    case 3:
      return springs.face.z();
    default:
      return springs.body;
  }
}

}  // namespace

std::optional<CellSprings> cauchy_springs(const Vec3& cell, bool planar) {
  assert(cell.minCoeff() > 0);
  return planar ? of_sheet(cell) : of_box(cell);
}

std::vector<Element> springs_of_cells(const CellSet& cells, const Grid& grid, std::span<const std::uint32_t> number,
                                      std::span<const Vec3> nodes, const CellSprings& springs,
                                      std::span<const CauchyMaterial> materials) {
  assert(materials.size() == cells.count());
  std::map<std::pair<std::uint32_t, std::uint32_t>, Element> joined;
  const std::vector<Link> links = links_of_cell(grid.nodes[2] == 1);
  auto material = materials.begin();
  cells.each([&](const Index3& c) {
    if (!cells.has(c)) return;
    const auto corner = [&](unsigned i) {
      return number[grid.index(c +
                               Index3{static_cast<int>(i & 1U), static_cast<int>(i >> 1 & 1U), static_cast<int>(i >> 2 & 1U)})];
    };
    for (const Link& link : links) {
      const double stiffness = stiffness_of(springs, link.from ^ link.to) * material->young_pa / link.shared_by;
      if (stiffness == 0) continue;
      const std::uint32_t a = std::min(corner(link.from), corner(link.to)), b = std::max(corner(link.from), corner(link.to));
      Element& element = joined.try_emplace({a, b}, Element{a, b, (nodes[b] - nodes[a]).norm(), 0, 0}).first->second;
      element.stiffness_n_m += stiffness;
      element.damping_n_s_m += material->damping_s * stiffness;
    }
    ++material;
  });
  std::vector<Element> elements;
  elements.reserve(joined.size());
  for (const auto& [pair, element] : joined) elements.push_back(element);
  return elements;
}

}  // namespace palpate
