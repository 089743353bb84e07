// palpate-lab load: cost of a room full of stations for its server, part by part, and of one more station.
#include <fmt/format.h>

#include "bench/lab/experiments.hpp"
#include "bench/lab/flags.hpp"
#include "bench/lab/link_flags.hpp"
#include "bench/measure/server_load.hpp"
#include "bench/measure/tools_apart.hpp"
#include "bench/output/output.hpp"
#include "bench/output/progress.hpp"
#include "common/base/error.hpp"
#include "common/base/limits.hpp"
#include "common/command_line/mesh_folders.hpp"
#include "server/body/unload.hpp"

namespace palpate {
namespace {

struct LoadFlags {
  std::string scene, scheme = "port", out;
  MeshFolders mesh_folders;
  int stations = 16, order = 0;
  double apart_mm = 20, slide_mm = 10, duration_s = 4, rate_hz = 30;
};

struct Row {
  const char* name;
  double (*ms)(const ServerLoad&);
};

constexpr Row kRows[] = {
    {"linearise", [](const ServerLoad& l) { return l.patch_ms[static_cast<std::size_t>(BuildPhase::linearise)]; }},
    {"solve", [](const ServerLoad& l) { return l.patch_ms[static_cast<std::size_t>(BuildPhase::solve)]; }},
    {"basis", [](const ServerLoad& l) { return l.patch_ms[static_cast<std::size_t>(BuildPhase::basis)]; }},
    {"project", [](const ServerLoad& l) { return l.patch_ms[static_cast<std::size_t>(BuildPhase::project)]; }},
    {"rollouts", [](const ServerLoad& l) { return l.patch_ms[static_cast<std::size_t>(BuildPhase::rollouts)]; }},
    {"rest_of_patches", [](const ServerLoad& l) { return l.patch_ms[static_cast<std::size_t>(BuildPhase::other)]; }},
    {"take", [](const ServerLoad& l) { return l.take_ms; }},
    {"emit", [](const ServerLoad& l) { return l.emit_ms; }},
    {"all_but_step", [](const ServerLoad& l) { return l.beside_step_ms(); }},
    {"step", [](const ServerLoad& l) { return l.step_ms; }}};

ServerLoad measure(const LoadFlags& flags, const Scene& scene, int stations) {
  Progress progress(fmt::format("{} stations", stations));
  ReplayOptions options;
  options.progress = [&](const char*, double share) { progress.at(share); };
  options.scheme = available_scheme(flags.scheme);
  options.order = flags.order;
  options.rate_hz = flags.rate_hz;
  return server_load(scene, tools_apart(scene, stations, flags.apart_mm * 1e-3, flags.duration_s, flags.slide_mm * 1e-3), options,
                     processor_ns);
}

int run_load(const LoadFlags& flags) {
  const Scene scene = open_scene(flags.scene, flags.mesh_folders);
  if (scene.tool.contact != ContactKind::touch)
    throw InputError(flags.scene, "has tools that attach to one node", "a scene with \"contact\": \"touch\"");
  const auto out = make_output_folder(flags.out);
  const int fewer = (flags.stations + 1) / 2;
  const ServerLoad all = measure(flags, scene, flags.stations), half = measure(flags, scene, fewer);
  const double share = flags.rate_hz * 1e-3, more = std::max(1, flags.stations - fewer);
  Json summary{{"nodes", scene.body.nodes.size()},
               {"elements", scene.body.elements.size()},
               {"stations", flags.stations},
               {"rate_hz", flags.rate_hz},
               {"patches_a_frame", all.patches},
               {"up_bytes_per_s", all.up_bytes_per_s},
               {"down_bytes_per_s", all.down_bytes_per_s}};
  fmt::print("{} stations on {} ({} nodes) at {:g} Hz, {:.1f} patches a frame; processor time\n{:<16} {:>10} {:>11} {:>26}\n",
             flags.stations, scene.name, scene.body.nodes.size(), flags.rate_hz, all.patches, "", "ms a frame", "% of a core",
             "a further station, % more");
  for (const Row& row : kRows) {
    const double ms = row.ms(all), further_ms = (ms - row.ms(half)) / more;
    fmt::print("{:<16} {:>10.3f} {:>11.2f} {:>26.2f}\n", row.name, ms, 100 * ms * share, 100 * further_ms * share);
    summary["parts"][row.name] = {
        {"ms_a_frame", ms}, {"core_share", ms * share}, {"core_share_of_a_further_station", further_ms * share}};
  }
  fmt::print("a station sends {:.1f} kB/s and gets {:.1f} kB/s\n{}\n", all.up_bytes_per_s * 1e-3, all.down_bytes_per_s * 1e-3,
             (out / "summary.json").string());
  write_json(out / "summary.json", summary);
  return 0;
}

}  // namespace

void add_load(CLI::App& app, Run& run) {
  auto flags = std::make_shared<LoadFlags>();
  CLI::App* c = app.add_subcommand("load", "what a room full of stations costs its server, part by part");
  c->add_option("--scene", flags->scene, "scene file (JSON) with touch contact")->type_name("FILE")->required();
  add_mesh_folders(*c, flags->mesh_folders);
  c->add_option("--stations", flags->stations, "hands on the body; half as many are measured beside them")
      ->check(number_from(2, kMaxStations))
      ->capture_default_str();
  c->add_option("--apart-mm", flags->apart_mm, "distance between neighbours")
      ->check(number_from<double>(0, 1000))
      ->capture_default_str();
  c->add_option("--slide-mm", flags->slide_mm, "how far every other tool slides to and fro")
      ->check(number_from<double>(0, 100))
      ->capture_default_str();
  c->add_option("--duration-s", flags->duration_s, "length of the motions")
      ->check(number_from<double>(1.5, 600))
      ->capture_default_str();
  c->add_option("--rate-hz", flags->rate_hz, "frames a second")
      ->check(number_from<double>(kMinRateHz, kMaxRateHz))
      ->capture_default_str();
  c->add_option("--scheme", flags->scheme, "how patches are made")->type_name("NAME")->capture_default_str();
  c->add_option("--order", flags->order, "states of a patch, 0: the scheme's default")->check(number_from(0, 2 * kMaxModes));
  c->add_option("--out", flags->out, "folder for summary.json")->type_name("DIR")->required();
  c->callback([flags, &run] { run = [flags] { return run_load(*flags); }; });
}

}  // namespace palpate
