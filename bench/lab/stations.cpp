// palpate-lab stations: several hands on one body, each over its own link, compared with the 1 kHz full model with all tools.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>

#include "bench/fidelity/ceiling.hpp"
#include "bench/fidelity/replay.hpp"
#include "bench/lab/experiments.hpp"
#include "bench/lab/flags.hpp"
#include "bench/lab/link_flags.hpp"
#include "bench/lab/tools_held.hpp"
#include "bench/measure/tools_apart.hpp"
#include "bench/output/output.hpp"
#include "bench/output/plot.hpp"
#include "bench/output/progress.hpp"
#include "common/base/error.hpp"
#include "common/command_line/mesh_folders.hpp"
#include "server/body/unload.hpp"

namespace palpate {
namespace {

struct StationsFlags {
  std::string scene, scheme = "hyper", device = "none", out;
  MeshFolders mesh_folders;
  std::vector<std::string> tools;
  int stations = 2, order = 0;
  double apart_mm = 20, slide_mm = 0, duration_s = 4;
  bool no_ceiling = false;
  LinkFlags link;
};

void write_forces(const std::filesystem::path& file, const std::vector<ReplayResult>& results) {
  std::string csv = "t_s";
  for (std::size_t k = 1; k <= results.size(); ++k) fmt::format_to(std::back_inserter(csv), ",f{0}_n,f{0}_ref_n", k);
  csv += '\n';
  for (std::size_t i = 0; i < results[0].ticks.size(); ++i) {
    fmt::format_to(std::back_inserter(csv), "{:.3f}", static_cast<double>(i) * 1e-3);
    for (const ReplayResult& r : results)
      fmt::format_to(std::back_inserter(csv), ",{:.6g},{:.6g}", r.ticks[i].felt.norm(), r.ticks[i].reference.norm());
    csv += '\n';
  }
  write_text(file, csv);
}

/// Upper bound for a hand, the full model in place of its patches (ceiling.hpp).
struct Ceiling {
  double snr_db = 0;      ///< with the better of the predictions
  double step_max_n = 0;  ///< with that of the patches, predicted_to_go_on
};

std::vector<Ceiling> ceilings(const Scene& scene, const std::vector<ReplayResult>& results, std::span<const std::uint8_t> held,
                              const std::function<void(const char*, double)>& progress) {
  std::vector<ToolPath> paths;
  std::vector<std::vector<int>> stamp_ms;
  for (const ReplayResult& r : results) {
    ToolPath& path = paths.emplace_back();
    std::vector<int>& stamps = stamp_ms.emplace_back();
    for (std::size_t i = 0; i < r.ticks.size(); ++i) {
      path.push_back(r.ticks[i].position);
      const auto age_ms = static_cast<int>(std::lround(1e-3 * static_cast<double>(r.ticks[i].patch_age.count())));
      stamps.push_back(age_ms < 0 ? -1 : static_cast<int>(i) - age_ms);
    }
  }
  std::vector<Ceiling> best(results.size(), {-kSnrCeilingDb, 0});
  for (PathPrediction prediction : {predicted_to_rest, predicted_to_go_on}) {  // the patches' last
    const auto shown = [&](double share) {
      if (progress) progress("the full model instead of patches", share);
    };
    const auto forces = ceiling_forces(scene, paths, stamp_ms, prediction, shown, held);
    for (std::size_t k = 0; k < results.size(); ++k) {
      std::vector<Vec3> reference;
      for (const ReplayTick& tick : results[k].ticks) reference.push_back(tick.reference);
      const double snr_db = compare(forces[k].felt.force, reference, kSkipTicks).snr_db;
      best[k].snr_db = std::max(best[k].snr_db, snr_db);
      const auto& steps = forces[k].steps_n;
      if (!steps.empty()) best[k].step_max_n = *std::ranges::max_element(steps);
    }
  }
  return best;
}

/// Processor time of the server per frame: the body's step, and the patches of all stations by phase.
void report_cost(const ReplayResult& r, double rate_hz, Json& summary) {
  constexpr std::array<const char*, kPatchParts> kPhases{"linearise", "solve", "basis", "project", "rollouts", "other"};
  fmt::print("\n{:<16} {:>16} {:>14}\n", "part", "time/frame [ms]", "share [%]");
  const auto row = [&](const char* part, double ms) {
    fmt::print("{:<16} {:>16.3f} {:>14.2f}\n", part, ms, 0.1 * ms * rate_hz);
    summary["server_ms_per_frame"][part] = ms;
  };
  row("step of the body", r.frame_ms_mean - r.patch_build_ms_mean);
  row("patches", r.patch_build_ms_mean);
  for (std::size_t k = 0; k < kPatchParts; ++k) row(kPhases[k], r.phase_ms_mean[k]);
  fmt::print("\nThe share is that of a core at {:g} frames per second; the phases add up to the patches.\n", rate_hz);
}

int run_stations(const StationsFlags& flags) {
  ReplayOptions options = replay_options(flags.scheme, flags.order, flags.link);
  options.progress = show_progress();
  options.simulated_device = flags.device == "sim";
  const Scene scene = open_scene(flags.scene, flags.mesh_folders);
  if (scene.tool.contact != ContactKind::touch)
    throw InputError(flags.scene, "has tools that attach to one node", "a scene with \"contact\": \"touch\"");
  const std::vector<Motion> motions =
      tools_apart(scene, flags.stations, flags.apart_mm * 1e-3, flags.duration_s, flags.slide_mm * 1e-3);
  options.held = tools_held(scene, flags.tools, motions.size(), "--stations");
  const auto out = make_output_folder(flags.out);
  const std::vector<ReplayResult> results = replay_together(scene, motions, options, processor_ns);
  write_forces(out / "forces.csv", results);
  Json summary;
  const std::vector<Ceiling> most =
      !flags.no_ceiling && results.size() > 1 ? ceilings(scene, results, options.held, options.progress) : std::vector<Ceiling>{};
  fmt::print("{:<9} {:>9} {:>13} {:>14} {:>14} {:>9} {:>17} {:>9} {:>10}\n", "station", "SNR [dB]", "ceiling [dB]",
             "rms error [%]", "p95 error [%]", "step [N]", "ceiling step [N]", "felt [N]", "patch [B]");
  for (std::size_t k = 0; k < results.size(); ++k) {
    const ReplayResult& r = results[k];
    fmt::print("{:<9} {:>9.1f} {:>13} {:>14.2f} {:>14.1f} {:>9.2f} {:>17} {:>9.2f} {:>10.0f}\n", k + 1, r.fidelity.snr_db,
               most.empty() ? "-" : fmt::format("{:.1f}", most[k].snr_db), 100 * r.fidelity.rel_rms,
               100 * r.fidelity.p95_rel_error, r.hand_over.max_n, most.empty() ? "-" : fmt::format("{:.2f}", most[k].step_max_n),
               r.felt_step.max_n, r.patch_bytes_mean);
    summary["stations"].push_back({{"snr_db", r.fidelity.snr_db},
                                   {"rel_rms", r.fidelity.rel_rms},
                                   {"p95_rel_error", r.fidelity.p95_rel_error},
                                   {"force_step_max_n", r.fidelity.force_step_max_n},
                                   {"hand_over_step_max_n", r.hand_over.max_n},
                                   {"felt_step_max_n", r.felt_step.max_n},
                                   {"patch_bytes_mean", r.patch_bytes_mean},
                                   {"patch_states", r.patch_states}});
    if (most.empty()) continue;
    summary["stations"].back()["ceiling_snr_db"] = most[k].snr_db;
    summary["stations"].back()["ceiling_step_max_n"] = most[k].step_max_n;
  }
  fmt::print("step: between two patches, which the cross-fade spreads; felt: most that a tick adds while it does.\n");
  report_cost(results[0], flags.link.rate_hz, summary);
  write_json(out / "summary.json", summary);
  std::vector<Panel> panels;
  for (std::size_t k = 0; k < std::min<std::size_t>(results.size(), 4); ++k)
    panels.push_back(
        {fmt::format("tool {} [N]", k + 1),
         {{fmt::format("1:{}", 2 * k + 3), "1 kHz full model", 0}, {fmt::format("1:{}", 2 * k + 2), flags.scheme, 1}}});
  plot_csv(
      out / "forces.csv", out / "forces.svg",
      fmt::format("{} tools on {}, {:g} mm apart, RTT {:g} ms", results.size(), scene.name, flags.apart_mm, flags.link.rtt_ms),
      "time [s]", panels, {.rows = results[0].ticks.size()});
  fmt::print("{}\n", (out / "summary.json").string());
  return 0;
}

}  // namespace

void add_stations(CLI::App& app, Run& run) {
  auto flags = std::make_shared<StationsFlags>();
  CLI::App* c =
      app.add_subcommand("stations", "measure what several hands on one body feel of each other, and what they cost the server");
  c->add_option("--scene", flags->scene, "scene file (JSON) with touch contact")->type_name("FILE")->required();
  add_mesh_folders(*c, flags->mesh_folders);
  c->add_option("--stations", flags->stations, "number of hands on the body")
      ->check(number_from(1, kMaxStations))
      ->capture_default_str();
  add_tools_held(*c, flags->tools);
  c->add_option("--apart-mm", flags->apart_mm, "distance between neighbours")
      ->check(number_from<double>(0, 1000))
      ->capture_default_str();
  c->add_option("--slide-mm", flags->slide_mm, "distance by which every other tool slides to and fro")
      ->check(number_from<double>(0, 100))
      ->capture_default_str();
  c->add_option("--duration-s", flags->duration_s, "duration of the motions")
      ->check(number_from<double>(0.5, 600))
      ->capture_default_str();
  c->add_option("--scheme", flags->scheme, "scheme of the patches")->type_name("NAME")->capture_default_str();
  c->add_option("--order", flags->order, "number of states of a patch, 0: the scheme's default")
      ->check(number_from(0, 2 * kMaxModes));
  c->add_option("--device", flags->device, "none: the motions as given; sim: Phantoms in hands that follow them")
      ->check(one_of({"none", "sim"}));
  c->add_flag("--no-ceiling", flags->no_ceiling, "leave out the upper bound: the full model instead of patches");
  flags->link.add_to(*c);
  c->add_option("--out", flags->out, "folder for forces.csv, summary.json, forces.svg")->type_name("DIR")->required();
  c->callback([flags, &run] { run = [flags] { return run_stations(*flags); }; });
}

}  // namespace palpate
