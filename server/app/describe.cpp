#include "server/app/describe.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "common/base/counted.hpp"
#include "server/body/locking.hpp"
#include "server/body/surface_stiffness.hpp"
#include "server/body/touch_places.hpp"
#include "server/io/frame_cost.hpp"
#include "server/room/room.hpp"

namespace palpate {
namespace {

/// Returns true if fewer nodes are fixed than a third of one face of a cube with this number of nodes: the body hangs by a
/// corner.
bool hangs_by_few(std::size_t held, std::size_t nodes) {
  return static_cast<double>(held) < std::pow(static_cast<double>(nodes), 2.0 / 3) / 3;
}

/// Suggests a setting that fixes the lowest tenth of the body.
std::string advice(const LumpedBody& body) {
  if (body.planar) return "\"fixed_faces\" in body.lattice fixes a side, for example [\"x-\"]";
  const auto [low, high] =
      std::minmax_element(body.nodes.begin(), body.nodes.end(), [](const Vec3& a, const Vec3& b) { return a.z() < b.z(); });
  return fmt::format("\"fixed_below_z_m\": {:.3f} next to \"density_kg_m3\" fixes the lowest tenth",
                     low->z() + 0.1 * (high->z() - low->z()));
}

/// Warning if linear tetrahedra lock by more than a twentieth.
std::optional<std::string> locking_line(const LumpedBody& body) {
  constexpr double kSaid = 0.05;
  const double locking = expected_locking(body);
  if (!(locking > kSaid)) return std::nullopt;
  return fmt::format(
      "element    linear tetrahedra: where it bends, the body is about {:.1f} times as stiff as its material; hexahedra "
      "(\"element\" in solid, docs/reference/scenes.md) are not",
      1 + locking);
}

std::string touch_line(const Scene& scene, const SurfaceStiffness& finger) {
  const Vec3 mm = 1e3 * finger.place;
  const std::string at = fmt::format("at ({:.0f}, {:.0f}, {:.0f}) mm", mm.x(), mm.y(), mm.z());
  const double n_mm = 1e-3 * finger.stiffness_n_m;
  if (scene.tool.contact == ContactKind::attach) return fmt::format("stiffness  {:.2f} N/mm where it is grasped, {}", n_mm, at);
  const double contact_n_mm = 1e-3 * scene.tool.contact_stiffness_n_m;
  std::string tool =
      scene.tool.radius_m > 0 ? fmt::format("finger of {:.0f} mm radius", 1e3 * scene.tool.radius_m) : "pointed tool";
  if (const auto& needle = scene.tool.needle)
    tool = fmt::format("{} of {:.2g} mm that has not punctured",
                       needle->stroke_m > 0 ? "pair of scissors"
                       : needle->is_blade   ? "blade"
                                            : "needle",
                       1e3 * needle->width_m);
  return fmt::format("stiffness  {:.2f} N/mm under a {} {}, of body ({:.2f}) and contact ({:.2f})",
                     n_mm * contact_n_mm / (n_mm + contact_n_mm), tool, at, n_mm, contact_n_mm);
}

std::string tools_line(const Scene& scene) {
  std::string line = scene.tool.name.empty() ? "one without a name" : scene.tool.name;
  for (const ToolSpec& tool : scene.tools) line += ", " + tool.name;
  return line + ": a hand that asks for none has the first, which these figures are of";
}

std::string cost_line(const FrameCost& cost, Scheme scheme, const std::vector<int>& stations, double frame_ms) {
  constexpr double kBusiest = 0.9;  // share of a frame; sessions need some of the rest
  std::string line = fmt::format("  {:<8}", name_of(scheme));
  int most = 0;
  for (const int n : stations) {
    line += fmt::format(" {:>8.1f} ms", cost.ms(scheme, n));
    if (cost.ms(scheme, n) <= kBusiest * frame_ms) most = n;
  }
  if (most == stations.back()) return line + "   keeps up";
  if (most == 0) return line + "   too slow: frames will be skipped";
  return line + fmt::format("   keeps up with {}", most);
}

/// Costs at several places, the least expensive first; empty if the cost of one of them is unknown.
std::vector<FrameCost> costs_of(const Scene& scene, const SurfaceStiffness& home, double rate_hz) {
  constexpr std::size_t kPlaces = 3;
  std::vector<SurfaceStiffness> places;
  if (scene.tool.contact == ContactKind::touch) places = finger_stiffnesses(scene, touch_places(scene.body, home.place, kPlaces));
  if (places.empty()) places.push_back(home);
  std::vector<FrameCost> costs;
  for (const SurfaceStiffness& place : places) {
    const std::optional<FrameCost> cost = frame_cost(scene, place, rate_hz);
    if (!cost) return {};
    costs.push_back(*cost);
  }
  std::sort(costs.begin(), costs.end(),
            [](const auto& a, const auto& b) { return a.ms(Scheme::hyper, 1) < b.ms(Scheme::hyper, 1); });
  return costs;
}

void add_costs(const Scene& scene, const std::vector<FrameCost>& costs, double rate_hz, std::vector<std::string>& lines) {
  if (costs.empty()) {
    lines.push_back("a frame    was not measured (palpate-lab stations measures it)");
    return;
  }
  const std::vector<int> stations = scene.tool.contact == ContactKind::attach ? std::vector{1} : std::vector{1, 2, 4};
  lines.push_back(fmt::format("a frame    lasts {:.0f} ms; at the most expensive place it takes about, with", 1e3 / rate_hz));
  std::string columns(10, ' ');
  for (const int n : stations) columns += fmt::format(" {:>11}", counted(static_cast<std::uint64_t>(n), "station"));
  lines.push_back(columns);
  for (const Scheme scheme : {Scheme::port, Scheme::hyper})
    lines.push_back(cost_line(costs.back(), scheme, stations, 1e3 / rate_hz));
}

}  // namespace

Description describe(const Scene& scene, double rate_hz) {
  const LumpedBody& body = scene.body;
  const auto held = static_cast<std::size_t>(std::count_if(body.fixed.begin(), body.fixed.end(), [](auto f) { return f != 0; }));
  const double mass_kg = std::accumulate(body.masses_kg.begin(), body.masses_kg.end(), 0.0);
  std::vector<std::string> lines{fmt::format("body       {:.3g} kg, {} of {} nodes fixed", mass_kg, held, body.nodes.size())};
  if (body.parts.empty() && hangs_by_few(held, body.nodes.size()))  // it may lie on a part
    lines.push_back(fmt::format(
        "warning: {}; {}",
        held == 0 ? "no node is fixed: a tool pushes the body away" : "too few nodes are fixed: the body swings under a tool",
        advice(body)));
  constexpr double kLeftOutSaid = 0.03;
  if (std::abs(body.left_out_share) > kLeftOutSaid)
    lines.push_back(fmt::format(
        "warning: the body has {:.3g} kg, what its surface encloses {:.3g} kg: {}", mass_kg, mass_kg / (1 - body.left_out_share),
        body.left_out_share > 0
            ? "cells that do not hang together with the rest are left out, or the spacing is too coarse for it"
            : "the spacing is too coarse for it"));
  if (const auto locking = locking_line(body)) lines.push_back(*locking);
  constexpr std::size_t kSolvedMost = 20'000;  // nodes of a body whose stiffness can be solved for within about a second
  const bool small = body.nodes.size() <= kSolvedMost;
  const std::optional<SurfaceStiffness> finger = small ? finger_stiffness(scene, home_of(scene)) : std::nullopt;
  if (!finger) return {lines, {}};
  lines.push_back(touch_line(scene, *finger));
  if (!scene.tools.empty()) lines.push_back("tools      " + tools_line(scene));
  const std::vector<FrameCost> costs = costs_of(scene, *finger, rate_hz);
  add_costs(scene, costs, rate_hz, lines);
  return {lines, costs.empty() ? std::nullopt : std::optional(costs.front())};
}

}  // namespace palpate
