// palpate-lab couplings --part proxy: the god-object and the penalty method, through a thin wall and around an edge.
#include <fmt/format.h>

#include <cmath>
#include <iterator>
#include <limits>
#include <numbers>

#include "bench/lab/coupling_parts.hpp"
#include "bench/paper/god_object.hpp"

namespace palpate {
namespace {

constexpr double kPlateM = 0.002, kStepM = 2e-5;

struct ThinWall {
  std::string csv = "depth_mm,penalty_n,god_object_n\n";
  double popped_at_mm = -1;     ///< depth at which the penalty force reverses and pushes onwards; -1 never
  double god_object_least = 1;  ///< least force over k depth
};

/// Presses straight down through a plate. Force: upwards, back to where the tool came from.
ThinWall press_through(double wall_n_m) {
  ThinWall result;
  const RigidBody plate = box({-0.02, -0.02, -kPlateM}, {0.02, 0.02, 0});
  GodObject proxy(plate, {0.001, 0.002, 0.001});
  for (int k = 0; k <= 300; ++k) {
    const double depth = -0.001 + k * kStepM;
    const Vec3 tool(0.001, 0.002, -depth);
    proxy.follow(tool);
    const double penalty = penalty_force(plate, tool, wall_n_m).z(), god = proxy.force(tool, wall_n_m).z();
    if (penalty < 0 && result.popped_at_mm < 0) result.popped_at_mm = depth * 1e3;
    if (depth > 1e-4) result.god_object_least = std::min(result.god_object_least, god / (wall_n_m * depth));
    fmt::format_to(std::back_inserter(result.csv), "{:.4f},{:.6g},{:.6g}\n", depth * 1e3, penalty, god);
  }
  return result;
}

/// Angle of a force from straight up towards +x [deg]; NaN for no force.
double turned_deg(const Vec3& force) {
  if (force.norm() <= 0) return std::numeric_limits<double>::quiet_NaN();
  return std::atan2(force.x(), force.z()) * 180 / std::numbers::pi;
}

struct Edge {
  std::string csv =
      "beyond_edge_mm,penalty_deg,god_object_deg,penalty_n,god_object_n,tool_z_mm,proxy_x_mm,proxy_z_mm,nearest_x_mm,nearest_z_"
      "mm\n";
  double penalty_turn_deg = 0, god_object_turn_deg = 0;  ///< largest turn between samples, or in the first
};

/// Drags from 3 mm under the top of a block out through its side.
Edge drag_over_edge(double wall_n_m) {
  Edge result;
  const double depth = 0.003;
  const RigidBody block = box({-0.04, -0.02, -0.04}, {0, 0.02, 0});
  GodObject proxy(block, {-0.01, 0.001, 0.001});
  proxy.follow({-0.01, 0.001, -depth});
  double penalty_before = 0, god_before = 0;
  for (int k = 0; k <= 600; ++k) {
    const Vec3 tool(-0.01 + k * kStepM, 0.001, -depth);
    proxy.follow(tool);
    const Vec3 penalty = penalty_force(block, tool, wall_n_m), god = proxy.force(tool, wall_n_m);
    const double penalty_deg = turned_deg(penalty), god_deg = turned_deg(god);
    const Vec3 nearest = nearest_point(block.surface.view(), block.vertices, tool).position;
    if (!std::isnan(penalty_deg)) {
      result.penalty_turn_deg = std::max(result.penalty_turn_deg, std::abs(penalty_deg - penalty_before));
      penalty_before = penalty_deg;
    }
    if (!std::isnan(god_deg)) {
      result.god_object_turn_deg = std::max(result.god_object_turn_deg, std::abs(god_deg - god_before));
      god_before = god_deg;
    }
    fmt::format_to(std::back_inserter(result.csv), "{:.4f},{:.4f},{:.4f},{:.6g},{:.6g},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f}\n",
                   tool.x() * 1e3, penalty_deg, god_deg, penalty.norm(), god.norm(), tool.z() * 1e3, proxy.position().x() * 1e3,
                   proxy.position().z() * 1e3, nearest.x() * 1e3, nearest.z() * 1e3);
  }
  return result;
}

}  // namespace

CouplingPart show_proxy(const std::filesystem::path& out, const CouplingFlags& flags) {
  const ThinWall wall = press_through(flags.wall_n_m);
  const Edge edge = drag_over_edge(flags.wall_n_m);
  const auto wall_csv = out / "proxy_thin_wall.csv", edge_csv = out / "proxy_edge.csv";
  write_text(wall_csv, wall.csv);
  write_text(edge_csv, edge.csv);
  const std::vector<GridPanel> panels{
      {"A tool pressed through a plate of 2 mm",
       "depth of the tool [mm]",
       "force back out [N]",
       {{"1:2", "penalty", 5, wall_csv}, {"1:3", "god-object", 1, wall_csv}},
       "set arrow from 2, graph 0 to 2, graph 1 nohead lc rgb '#888888' dt 2\n"
       "set label 'far side of the plate' at 2.1, graph 0.05 textcolor rgb '#666666' font ',11'"},
      {"Dragged out of a block, 3 mm under its top",
       "tool beyond the edge [mm]",
       "direction of the force from straight up [°]",
       {{"1:2", "penalty", 5, edge_csv}, {"1:3", "god-object", 1, edge_csv}},
       "set yrange [-10:110]"},
      {"The same, size of the force",
       "tool beyond the edge [mm]",
       "force [N]",
       {{"1:4", "penalty", 5, edge_csv}, {"1:5", "god-object", 1, edge_csv}},
       fmt::format("set yrange [0:{:g}]", 0.004 * flags.wall_n_m)},
      {"Where the proxy goes",
       "x [mm], edge at 0",
       "z [mm], top at 0",
       {{"1:6", "tool", 0, edge_csv}, {"9:10", "nearest point of the surface", 5, edge_csv}, {"7:8", "god-object", 1, edge_csv}},
       "set yrange [-4:2]"}};
  CouplingPart part;
  part.picture = {out / "proxy.svg",
                  "A god-object remembers on which side the tool came in; the nearest point of the surface does not."};
  plot_grid(part.picture.svg, "God-object and penalty on rigid bodies", 2, panels);
  part.key_panel = panels[0];
  part.summary = {{"penalty_pops_at_mm", wall.popped_at_mm},
                  {"god_object_force_over_k_depth_min", wall.god_object_least},
                  {"penalty_edge_turn_max_deg", edge.penalty_turn_deg},
                  {"god_object_edge_turn_max_deg", edge.god_object_turn_deg}};
  part.table = fmt::format(
      "proxy              plate of 2 mm: the penalty pushes on from {:.2f} mm, the god-object back with k times the depth "
      "({:.4f} of it at "
      "least)\n                   edge: direction turns by {:.0f} deg at once (penalty), {:.0f} deg (god-object)\n",
      wall.popped_at_mm, wall.god_object_least, edge.penalty_turn_deg, edge.god_object_turn_deg);
  const bool holds = wall.popped_at_mm > 0 && wall.god_object_least > 0.999 && edge.god_object_turn_deg < 1;
  part.findings = {{"God-object [13]: a tool pressed through a plate of 2 mm", "no penetration problems",
                    fmt::format("penalty pushes on from {:.1f} mm; god-object back at any depth", wall.popped_at_mm),
                    holds ? Verdict::agrees : Verdict::differs, ""},
                   {"Largest jump of the force's direction at an edge [deg]", "",
                    fmt::format("penalty {:.0f}, god-object {:.0f}", edge.penalty_turn_deg, edge.god_object_turn_deg),
                    Verdict::beyond, "the nearest face of a corner is not the one that was touched"}};
  return part;
}

}  // namespace palpate
