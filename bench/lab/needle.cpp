// palpate-lab needle: accuracy of a needle over the round trip, and its cost.
//
// A cell is the insertion (insertion.hpp) of a scene's needle at one peak speed through one scheme at one round trip, with the
// real cores in virtual time, against the full model at 1 kHz with the same needle.
#include <fmt/format.h>

#include <algorithm>

#include "bench/fidelity/replay.hpp"
#include "bench/lab/cells.hpp"
#include "bench/lab/experiments.hpp"
#include "bench/lab/flags.hpp"
#include "bench/lab/tasks.hpp"
#include "bench/measure/insertion.hpp"
#include "common/base/error.hpp"
#include "server/body/unload.hpp"

namespace palpate {
namespace {

struct NeedleCell {
  std::string scene;
  double speed_mm_s = 0;
  std::size_t scheme = 0;
  double rtt_ms = 0;
  // Results:
  double force_db = 0, force_p95 = 0, step_n = 0;
  double puncture_ms = 0;  // after the reference's; NaN: one of them did not
  double fronts_mm = 0;    // 95th percentile of their distance while both are inside
  double taken_back = 0;   // number of times the client's needle was inside and then outside while the reference's stayed inside
  double frame_bytes = 0, build_ms = 0, tick_us = 0, tick_p99_us = 0;
};
using NeedleCells = std::vector<NeedleCell>;

CellTable<NeedleCell> needle_table() {
  CellTable<NeedleCell> table;
  table.parameter("scene", &NeedleCell::scene)
      .parameter("speed_mm_s", &NeedleCell::speed_mm_s, "{:g}")
      .parameter("scheme", &NeedleCell::scheme, kSchemeNames)
      .parameter("rtt_ms", &NeedleCell::rtt_ms, "{:g}")
      .result("force_db", &NeedleCell::force_db, "{:.2f}")
      .result("force_p95", &NeedleCell::force_p95, "{:.4g}")
      .result("step_n", &NeedleCell::step_n, "{:.3g}")
      .result("puncture_ms", &NeedleCell::puncture_ms, "{:.3g}")
      .result("fronts_mm", &NeedleCell::fronts_mm, "{:.3g}")
      .result("taken_back", &NeedleCell::taken_back, "{:.0f}")
      .result("frame_bytes", &NeedleCell::frame_bytes, "{:.0f}")
      .result("build_ms", &NeedleCell::build_ms, "{:.4g}")
      .result("tick_us", &NeedleCell::tick_us, "{:.4g}")
      .result("tick_p99_us", &NeedleCell::tick_p99_us, "{:.4g}");
  return table;
}

struct NeedleFlags {
  std::string out, scenes = "scenes/needles";
  std::vector<std::string> only{"liver", "biopsy"}, schemes{"port", "hyper"};
  std::vector<double> rtt_ms{0, 50, 150}, speed_mm_s{10, 30, 100};
  double depth_mm = 30;
  CellFlags cells;
};

std::string task_of(const NeedleCell& cell) { return fmt::format("{}/{:g}", cell.scene, cell.speed_mm_s); }

NeedleCells needle_cells(const NeedleFlags& flags) {
  std::vector<std::size_t> schemes;
  for (const std::string& name : flags.schemes) schemes.push_back(index_from(name, kSchemeNames, "--schemes"));
  return crossed(crossed(crossed(crossed(NeedleCells(1), &NeedleCell::scene, scenes_in(flags.scenes, flags.only)),
                                 &NeedleCell::speed_mm_s, flags.speed_mm_s),
                         &NeedleCell::scheme, schemes),
                 &NeedleCell::rtt_ms, flags.rtt_ms);
}

void add_insertion(SweepTasks& tasks, const NeedleFlags& flags, const NeedleCell& cell) {
  if (tasks.contains(task_of(cell))) return;
  Scene scene = open_scene((std::filesystem::path(flags.scenes) / (cell.scene + ".json")).string());
  if (!scene.tool.needle) throw InputError("--only " + cell.scene, "has no needle", "a scene with tool.needle");
  Motion motion = insertion(top_of(scene), 1e-3 * flags.depth_mm, 1e-3 * cell.speed_mm_s);
  tasks.emplace(task_of(cell), SweepTask{std::move(scene), std::move(motion), {}});
}

/// Returns the first tick inside; the number of ticks if there is none.
std::size_t puncture(const ReplayResult& result, NeedleTip ReplayTick::*tip) {
  std::size_t i = 0;
  while (i < result.ticks.size() && !(result.ticks[i].*tip).inside) ++i;
  return i;
}

void measure_needle(NeedleCell& cell, const SweepTask& task) {
  ReplayOptions options;
  options.scheme = static_cast<Scheme>(cell.scheme);
  options.link.latency = from_seconds(cell.rtt_ms * 0.5e-3);
  options.references = {&task.reference, 1};
  const ReplayResult result = replay(task.scene, task.motion, options, processor_ns);
  cell.force_db = result.fidelity.snr_db;
  cell.force_p95 = result.fidelity.p95_rel_error;
  cell.step_n = result.hand_over.max_n;
  const std::size_t mine = puncture(result, &ReplayTick::tip), true_one = puncture(result, &ReplayTick::reference_tip);
  const bool both = std::max(mine, true_one) < result.ticks.size();
  cell.puncture_ms = both ? static_cast<double>(mine) - static_cast<double>(true_one) : std::nan("");
  std::vector<double> apart_mm;
  bool before = false;
  for (const ReplayTick& tick : result.ticks) {
    if (tick.tip.inside && tick.reference_tip.inside)
      apart_mm.push_back(1e3 * std::abs(tick.tip.front_m - tick.reference_tip.front_m));
    if (before && !tick.tip.inside && (tick.reference_tip.inside || tick.reference_tip.front_m == 0)) ++cell.taken_back;
    before = tick.tip.inside;
  }
  cell.fronts_mm = apart_mm.empty() ? std::nan("") : percentile(std::move(apart_mm), 0.95);
  cell.frame_bytes = result.patch_bytes_mean;
  cell.build_ms = result.patch_build_ms_mean;
  cell.tick_us = 1e-3 * result.tick_ns_p50;
  cell.tick_p99_us = 1e-3 * result.tick_ns_p99;
}

void report(const NeedleCells& cells) {
  fmt::print("{:<14} {:>6} {:<6} {:>4}  {:>6} {:>6} {:>9} {:>9} {:>7} {:>6} {:>6} {:>9} {:>12}\n", "scene", "speed", "scheme",
             "RTT", "force", "p95", "puncture", "fronts", "taken", "step", "patch", "patch", "tick");
  fmt::print("{:<14} {:>6} {:<6} {:>4}  {:>6} {:>6} {:>9} {:>9} {:>7} {:>6} {:>6} {:>9} {:>12}\n", "", "mm/s", "", "ms", "dB",
             "%", "ms late", "mm apart", "back", "N", "bytes", "build ms", "us (99 %)");
  for (const NeedleCell& c : cells)
    fmt::print(
        "{:<14} {:>6g} {:<6} {:>4g}  {:>6.1f} {:>6.1f} {:>9.0f} {:>9.2f} {:>7.0f} {:>6.2f} {:>6.0f} {:>9.2f} {:>5.1f} ({:.1f})\n",
        c.scene, c.speed_mm_s, kSchemeNames[c.scheme], c.rtt_ms, c.force_db, 100 * c.force_p95, c.puncture_ms, c.fronts_mm,
        c.taken_back, c.step_n, c.frame_bytes, c.build_ms, c.tick_us, c.tick_p99_us);
}

int run_needle(const NeedleFlags& flags) {
  check_once_each("--rtt-ms", flags.rtt_ms);
  check_once_each("--speed-mm-s", flags.speed_mm_s);
  const auto out = make_output_folder(flags.out);
  SweepTasks tasks;
  CellSweep<NeedleCell> sweep{needle_table(), {}};
  if (!flags.cells.merge) sweep.cells = needle_cells(flags);
  sweep.prepare = [&](NeedleCells& cells, unsigned jobs) {
    for (const NeedleCell& cell : cells) add_insertion(tasks, flags, cell);
    add_references(tasks, jobs);
  };
  sweep.measure = [&](NeedleCell& cell) { measure_needle(cell, tasks.at(task_of(cell))); };
  if (const auto cells = run_cells(sweep, flags.cells, out)) report(*cells);
  return 0;
}

}  // namespace

void add_needle(CLI::App& app, Run& run) {
  auto flags = std::make_shared<NeedleFlags>();
  CLI::App* c = app.add_subcommand("needle", "measure the error of a needle's force and depth, over the round trip");
  c->add_option("--scenes", flags->scenes, "folder of the scenes")->type_name("DIR")->capture_default_str();
  c->add_option("--only", flags->only, "only these scenes, by file name without .json, separated by commas")
      ->type_name("NAME")
      ->delimiter(',')
      ->capture_default_str();
  c->add_option("--schemes", flags->schemes, "only these schemes, separated by commas")
      ->type_name("NAME")
      ->delimiter(',')
      ->capture_default_str();
  c->add_option("--rtt-ms", flags->rtt_ms, "round trips, separated by commas")
      ->type_name("MS")
      ->delimiter(',')
      ->check(CLI::Range(0.0, 2000.0))
      ->capture_default_str();
  c->add_option("--speed-mm-s", flags->speed_mm_s, "peak speeds of the insertion, separated by commas")
      ->type_name("MM/S")
      ->delimiter(',')
      ->check(CLI::Range(1.0, 500.0))
      ->capture_default_str();
  c->add_option("--depth-mm", flags->depth_mm, "depth of the insertion below the surface")
      ->type_name("MM")
      ->check(CLI::Range(1.0, 300.0))
      ->capture_default_str();
  flags->cells.add_to(*c);
  c->add_option("--out", flags->out, "folder for cells.csv")->type_name("DIR")->required();
  c->callback([flags, &run] { run = [flags] { return run_needle(*flags); }; });
}

}  // namespace palpate
