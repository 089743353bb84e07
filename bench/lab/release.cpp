// palpate-lab release: a hand lets go of the device; does the display bring it to rest? Figure 18 of the paper.
#include "bench/measure/release.hpp"

#include <fmt/format.h>

#include <cmath>
#include <map>

#include "bench/lab/experiments.hpp"
#include "bench/lab/flags.hpp"
#include "bench/lab/link_flags.hpp"
#include "bench/lab/release_sweep.hpp"
#include "bench/output/output.hpp"
#include "bench/output/plot.hpp"
#include "bench/paper/cube.hpp"
#include "common/base/error.hpp"
#include "common/command_line/mesh_folders.hpp"
#include "server/body/unload.hpp"

namespace palpate {
namespace {

const std::map<std::string, PassivityMode> kPassivity{
    {"off", PassivityMode::off}, {"observe", PassivityMode::observe}, {"on", PassivityMode::on}};

struct ReleaseFlags {
  std::string scene, scheme = "port", hand = "reference", hand_after = "free", passivity = "off", out;
  MeshFolders mesh_folders;
  bool sweep = false;
  int order = 0;
  double depth_mm = 10, tremor_mm = 0, force_step_n = 0, device_damping_n_s_m = 0, observe_s = 0;
  LinkFlags link;
};

ReleaseOptions options_of(const ReleaseFlags& f) {
  ReleaseOptions o;
  o.scheme = available_scheme(f.scheme);
  o.order = f.order;
  o.rate_hz = f.link.rate_hz;
  o.link = f.link.one_way();
  o.seed = f.link.seed;
  o.compute = from_seconds(f.link.compute_ms * 1e-3);
  o.passivity = kPassivity.at(f.passivity);
  o.hand = *hand_from_name(f.hand);
  o.hand_after = *hand_from_name(f.hand_after);
  o.depth_m = f.depth_mm * 1e-3;
  o.tremor_m = f.tremor_mm * 1e-3;
  o.force_step_n = f.force_step_n;
  o.device_damping_n_s_m = f.device_damping_n_s_m;
  o.observe_s = f.observe_s;
  return o;
}

std::string in_mm(const std::vector<double>& windows_m) {
  std::string s;
  for (const double p : windows_m) s += fmt::format("{}{:.{}f}", s.empty() ? "" : " / ", p * 1e3, p < 0.01 ? 1 : 0);
  return s;
}

Json summary(const ReleaseResult& r) {
  Json windows_mm = Json::array(), kinetic_mj = Json::array();
  for (const double p : r.verdict.peak_to_peak_m) windows_mm.push_back(p * 1e3);
  for (const double t : r.verdict.kinetic_max_j) kinetic_mj.push_back(t * 1e3);
  return {{"stable", r.verdict.stable ? 1 : 0},
          {"peak_to_peak_mm", windows_mm},
          {"window_s", kWindowS},
          {"kinetic_max_mj", kinetic_mj},
          {"growth_1_s", r.verdict.growth_1_s},
          {"lost", r.loop.lost ? 1 : 0},
          {"depth_mm", r.depth_m * 1e3},
          {"released_mj", r.released_j * 1e3},
          {"display_min_mj", r.display_min_j * 1e3},
          {"observer_min_mj", r.loop.guard.energy_min_j * 1e3},
          {"damped_ticks", r.loop.guard.damped},
          {"patches_used", r.loop.patches_used},
          {"hand_over_step_max_n", r.hand_over_step_max_n}};
}

int run_one(const ReleaseFlags& flags, const Scene& scene) {
  const ReleaseResult r = release(scene, options_of(flags));
  const auto out = make_output_folder(flags.out);
  write_release(out / "release.csv", scene, r);
  write_json(out / "summary.json", summary(r));
  plot_csv(out / "release.csv", out / "release.svg",
           fmt::format("{}, {} at {:g} Hz, RTT {:g} ms: the hand lets go at 0 s", scene.name, flags.scheme, flags.link.rate_hz,
                       flags.link.rtt_ms),
           "time since the release [s]",
           {{"depth [mm]", {{"1:2", "tool", 1}}},
            {"push on the hand [N]", {{"1:7", "rendered force", 1}}},
            {"energy [mJ]", {{"1:($12+$13)", "sum", 0}, {"1:13", "put into the display", 1}, {"1:12", "kinetic", 2}}}},
           {.rows = r.loop.ticks.size()});
  fmt::print("{} at {:g} Hz, RTT {:g} ms: {}; {:.1f} mm deep when let go\n", flags.scheme, flags.link.rate_hz, flags.link.rtt_ms,
             r.verdict.stable ? "comes to rest" : (r.loop.lost ? "NOT stable, the tool was lost" : "NOT stable"),
             r.depth_m * 1e3);
  fmt::print("  peak to peak in windows of 0.3 s [mm]: {}\n", in_mm(r.verdict.peak_to_peak_m));
  fmt::print("  growth {:+.2f} /s; lowest energy of the display {:.3g} mJ\n{}\n", r.verdict.growth_1_s, r.display_min_j * 1e3,
             (out / "summary.json").string());
  return 0;
}

int run_sweep(const ReleaseFlags& flags, const Scene& scene) {
  const auto out = make_output_folder(flags.out);
  const ReleaseSweep result = sweep_release(scene, options_of(flags), false, out);
  print_sweep(result);
  fmt::print("{}\n", (out / "summary.json").string());
  return 0;
}

int run_release(const ReleaseFlags& flags) {
  const Scene scene = flags.scene.empty() ? paper_cube(ContactKind::attach) : open_scene(flags.scene, flags.mesh_folders);
  return flags.sweep ? run_sweep(flags, scene) : run_one(flags, scene);
}

}  // namespace

void add_release(CLI::App& app, Run& run) {
  auto flags = std::make_shared<ReleaseFlags>();
  CLI::App* c = app.add_subcommand("release", "a hand lets go of the device: does it come to rest? (figure 18 of the paper)");
  c->add_option("--scene", flags->scene, "scene file (JSON) with a grasp; without: the cube of scenes/cube6.json")
      ->type_name("FILE");
  add_mesh_folders(*c, flags->mesh_folders);
  c->add_option("--scheme", flags->scheme, "how patches are made")->type_name("NAME");
  c->add_option("--order", flags->order, "states of a patch (twice its modes), 0: the scheme's default")
      ->check(number_from(0, 2 * kMaxModes));
  flags->link.add_to(*c);
  c->add_option("--hand", flags->hand, "grip that presses")->check(one_of({"light", "reference", "firm"}));
  c->add_option("--hand-after", flags->hand_after, "what is left of the grip at 0.5 s; free: nothing")
      ->check(one_of({"free", "light", "reference", "firm"}));
  c->add_option("--depth-mm", flags->depth_mm, "how deep the hand wants to press")->check(number_from<double>(0.1, 50));
  c->add_option("--tremor-mm", flags->tremor_mm, "of the hand, as the sine of the same power")->check(number_from<double>(0, 1));
  c->add_option("--force-step-n", flags->force_step_n, "in which the device renders force (a Phantom: 0.07)")
      ->check(number_from<double>(0, 1));
  c->add_option("--device-damping-n-s-m", flags->device_damping_n_s_m, "friction of the device itself")
      ->check(number_from<double>(0, 100));
  c->add_option("--passivity", flags->passivity, "of the guard: off shows the scheme alone")
      ->check(one_of({"off", "observe", "on"}));
  c->add_option("--observe-s", flags->observe_s, "time after the release, 0: 2.1 s and two round trips")
      ->check(number_from<double>(0, 60));
  c->add_flag("--sweep", flags->sweep, "all schemes over round trips of 0 to 1000 ms, at 20 and 10 Hz");
  c->add_option("--out", flags->out, "folder for CSV, summary.json and plots")->type_name("DIR")->required();
  c->callback([flags, &run] { run = [flags] { return run_release(*flags); }; });
}

}  // namespace palpate
