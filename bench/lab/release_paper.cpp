// Compares the paper's figure 18 and its section on stability with our results.
#include <fmt/format.h>

#include <cmath>

#include "bench/lab/experiments.hpp"
#include "bench/lab/link_flags.hpp"
#include "bench/lab/release_sweep.hpp"
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

struct Runs {
  std::vector<ReleaseResult> loosened, let_go;  ///< with the parameters in kShown
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
    show("let_go", runs.let_go, panels[1]);
    options.hand_after = *hand_from_name("light");
    show("loosened", runs.loosened, panels[0]);
  }
  plot_csv(panels[0].curves[0].csv, out / "fig18.svg",
           "Figure 18: the grip on a device of 75 g loosens, or lets go, at 0 s (20 Hz, no delay)", "time [s]", panels,
           {.setup = "set xrange [-0.5:2.1]"});
  return runs;
}

std::string stable_range(const RateSweep& points, Scheme scheme) {
  std::string stable;
  std::size_t of = 0, count = 0;
  for (const ReleasePoint& p : points) {
    if (p.scheme != scheme) continue;
    ++of;
    if (!p.verdict.stable) continue;
    ++count;
    stable += fmt::format("{}{:g}", stable.empty() ? "" : ", ", p.rtt_ms);
  }
  if (count == of) return fmt::format("at all {} round trips up to {:g} ms", of, points.back().rtt_ms);
  return count == 0 ? "at none of the round trips" : fmt::format("at {} of {} round trips: {} ms", count, of, stable);
}

}  // namespace

PaperSection paper_release(const std::filesystem::path& folder, bool quick) {
  const auto out = make_output_folder(folder.string());
  const Scene scene = paper_cube(ContactKind::attach);
  const Runs runs = run_figure(scene, out);
  const ReleaseSweep sweep = sweep_release(scene, ReleaseOptions{}, quick, out);
  PaperSection s;
  s.title = "Stability implications, figure 18: the grip is let go";
  s.command = "palpate-lab release --sweep --out DIR";
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
  finding("let go, held force (hold)", "oscillates", runs.let_go[0], false, "");
  std::string friction =
      "The local model holds the far nodes still, so it is stiffer than the body, and every new frame corrects it: "
      "with a frictionless device that is a swing without end.";
  if (!sweep.damping_n_s_m.empty())
    for (std::size_t k = 0; k < sweep.damping_n_s_m.size(); ++k)
      if (available_schemes()[k] == Scheme::ring)
        friction +=
            fmt::format(" With {:g} N s/m, about what a Phantom's bearings (0.04 N) take at this speed, it comes to rest.",
                        sweep.damping_n_s_m[k]);
  finding("let go, local model (ring)", "does not oscillate", runs.let_go[1], true, friction);
  finding("let go, whole-body patch (port)", "", runs.let_go[2], true, "");
  if (s.findings.back().verdict == Verdict::agrees) s.findings.back().verdict = Verdict::beyond;
  for (const RateSweep& points : sweep.rates)
    for (const Scheme scheme : available_schemes())
      s.findings.push_back({fmt::format("{} at {:g} Hz: comes to rest", name_of(scheme), points[0].rate_hz), "",
                            stable_range(points, scheme), Verdict::beyond, ""});
  for (std::size_t k = 0; k < sweep.damping_n_s_m.size(); ++k)
    s.findings.push_back(
        {fmt::format("friction a device needs with {}, no delay", name_of(available_schemes()[k])), "",
         std::isfinite(sweep.damping_n_s_m[k]) ? fmt::format("{:g} N s/m", sweep.damping_n_s_m[k]) : "more than 20 N s/m",
         Verdict::beyond, ""});
  s.pictures = {{out / "fig18.svg",
                 "The tool after the grip has loosened (top) and after it has let go (bottom). Beyond 10 mm curves are cut off."},
                {out / "release_map.svg", "What is left of the motion at the end of each run; lost: the tool went 0.2 m astray."},
                {out / "release_decay.svg", "Peak-to-peak motion over the run, window by window, for three round trips."}};
  return s;
}

}  // namespace palpate
