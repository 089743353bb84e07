// palpate-lab release: a hand lets go of the device; does the display bring it to rest? Figure 18 of the paper.
#include "bench/measure/release.hpp"

#include <fmt/format.h>

#include <cmath>
#include <iterator>
#include <map>

#include "bench/lab/experiments.hpp"
#include "bench/lab/flags.hpp"
#include "bench/lab/output.hpp"
#include "bench/lab/plot.hpp"
#include "bench/lab/release_sweep.hpp"
#include "bench/paper/cube.hpp"
#include "common/base/error.hpp"

namespace palpate {
namespace {

const std::map<std::string, PassivityMode> kPassivity{
    {"off", PassivityMode::off}, {"observe", PassivityMode::observe}, {"on", PassivityMode::on}};

struct Flags {
  std::string scene, scheme = "port", hand = "reference", hand_after = "free", passivity = "off", out;
  bool sweep = false;
  int order = 0;
  double depth_mm = 10, tremor_mm = 0, force_step_n = 0, device_damping_n_s_m = 0, observe_s = 0;
  LinkFlags link;
};

ReleaseOptions options_of(const Flags& f) {
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

/// t_s from the release on; depth along the push.
void write_trace(const std::filesystem::path& file, const Scene& scene, const ReleaseResult& r) {
  const Vec3 into = into_body(scene), home = r.loop.ticks[0].position;
  std::string csv = "t_s,depth_mm,x_mm,y_mm,z_mm,speed_m_s,push_n,fx_n,fy_n,fz_n,patch_age_ms,kinetic_mj,display_mj\n";
  for (std::size_t i = 0; i < r.loop.ticks.size(); ++i) {
    const LoopTick& t = r.loop.ticks[i];
    const Vec3 moved = 1e3 * (t.position - home);
    fmt::format_to(std::back_inserter(csv),
                   "{:.3f},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:g},{:.6g},{:.6g}\n",
                   static_cast<double>(i) * 1e-3 - kReleaseS, moved.dot(into), moved.x(), moved.y(), moved.z(), t.velocity.norm(),
                   -t.force.dot(into), t.force.x(), t.force.y(), t.force.z(), seconds(t.patch_age) * 1e3, 1e3 * t.kinetic_j,
                   1e3 * t.display_j);
  }
  write_text(file, csv);
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
          {"hand_over_step_max_n", r.loop.hand_over_step_max_n}};
}

int run_one(const Flags& flags, const Scene& scene) {
  const ReleaseResult r = release(scene, options_of(flags));
  const auto out = make_output_folder(flags.out);
  write_trace(out / "release.csv", scene, r);
  write_json(out / "summary.json", summary(r));
  plot_csv(out / "release.csv", out / "release.svg",
           fmt::format("{}, {} at {:g} Hz, RTT {:g} ms: the hand lets go at 0 s", scene.name, flags.scheme, flags.link.rate_hz,
                       flags.link.rtt_ms),
           "time since the release [s]",
           {{"depth [mm]", {{"1:2", "tool", 1}}},
            {"push on the hand [N]", {{"1:7", "rendered force", 1}}},
            {"energy [mJ]", {{"1:13", "held by the display", 1}, {"1:12", "kinetic", 2}, {"1:($12+$13)", "sum", 0}}}},
           {.rows = r.loop.ticks.size()});
  fmt::print("{} at {:g} Hz, RTT {:g} ms: {}; {:.1f} mm deep when let go\n", flags.scheme, flags.link.rate_hz, flags.link.rtt_ms,
             r.verdict.stable ? "comes to rest" : (r.loop.lost ? "NOT stable, the tool was lost" : "NOT stable"),
             r.depth_m * 1e3);
  fmt::print("  peak to peak in windows of 0.3 s [mm]: {}\n", in_mm(r.verdict.peak_to_peak_m));
  fmt::print("  growth {:+.2f} /s; lowest energy of the display {:.3g} mJ\n{}\n", r.verdict.growth_1_s, r.display_min_j * 1e3,
             (out / "summary.json").string());
  return 0;
}

struct Sweep {
  std::vector<SweepGrid> grids;
  std::vector<double> decays_ms;  ///< round trips of the first grid whose windows are drawn
  bool damping = true;
};

Sweep sweep_of(bool quick) {
  if (quick) return {{{20, {0, 100, 400}}, {10, {1000}}}, {0, 100}, false};
  return {{{20, {0, 20, 50, 100, 150, 200, 300, 400, 500, 600, 800, 1000}}, {10, {0, 100, 200, 400, 700, 1000}}},
          {0, 100, 400},
          true};
}

struct SweepResult {
  std::vector<std::vector<SweepPoint>> sweeps;
  std::vector<double> damping_n_s_m;  ///< needed at no delay and the first grid's rate, by scheme; empty when not asked for
};

SweepResult run_sweeps(const Scene& scene, const ReleaseOptions& base, const Sweep& sweep, const std::filesystem::path& out) {
  SweepResult result;
  for (const SweepGrid& grid : sweep.grids) {
    result.sweeps.push_back(sweep_release(scene, base, grid));
    const bool first = result.sweeps.size() == 1;
    write_sweep(out, result.sweeps.back(), first ? sweep.decays_ms : std::vector<double>{});
  }
  plot_sweep(out, out / "release_map.svg", result.sweeps);
  plot_decays(out, out / "release_decay.svg", sweep.decays_ms);
  if (!sweep.damping) return result;
  std::string csv = "scheme,damping_n_s_m\n";
  for (const Scheme scheme : available_schemes()) {
    ReleaseOptions options = base;
    options.scheme = scheme;
    options.rate_hz = sweep.grids[0].rate_hz;
    result.damping_n_s_m.push_back(damping_needed(scene, options));
    csv += fmt::format("{},{:g}\n", name_of(scheme), result.damping_n_s_m.back());
  }
  write_text(out / "damping.csv", csv);
  return result;
}

Json sweep_summary(const SweepResult& result) {
  Json json;
  for (const auto& points : result.sweeps)
    for (const SweepPoint& p : points) {
      Json windows_mm = Json::array();
      for (const double w : p.verdict.peak_to_peak_m) windows_mm.push_back(w * 1e3);
      json["schemes"][std::string(name_of(p.scheme))].push_back({{"rtt_ms", p.rtt_ms},
                                                                 {"rate_hz", p.rate_hz},
                                                                 {"stable", p.verdict.stable ? 1 : 0},
                                                                 {"lost", p.lost ? 1 : 0},
                                                                 {"growth_1_s", p.verdict.growth_1_s},
                                                                 {"peak_to_peak_mm", windows_mm}});
    }
  return json;
}

void print_sweep(const SweepResult& result) {
  fmt::print("\nMotion left in the last 0.6 s of the run [mm, peak to peak]; ! = not stable\n");
  for (const auto& points : result.sweeps) {
    fmt::print("\n  {:>4g} Hz, RTT [ms]", points[0].rate_hz);
    for (const SweepPoint& p : points)
      if (p.scheme == points[0].scheme) fmt::print("{:>8g}", p.rtt_ms);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const SweepPoint& p = points[i];
      if (i == 0 || points[i - 1].scheme != p.scheme) fmt::print("\n  {:<16}", name_of(p.scheme));
      fmt::print("{:>8}",
                 p.lost ? "lost !"
                        : fmt::format("{:.{}f}{}", p.last_m() * 1e3, p.last_m() < 0.01 ? 2 : 0, p.verdict.stable ? "  " : " !"));
    }
    fmt::print("\n");
  }
  fmt::print("\n");
}

int run_sweep(const Flags& flags, const Scene& scene) {
  const auto out = make_output_folder(flags.out);
  const SweepResult result = run_sweeps(scene, options_of(flags), sweep_of(false), out);
  print_sweep(result);
  write_json(out / "summary.json", sweep_summary(result));
  fmt::print("{}\n", (out / "summary.json").string());
  return 0;
}

int run_release(const Flags& flags) {
  const Scene scene = flags.scene.empty() ? paper_cube(ContactKind::attach) : load_scene(flags.scene);
  return flags.sweep ? run_sweep(flags, scene) : run_one(flags, scene);
}

}  // namespace

