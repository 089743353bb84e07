// Section `release` of palpate-lab paper: a hand lets go of the device; does it come to rest? Figure 18 of the paper and its
// section on stability. `palpate-lab stability` maps it over round trips, rates and links.
#include <fmt/format.h>

#include <cmath>
#include <iterator>
#include <limits>

#include "bench/lab/experiments.hpp"
#include "bench/measure/release.hpp"
#include "bench/output/output.hpp"
#include "bench/output/plot.hpp"
#include "bench/paper/cube.hpp"

namespace palpate {
namespace {

constexpr Scheme kShown[] = {Scheme::hold, Scheme::ring, Scheme::port};

std::string words(const ReleaseResult& r) {
  const auto& p = r.verdict.peak_to_peak_m;
  if (r.loop.lost)
    return fmt::format("grows to {:.0f} mm within {:.1f} s", p.back() * 1e3, static_cast<double>(p.size()) * kWindowS);
  return fmt::format("{:.1f} mm in the first 0.3 s, {:.2g} mm {:.1f} s later", p.front() * 1e3, p.back() * 1e3,
                     static_cast<double>(p.size() - 1) * kWindowS);
}

/// Writes one run as CSV: t_s from the release on; depth and force along the direction into the body.
void write_release(const std::filesystem::path& file, const Scene& scene, const ReleaseResult& r) {
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

/// Least viscous friction of the device with which it comes to rest [N s/m]; infinity if there is none up to 20 N s/m.
double damping_needed(const Scene& scene, ReleaseOptions options) {
  for (const double damping : {0.0, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0}) {
    options.device_damping_n_s_m = damping;
    if (release(scene, options).verdict.stable) return damping;
  }
  return std::numeric_limits<double>::infinity();
}

struct Runs {
  std::vector<ReleaseResult> loosened, released;  ///< with the parameters in kShown
};

Runs run_figure(const Scene& scene, const std::filesystem::path& out) {
  Runs runs;
  std::vector<Panel> panels{{"grip loosened: depth [mm]", {}, false, "set yrange [-10:10]"},
                            {"let go: depth [mm]", {}, false, "set yrange [-10:10]"}};
  for (const Scheme scheme : kShown) {
    ReleaseOptions options;
    options.scheme = scheme;
    const auto show = [&](const std::string& name, std::vector<ReleaseResult>& results, Panel& panel) {
      results.push_back(release(scene, options));
      const auto csv = out / fmt::format("{}_{}.csv", name, name_of(scheme));
      write_release(csv, scene, results.back());
      panel.curves.push_back({"1:2", std::string(name_of(scheme)), static_cast<int>(results.size()), csv});
    };
    show("released", runs.released, panels[1]);
    options.hand_after = *hand_from_name("light");
    show("loosened", runs.loosened, panels[0]);
  }
  plot_csv(panels[0].curves[0].csv, out / "fig18.svg",
           "Figure 18: the grip on a device of 75 g loosens, or lets go, at 0 s (20 Hz, no delay)", "time [s]", panels,
           {.setup = "set xrange [-0.5:2.1]"});
  return runs;
}

}  // namespace

PaperSection paper_release(const std::filesystem::path& folder, bool quick) {
  const auto out = make_output_folder(folder.string());
  const Scene scene = paper_cube(ContactKind::attach);
  const Runs runs = run_figure(scene, out);
  PaperSection s;
  s.title = "Stability implications, figure 18: the grip is let go";
  s.text =
      "A simulated Phantom of 75 g without friction holds the top node of the 6x6x6 cube; a hand presses, then its grip loosens "
      "to a "
      "light one (0.1 kg, 2 N s/m, 100 N/m) or opens. The real client and server run in virtual time at 20 Hz, position read in "
      "steps of 0.03 mm. Stable means: motion in windows of 0.3 s falls to a quarter and its kinetic energy to a sixteenth, or "
      "to rest.";
  const auto finding = [&](std::string what, std::string paper, const ReleaseResult& r, bool wants_stable, std::string reason) {
    const bool agrees = r.verdict.stable == wants_stable;
    s.findings.push_back(
        {std::move(what), std::move(paper), words(r), agrees ? Verdict::agrees : Verdict::differs, std::move(reason)});
  };
  finding("grip loosened, held force (hold)", "oscillates", runs.loosened[0], false, "");
  finding("grip loosened, local model (ring)", "does not oscillate", runs.loosened[1], true,
          "What is left is less than three steps of the device's reading, but its energy does not go on falling: the local model "
          "holds the far nodes still, so every new frame corrects it a little.");
  finding("let go, held force (hold)", "oscillates", runs.released[0], false, "");
  std::string friction =
      "The local model holds the far nodes still, so it is stiffer than the body, and every new frame corrects it: "
      "with a frictionless device that is a swing without end.";
  ReleaseOptions ring;
  ring.scheme = Scheme::ring;
  if (!quick)
    friction += fmt::format(" With {:g} N s/m, about what a Phantom's bearings (0.04 N) take at this speed, it comes to rest.",
                            damping_needed(scene, ring));
  finding("let go, local model (ring)", "does not oscillate", runs.released[1], true, friction);
  finding("let go, whole-body patch (port)", "", runs.released[2], true, "");
  if (s.findings.back().verdict == Verdict::agrees) s.findings.back().verdict = Verdict::beyond;
  s.pictures = {
      {out / "fig18.svg",
       "The tool after the grip has loosened (top) and after it has let go (bottom). Beyond 10 mm curves are cut off."}};
  return s;
}

}  // namespace palpate
