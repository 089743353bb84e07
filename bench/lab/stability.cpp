// palpate-lab stability: where is the loop of hand, device and display stable? Maps for every scheme.
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <iterator>

#include "bench/lab/experiments.hpp"
#include "bench/lab/link_flags.hpp"
#include "bench/lab/stability_body.hpp"
#include "bench/lab/stability_guided.hpp"
#include "bench/lab/stability_maps.hpp"
#include "bench/output/output.hpp"
#include "bench/output/plot.hpp"
#include "common/base/error.hpp"
#include "common/base/rotation_vector.hpp"

namespace palpate {
namespace {

struct StabilityFlags {
  std::string out, only;
  std::vector<std::string> schemes;
  bool quick = false, body = false, solid = false, hands = false, tools = false, guided = false;
  StabilityKind kind() const { return tools ? StabilityKind::tools : hands ? StabilityKind::hands : StabilityKind::hand; }
  StabilityCube cube() const { return solid ? StabilityCube::solid : StabilityCube::springs; }
  std::uint64_t seed = 1;
  CellFlags cells;
};

using StabilityCells = std::vector<StabilityCell>;

bool is_ours(Scheme scheme) { return scheme == Scheme::port || scheme == Scheme::hyper; }

std::string key_of(const StabilityCell& c) { return stability_table(kind_of(c.point)).key(c); }

Json to_json(const StabilityCell& c) {
  return {{"point", key_of(c)},
          {"stable", c.fault == LoopFault::none ? 1 : 0},
          {"tail_mm", c.tail_mm},
          {"growth_1_s", c.growth_1_s},
          {"shake_mm", c.shake_mm},
          {"shake_mm_s", c.shake_mm_s},
          {"generated_mj", c.generated_mj},
          {"cut_ms", c.cut_ms},
          {"step_max_n", c.step_max_n}};
}

/// Returns false if a point of our schemes is not stable.
bool report(const StabilityCells& cells, StabilityCube cube, const std::filesystem::path& out) {
  draw_stability_maps(out, cells);
  Json summary{{"points", cells.size()}};
  fmt::print("\n  {:<10} {:>7} {:>11} {:>7} {:>7} {:>7} {:>7} {:>18} {:>15} {:>9}\n", "scheme", "points", "stable [%]", "lost",
             "unrest", "shakes", "cut", "largest tail [mm]", "generated [mJ]", "step [N]");
  for (const Scheme scheme : available_schemes()) {
    std::array<std::size_t, kLoopFaultNames.size()> count{};
    double tail_mm = 0, generated_mj = 0, step_max_n = 0;
    std::size_t cut = 0;
    Json failures = Json::array();
    for (const StabilityCell& c : cells) {
      if (c.point.scheme != scheme) continue;
      ++count[static_cast<std::size_t>(c.fault)];
      cut += c.cut_ms > 0 ? 1 : 0;
      generated_mj = std::max(generated_mj, c.generated_mj);
      step_max_n = std::max(step_max_n, c.step_max_n);
      if (c.fault == LoopFault::none)
        tail_mm = std::max(tail_mm, c.tail_mm);
      else if (is_ours(scheme))
        failures.push_back(to_json(c));
    }
    const std::size_t stable = count[0], all = stable + count[1] + count[2] + count[3];
    if (all == 0) continue;
    fmt::print("  {:<10} {:>7} {:>11.1f} {:>7} {:>7} {:>7} {:>7} {:>18.2f} {:>15.3g} {:>9.2f}\n", name_of(scheme), all,
               100.0 * static_cast<double>(stable) / static_cast<double>(all), count[1], count[2], count[3], cut, tail_mm,
               generated_mj, step_max_n);
    Json& j = summary["schemes"][std::string(name_of(scheme))];
    j = {{"points", all},           {"stable", stable},   {"lost", count[1]}, {"unrest", count[2]},
         {"shakes", count[3]},      {"tail_mm", tail_mm}, {"cut", cut},       {"generated_mj", generated_mj},
         {"step_max_n", step_max_n}};
    if (is_ours(scheme)) j["unstable"] = failures;
  }
  fmt::print(
      "\n  Unrest means that the motion does not die out when nothing drives it, shakes that a driven hand is shaken, cut that "
      "no "
      "patch came\n  in time and the force faded. The tail is the motion of stable points after 1.5 s or more; the generated "
      "energy is "
      "that from the\n  display beyond what the hand had put in; the step is the largest of the force at a hand-over.\n");
  bool all_stable = true;
  for (const StabilityCell& c : cells) {
    if (c.fault == LoopFault::none || !is_ours(c.point.scheme)) continue;
    all_stable = false;
    fmt::print("  {}: palpate-lab stability{}{} --only {} --out DIR\n", name_of(c.fault),
               cube == StabilityCube::solid ? " --solid" : "",
               std::array{"", " --hands", " --tools"}[static_cast<std::size_t>(kind_of(c.point))], key_of(c));
  }
  write_json(out / "summary.json", summary);
  fmt::print("\n{}\n", (out / "summary.json").string());
  return all_stable;
}

std::string trace_csv(const StabilityResult& result) {
  std::string csv =
      "t_s,x_mm,y_mm,z_mm,fx_n,fy_n,fz_n,patch_age_ms,kinetic_mj,display_mj,ref_x_mm,ref_y_mm,ref_z_mm,"
      "turn_x_mrad,turn_y_mrad,turn_z_mrad,torque_x_mnm,torque_y_mnm,torque_z_mnm\n";
  const std::vector<LoopTick>&ticks = result.loops[result.worst].ticks, &ref = result.references[result.worst].ticks;
  for (std::size_t i = 0; i < ticks.size(); ++i) {
    const LoopTick& t = ticks[i];
    const Vec3 moved = 1e3 * (t.position - ticks[0].position);
    const Vec3 there = 1e3 * (ref[std::min(i, ref.size() - 1)].position - ref[0].position);
    const Vec3 turned = 1e3 * rotation_between(ticks[0].turn, t.turn), torque = 1e3 * t.torque;
    fmt::format_to(
        std::back_inserter(csv),
        "{:.3f},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},"
        "{:.6g},{:.6g},{:.6g}\n",
        static_cast<double>(i) * 1e-3, moved.x(), moved.y(), moved.z(), t.force.x(), t.force.y(), t.force.z(),
        seconds(t.patch_age) * 1e3, 1e3 * t.kinetic_j, 1e3 * t.display_j, there.x(), there.y(), there.z(), turned.x(), turned.y(),
        turned.z(), torque.x(), torque.y(), torque.z());
  }
  return csv;
}

int run_one(const StabilityFlags& flags) {
  const StabilityPoint point = stability_point(flags.only, flags.kind());
  const auto out = make_output_folder(flags.out);
  const StabilityResult result = measure_stability(point, reference_of(point, flags.cube()));
  const LoopVerdict& v = result.verdict;
  write_text(out / "trace.csv", trace_csv(result));
  std::vector<Panel> panels{{"depth [mm]", {{"1:(-$13)", "full model at 1 kHz", 0}, {"1:(-$4)", "tool", 1}}},
                            {"sideways [mm]", {{"1:11", "full model at 1 kHz", 0}, {"1:2", "tool", 1}}},
                            {"force [N]", {{"1:7", "up", 1}, {"1:5", "sideways", 2}}},
                            {"energy [mJ]", {{"1:10", "put into the display", 1}, {"1:9", "kinetic", 2}}}};
  if (!point.tool.empty()) {
    panels.push_back({"turned [mrad]", {{"1:14", "about x", 1}, {"1:15", "about y", 2}, {"1:16", "about z", 3}}});
    panels.push_back({"torque [mN m]", {{"1:17", "about x", 1}, {"1:18", "about y", 2}, {"1:19", "about z", 3}}});
  }
  plot_csv(out / "trace.csv", out / "trace.svg", flags.only, "time [s]", panels,
           {.rows = result.loops[result.worst].ticks.size()});
  if (point.hands > 1)
    fmt::print("hand {} of {}, the least calm one; largest step at a hand-over {:.2f} N\n", result.worst + 1, point.hands,
               result.step_max_n);
  fmt::print("{}: {}\n  nothing drives from {:g} s on; peak to peak in windows of {:g} s [mm]:", flags.only, name_of(v.fault),
             static_cast<double>(result.rest_tick) * 1e-3, kWindowS);
  for (const double p : v.rest.peak_to_peak_m) fmt::print(" {:.2f}", 1e3 * p);
  fmt::print("\n  growth {:+.2f} /s; shake while driven {:.2f} mm, {:.0f} mm/s; generated {:.3g} mJ\n", v.rest.growth_1_s,
             1e3 * v.shake.motion_m, 1e3 * v.shake.speed_m_s, 1e3 * v.generated_j);
  if (result.cut_s > 0)
    fmt::print("  for {:.0f} ms the force was cut, and that of the reference with it: no patch came\n", 1e3 * result.cut_s);
  write_json(out / "summary.json", {{"stable", v.fault == LoopFault::none ? 1 : 0}});
  fmt::print("{}\n", (out / "trace.svg").string());
  return 0;
}

int run_stability(const StabilityFlags& flags) {
  if (flags.guided && !flags.only.empty()) throw InputError("--guided", "with --only", "one of these: it has points of its own");
  if (flags.body) return run_body_sweep({flags.quick, flags.seed, flags.only, flags.out, flags.cells});
  if (flags.guided) return run_guided_sweep({flags.quick, flags.seed, flags.out, flags.cells.jobs});
  if (!flags.only.empty()) return run_one(flags);
  const StabilityPlan plan{schemes_named(flags.schemes), cube_stiffness_n_m(), flags.quick, flags.seed};
  const std::vector<StabilityPoint> points = flags.hands   ? hands_points(plan)
                                             : flags.tools ? tool_points(plan)
                                                           : stability_points(plan);
  const auto out = make_output_folder(flags.out);
  const auto cells = run_cells(stability_sweep(points, flags.cube(), flags.kind()), flags.cells, out);
  return !cells || report(*cells, flags.cube(), out) ? 0 : 1;
}

}  // namespace

void add_stability(CLI::App& app, Run& run) {
  auto flags = std::make_shared<StabilityFlags>();
  CLI::App* c = app.add_subcommand(
      "stability",
      "find where the loop of hand, device and display is stable, for every scheme; --hands: with several hands on "
      "the body; --tools: with tools that turn, and a needle; --guided: with a hand that guides another; --body: where the full "
      "model is");
  CLI::Option* const body =
      c->add_flag("--body", flags->body, "try the full model alone: extreme bodies, steps and deformations");
  CLI::Option* const hands =
      c->add_flag("--hands", flags->hands, "put 2 to 8 hands on one body, 0 to 100 mm apart, with equal and unequal round trips");
  CLI::Option* const tools =
      c->add_flag("--tools", flags->tools, "hold the tools of scenes/tools, and a needle, in a hand that turns them");
  CLI::Option* const guided =
      c->add_flag("--guided", flags->guided,
                  "let one hand guide another, in the air and on the body, with round trips of 0 to 300 ms, equal and unequal");
  for (CLI::Option* const one : {body, hands, tools})
    for (CLI::Option* const other : {hands, tools, guided})
      if (one != other) one->excludes(other);
  c->add_flag("--solid", flags->solid, "use the cube of finite elements instead of springs");
  c->add_option("--schemes", flags->schemes, "only these schemes, separated by commas")->type_name("NAME")->delimiter(',');
  c->add_flag("--quick", flags->quick, "try few points of each kind");
  c->add_option("--only", flags->only, "only this point, with its trace: SCHEME,CONTACT,HAND,... as cells.csv begins")
      ->type_name("POINT");
  c->add_option("--seed", flags->seed, "seed of the scattered points and the links")->check(whole_number());
  flags->cells.add_to(*c);
  c->add_option("--out", flags->out, "folder for cells.csv, summary.json and maps")->type_name("DIR")->required();
  c->callback([flags, &run] { run = [flags] { return run_stability(*flags); }; });
}

}  // namespace palpate
