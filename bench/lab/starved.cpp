// palpate-lab starved: what a hand feels of a server that gets a share of a processor.
//
// A cell is the examination (examination.hpp) through one scheme with one share, with the real cores in virtual time. A frame's
// parts take their cost with a whole core over the share. The server knows the cost with a whole core and learns the rest, as one
// whose machine becomes busy after its start.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdio>

#include "bench/fidelity/replay.hpp"
#include "bench/lab/cells.hpp"
#include "bench/lab/experiments.hpp"
#include "bench/lab/flags.hpp"
#include "bench/lab/link_flags.hpp"
#include "bench/measure/examination.hpp"
#include "bench/output/output.hpp"
#include "common/base/error.hpp"
#include "common/command_line/mesh_folders.hpp"
#include "common/wire/scheme_in_use.hpp"
#include "server/body/unload.hpp"

namespace palpate {
namespace {

struct StarvedCell {
  std::string scene, scheme;
  FrameCost cost;  // with a whole core [ms]; the share of one that the server gets
  double rtt_ms = 0;
  // Results:
  Scheme served = Scheme::hyper;             // of the last patch
  double snr_db = 0, p95_error = 0;          // as in metrics.hpp
  double rate_hz = 0, patch_age_p95_ms = 0;  // frames a second while the hand moved; age of patches in use
};
using StarvedCells = std::vector<StarvedCell>;

struct StarvedFlags {
  std::string scene, out;
  MeshFolders mesh_folders;
  std::vector<std::string> schemes{std::string(kAutoName), "port", "hyper", "hold"};
  std::vector<double> shares{1, 0.5, 0.333, 0.25}, cost_ms{7, 5, 12, 4};
  LinkFlags link{.rtt_ms = 120};
  CellFlags cells;
};

CellTable<StarvedCell> starved_table() {
  CellTable<StarvedCell> table;
  table.parameter("scene", &StarvedCell::scene)
      .parameter("scheme", &StarvedCell::scheme)
      .parameter("share", within(&StarvedCell::cost, &FrameCost::core_share), "{:g}")
      .parameter("rtt_ms", &StarvedCell::rtt_ms, "{:g}")
      .parameter("step_ms", within(&StarvedCell::cost, &FrameCost::step_ms), "{:g}")
      .parameter("port_ms", within(&StarvedCell::cost, &FrameCost::port_ms), "{:g}")
      .parameter("hyper_ms", within(&StarvedCell::cost, &FrameCost::hyper_ms), "{:g}")
      .parameter("rollouts_ms", within(&StarvedCell::cost, &FrameCost::rollouts_ms), "{:g}")
      .result("served", &StarvedCell::served, kSchemeNames)
      .result("snr_db", &StarvedCell::snr_db, "{:.3f}")
      .result("p95_error", &StarvedCell::p95_error, "{:.5g}")
      .result("rate_hz", &StarvedCell::rate_hz, "{:.3f}")
      .result("patch_age_p95_ms", &StarvedCell::patch_age_p95_ms, "{:.1f}");
  return table;
}

StarvedCells starved_cells(const StarvedFlags& flags, const std::string& scene) {
  StarvedCell cell;
  cell.scene = scene;
  cell.rtt_ms = flags.link.rtt_ms;
  cell.cost = {
      .step_ms = flags.cost_ms[0], .port_ms = flags.cost_ms[1], .hyper_ms = flags.cost_ms[2], .rollouts_ms = flags.cost_ms[3]};
  return crossed(crossed(StarvedCells{cell}, within(&StarvedCell::cost, &FrameCost::core_share), flags.shares),
                 &StarvedCell::scheme, flags.schemes);
}

void measure_starved(StarvedCell& cell, const StarvedFlags& flags, const Scene& scene, const Motion& motion,
                     const ReferenceForce& reference) {
  ReplayOptions options = replay_options(std::string(name_of(Scheme::port)), 0, flags.link);
  options.scheme = cell.scheme == kAutoName ? SchemeAsked{} : available_scheme(cell.scheme);
  options.cost = cell.cost;
  options.references = {&reference, 1};
  const ReplayResult result = replay(scene, motion, options, processor_ns);
  cell.served = result.last_patch.scheme;
  cell.snr_db = result.fidelity.snr_db;
  cell.p95_error = result.fidelity.p95_rel_error;
  cell.rate_hz = static_cast<double>(result.frames.size()) / seconds(motion.duration());
  cell.patch_age_p95_ms = 1e3 * seconds(result.age_p95);
}

void report(const StarvedCells& cells, const std::filesystem::path& out) {
  fmt::print("{:>10} {:<7} {:<7} {:>9} {:>14} {:>9} {:>19}\n", "share [1]", "scheme", "served", "SNR [dB]", "p95 error [%]",
             "frames/s", "patch age p95 [ms]");
  Json summary{{"shares", Json::array()}};
  for (const StarvedCell& c : cells) {
    fmt::print("{:>10g} {:<7} {:<7} {:>9.1f} {:>14.1f} {:>9.1f} {:>19.0f}\n", c.cost.core_share, c.scheme, name_of(c.served),
               c.snr_db, 100 * c.p95_error, c.rate_hz, c.patch_age_p95_ms);
    summary["shares"].push_back({{"share", c.cost.core_share},
                                 {"scheme", c.scheme},
                                 {"served", name_of(c.served)},
                                 {"snr_db", c.snr_db},
                                 {"p95_rel_error", c.p95_error},
                                 {"rate_hz", c.rate_hz},
                                 {"patch_age_p95_ms", c.patch_age_p95_ms}});
  }
  write_json(out / "summary.json", summary);
  fmt::print("{}\n", (out / "summary.json").string());
}

int run_starved(const StarvedFlags& flags) {
  if (flags.cost_ms.size() != 4)
    throw InputError("--cost-ms", fmt::format("has {} numbers", flags.cost_ms.size()), "4: step, port, hyper and rollouts");
  if (flags.cost_ms[3] > flags.cost_ms[2])
    throw InputError("--cost-ms", "has rollouts that take longer than the patch of which they are a part",
                     "at most that of hyper");
  for (const std::string& scheme : flags.schemes)
    if (scheme != kAutoName) available_scheme(scheme, kAutoName);
  const Scene scene = open_scene(flags.scene, flags.mesh_folders);
  const Motion motion = examination(scene);
  const auto out = make_output_folder(flags.out);
  ReferenceForce reference;
  CellSweep<StarvedCell> sweep{starved_table(), {}};
  if (!flags.cells.merge) sweep.cells = starved_cells(flags, scene.name);
  sweep.prepare = [&](StarvedCells&, unsigned) { reference = reference_of(scene, motion); };
  sweep.measure = [&](StarvedCell& cell) { measure_starved(cell, flags, scene, motion, reference); };
  if (const auto cells = run_cells(sweep, flags.cells, out)) report(*cells, out);
  return 0;
}

}  // namespace

void add_starved(CLI::App& app, Run& run) {
  auto flags = std::make_shared<StarvedFlags>();
  CLI::App* c = app.add_subcommand("starved", "measure what a hand feels of a server that gets a share of a processor");
  c->add_option("--scene", flags->scene, "scene file (JSON)")->type_name("FILE")->required();
  add_mesh_folders(*c, flags->mesh_folders);
  c->add_option("--schemes", flags->schemes, "schemes, separated by commas; auto: the server chooses")
      ->type_name("NAME")
      ->delimiter(',')
      ->default_str(fmt::format("{}", fmt::join(flags->schemes, ",")));
  c->add_option("--shares", flags->shares, "shares of a core, separated by commas")
      ->type_name("SHARE")
      ->delimiter(',')
      ->check(number_from(0.01, 1.0))
      ->default_str(fmt::format("{}", fmt::join(flags->shares, ",")));
  c->add_option("--cost-ms", flags->cost_ms,
                "processor time of a frame's step, a patch of port, one of hyper, and the rollouts in the latter; default: about "
                "those of scenes/organ.json (palpate-server --describe prints those of a scene)")
      ->type_name("MS,MS,MS,MS")
      ->delimiter(',')
      ->check(number_from(0.001, 10'000.0))
      ->default_str(fmt::format("{}", fmt::join(flags->cost_ms, ",")));
  flags->link.add_to(*c);
  flags->cells.add_to(*c);
  c->add_option("--out", flags->out, "folder for cells.csv and summary.json")->type_name("DIR")->required();
  c->callback([flags, &run] { run = [flags] { return run_starved(*flags); }; });
}

}  // namespace palpate
