#include "bench/lab/stability_guided.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <vector>

#include "bench/lab/parallel.hpp"
#include "bench/measure/guided_hand.hpp"
#include "bench/output/output.hpp"
#include "bench/output/plot.hpp"
#include "bench/paper/cube.hpp"
#include "common/base/sort_stably.hpp"

namespace palpate {
namespace {

constexpr double kTipM = 0.020, kWidthM = 0.2;

Scene scene_for_guidance() {
  Scene scene = paper_cube(ContactKind::touch, kWidthM);
  scene.tool.radius_m = kTipM;
  return scene;
}

std::string row_of(const GuidedPoint& p, const GuidedResult& r) {
  return fmt::format(
      "{},{},{:g},{:g},{:g},{:g},{},{:.4g},{:.4g},{:.4g},{:.4g},{:.4g},{:.4g},{:.4g},{:.4g},{:.4g},{:.4g},{:.4g},{:.4g}\n",
      p.touches ? "body" : "air", p.hand, p.guide_rtt_ms, p.guided_rtt_ms, p.jitter_ms, p.loss_pct,
      r.stable() ? "stable"
      : r.lost   ? "lost"
                 : "unrest",
      r.stiffness_n_m, r.damping_n_s_m, 1e3 * r.error_rms_m, 1e3 * r.lag_s, 1e3 * r.lagged_rms_m, r.guide_mean_n, r.guided_mean_n,
      r.guide_max_n, r.guided_max_n, r.step_max_n, 1e3 * r.generated_j, 1e3 * std::max(r.guide.tail_m(), r.guided.tail_m()));
}

void print_row(const GuidedPoint& p, const GuidedResult& r) {
  const std::string link = p.loss_pct > 0
                               ? fmt::format("{:g}/{:g} +-{:g}, {:g} %", p.guide_rtt_ms, p.guided_rtt_ms, p.jitter_ms, p.loss_pct)
                               : fmt::format("{:g}/{:g}", p.guide_rtt_ms, p.guided_rtt_ms);
  fmt::print(
      "{:<5} {:<8} {:<18} {:<7} {:>8.0f} {:>9.1f} {:>11.1f} {:>9.0f} {:>12.1f} {:>6.2f} {:>6.2f} {:>8.3f} {:>9.2f} {:>9.2f}\n",
      p.touches ? "body" : "air", p.hand, link,
      r.stable() ? "stable"
      : r.lost   ? "lost"
                 : "unrest",
      r.stiffness_n_m, r.damping_n_s_m, 1e3 * r.error_rms_m, 1e3 * r.lag_s, 1e3 * r.lagged_rms_m, r.guide_mean_n, r.guided_mean_n,
      r.step_max_n, 1e3 * r.generated_j, 1e3 * std::max(r.guide.tail_m(), r.guided.tail_m()));
}

/// Plots error, lag and forces of the led hand in the air against the sum of the round trips.
void plot_guided(const std::filesystem::path& out, const std::vector<GuidedPoint>& points,
                 const std::vector<GuidedResult>& results) {
  std::vector<std::pair<double, const GuidedResult*>> led;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (!points[i].touches && points[i].hand == "led" && points[i].loss_pct == 0)
      led.emplace_back(points[i].guide_rtt_ms + points[i].guided_rtt_ms, &results[i]);
  sort_stably(led.begin(), led.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  std::string csv = "round_trips_ms,error_mm,lagged_error_mm,guide_n,guided_n,stiffness_n_m\n";
  for (const auto& [round_ms, r] : led)
    fmt::format_to(std::back_inserter(csv), "{:g},{:.4g},{:.4g},{:.4g},{:.4g},{:.4g}\n", round_ms, 1e3 * r->error_rms_m,
                   1e3 * r->lagged_rms_m, r->guide_mean_n, r->guided_mean_n, r->stiffness_n_m);
  write_text(out / "led.csv", csv);
  plot_csv(out / "led.csv", out / "guided.svg", "a led hand in the air", "sum of the two round trips [ms]",
           {{"distance [mm]", {{"1:2", "to the guide's tool", 1}, {"1:3", "to its path", 0}}},
            {"force [N]", {{"1:4", "on the guide", 1}, {"1:5", "on the guided hand", 2}}},
            {"stiffness [N/m]", {{"1:6", "of the spring", 1}}}},
           {.rows = led.size()});
}

}  // namespace

int run_guided_sweep(const GuidedSweep& sweep) {
  const auto out = make_output_folder(sweep.out);
  const Scene scene = scene_for_guidance();
  const std::vector<GuidedPoint> points = guided_points(sweep.quick, sweep.seed);
  std::vector<GuidedResult> results(points.size());
  run_all(
      points.size(),
      [&](std::size_t i) {
        results[i] = measure_guided(scene, points[i]);
        results[i].loops.clear();
      },
      sweep.jobs, "guided hands");
  std::string csv =
      "where,hand,guide_rtt_ms,guided_rtt_ms,jitter_ms,loss_pct,verdict,stiffness_n_m,damping_n_s_m,error_rms_mm,lag_ms,"
      "lagged_rms_mm,guide_mean_n,guided_mean_n,guide_max_n,guided_max_n,step_max_n,generated_mj,tail_mm\n";
  fmt::print("{:<5} {:<8} {:<18} {:<7} {:>8} {:>9} {:>11} {:>9} {:>12} {:>6} {:>6} {:>8} {:>9} {:>9}\n", "where", "hand",
             "round trips [ms]", "verdict", "K [N/m]", "b [N s/m]", "apart [mm]", "lag [ms]", "to path [mm]", "F1 [N]", "F2 [N]",
             "step [N]", "gave [mJ]", "tail [mm]");
  std::size_t stable = 0, passive = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const GuidedResult& r = results[i];
    csv += row_of(points[i], r);
    print_row(points[i], r);
    stable += r.stable();
    passive += r.generated_j <= r.bound_j;
  }
  fmt::print(
      "\nApart: distance of the two tools while the guide moves (rms); lag and to path: shift of the guide's path for which that "
      "is "
      "least,\nand the least. F1, F2: mean force of the coupling on the guide and on the guided hand; step: its largest change "
      "in a "
      "tick; gave: energy\nthat the coupling gave beyond what it had absorbed, of which the beginning of a hold allows {:.0f} "
      "mJ; "
      "tail: motion of stable points at the end.\n{} of {} points are stable, {} gave no more than that.\n",
      results.empty() ? 0.0 : 1e3 * results.front().bound_j, stable, points.size(), passive);
  write_text(out / "guided.csv", csv);
  plot_guided(out, points, results);
  write_json(out / "summary.json", {{"points", points.size()}, {"stable", stable}, {"passive", passive}});
  fmt::print("{}\n", (out / "guided.csv").string());
  return stable == points.size() && passive == points.size() ? 0 : 1;
}

}  // namespace palpate
