// palpate-lab stations: several hands on one body, each over a link of its own, beside the 1 kHz full model with all tools on it.
#include <fmt/format.h>

#include <ctime>
#include <iterator>

#include "bench/fidelity/replay.hpp"
#include "bench/lab/experiments.hpp"
#include "bench/lab/flags.hpp"
#include "bench/lab/link_flags.hpp"
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
  std::string scene, scheme = "port", out;
  MeshFolders mesh_folders;
  int stations = 2, order = 0;
  double apart_mm = 20, duration_s = 4;
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

int run_stations(const StationsFlags& flags) {
  ReplayOptions options = replay_options(flags.scheme, flags.order, flags.link);
  options.progress = show_progress();
  const Scene scene = open_scene(flags.scene, flags.mesh_folders);
  if (scene.tool.contact != ContactKind::touch)
    throw InputError(flags.scene, "has tools that attach to one node", "a scene with \"contact\": \"touch\"");
  const std::vector<Motion> motions = tools_apart(scene, flags.stations, flags.apart_mm * 1e-3, flags.duration_s);
  const auto out = make_output_folder(flags.out);
  const std::vector<ReplayResult> results = replay_together(scene, motions, options, processor_ns);
  write_forces(out / "forces.csv", results);
  Json summary;
  fmt::print("{:<9} {:>8} {:>9} {:>12} {:>12}\n", "station", "dB", "rms [%]", "p95 [%]", "bytes/patch");
  for (std::size_t k = 0; k < results.size(); ++k) {
    const ReplayResult& r = results[k];
    fmt::print("{:<9} {:>8.1f} {:>9.2f} {:>12.1f} {:>12.0f}\n", k + 1, r.fidelity.snr_db, 100 * r.fidelity.rel_rms,
               100 * r.fidelity.p95_rel_error, r.patch_bytes_mean);
    summary["stations"].push_back({{"snr_db", r.fidelity.snr_db},
                                   {"rel_rms", r.fidelity.rel_rms},
                                   {"p95_rel_error", r.fidelity.p95_rel_error},
                                   {"force_step_max_n", r.fidelity.force_step_max_n},
                                   {"hand_over_step_max_n", r.hand_over.max_n},
                                   {"patch_bytes_mean", r.patch_bytes_mean},
                                   {"patch_states", r.patch_states}});
  }
  const double build_ms = results[0].patch_build_ms_mean, step_ms = results[0].frame_ms_mean - build_ms;
  fmt::print("server    body's step {:.2f} ms a frame; patches {:.2f} ms a frame, {:.3f} ms a station (more: palpate-lab load)\n",
             step_ms, build_ms, build_ms / flags.stations);
  summary["server"] = {
      {"step_ms_mean", step_ms}, {"patches_ms_mean", build_ms}, {"patch_ms_per_station", build_ms / flags.stations}};
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
  CLI::App* c = app.add_subcommand("stations", "several hands on one body: what each feels of the others, and what it costs");
  c->add_option("--scene", flags->scene, "scene file (JSON) with touch contact")->type_name("FILE")->required();
  add_mesh_folders(*c, flags->mesh_folders);
  c->add_option("--stations", flags->stations, "hands on the body")->check(number_from(1, kMaxStations))->capture_default_str();
  c->add_option("--apart-mm", flags->apart_mm, "distance between neighbours")
      ->check(number_from<double>(0, 1000))
      ->capture_default_str();
  c->add_option("--duration-s", flags->duration_s, "length of the motions")
      ->check(number_from<double>(0.5, 600))
      ->capture_default_str();
  c->add_option("--scheme", flags->scheme, "how patches are made")
      ->transform(current_name())
      ->type_name("NAME")
      ->capture_default_str();
  c->add_option("--order", flags->order, "states of a patch, 0: the scheme's default")->check(number_from(0, 2 * kMaxModes));
  flags->link.add_to(*c);
  c->add_option("--out", flags->out, "folder for forces.csv, summary.json, forces.svg")->type_name("DIR")->required();
  c->callback([flags, &run] { run = [flags] { return run_stations(*flags); }; });
}

}  // namespace palpate