void add_release(CLI::App& app, Run& run) {
  auto flags = std::make_shared<Flags>();
  CLI::App* c = app.add_subcommand("release", "a hand lets go of the device: does it come to rest? (figure 18 of the paper)");
  c->add_option("--scene", flags->scene, "scene file (JSON) with a grasp; without: the cube of scenes/cube6.json");
  c->add_option("--scheme", flags->scheme, "how patches are made");
  c->add_option("--order", flags->order, "states of a patch (twice its modes), 0: the scheme's default")
      ->check(CLI::Range(0, 2 * kMaxModes));
  flags->link.add_to(*c);
  c->add_option("--hand", flags->hand, "grip that presses")->check(CLI::IsMember({"light", "reference", "firm"}));
  c->add_option("--hand-after", flags->hand_after, "what is left of the grip at 0.5 s; free: nothing")
      ->check(CLI::IsMember({"free", "light", "reference", "firm"}));
  c->add_option("--depth-mm", flags->depth_mm, "how deep the hand wants to press")->check(number_in(0.1, 50));
  c->add_option("--tremor-mm", flags->tremor_mm, "of the hand, as the sine of the same power")->check(number_in(0, 1));
  c->add_option("--force-step-n", flags->force_step_n, "in which the device renders force (a Phantom: 0.07)")
      ->check(number_in(0, 1));
  c->add_option("--device-damping-n-s-m", flags->device_damping_n_s_m, "friction of the device itself")->check(number_in(0, 100));
  c->add_option("--passivity", flags->passivity, "of the guard: off shows the scheme alone")
      ->check(CLI::IsMember({"off", "observe", "on"}));
  c->add_option("--observe-s", flags->observe_s, "time after the release, 0: 2.1 s and two round trips")->check(number_in(0, 60));
  c->add_flag("--sweep", flags->sweep, "all schemes over round trips of 0 to 1000 ms, at 20 and 10 Hz");
  c->add_option("--out", flags->out, "folder for CSV, summary.json and plots")->required();
  c->callback([flags, &run] { run = [flags] { return run_release(*flags); }; });
}

}  // namespace palpate
