// Section `limits` of palpate-lab paper: fidelity against stiffness ratio and depth, with the real cores in virtual time.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>

#include "bench/fidelity/reference.hpp"
#include "bench/fidelity/replay.hpp"
#include "bench/lab/experiments.hpp"
#include "bench/lab/link_flags.hpp"
#include "bench/lab/parallel.hpp"
#include "bench/output/output.hpp"
#include "bench/output/plot.hpp"
#include "bench/paper/cube.hpp"
#include "common/base/minimum_jerk.hpp"

namespace palpate {
namespace {

/// One curve: fidelity of a scheme over the varied quantity (a ratio of stiffness, or a depth in mm).
struct LimitCurve {
  std::string body;
  Scheme scheme = Scheme::port;
  double rtt_ms = 0;
  std::vector<double> at, snr_db;
};

struct Limits {
  std::vector<LimitCurve> flaws;   ///< over the ratio of stiff to soft springs
  std::vector<LimitCurve> depths;  ///< over the mean depth of the excursion [mm], scheme port: linear and stiffening springs
};

struct LimitsPlan {
  std::vector<double> ratios, depths_mm, rtt_ms;
  double motion_s = 2;
};

constexpr Flaw kFlaws[] = {Flaw::soft_below, Flaw::stiff_inside, Flaw::stiff_at_top, Flaw::torn};
constexpr double kPaperDepthMm = 10;

/// The base excursion of scenes/motions, scaled: mean depth, +-40 % of it at 1.5 Hz, 3 % at 9 Hz, and sideways 40 and 30 % at 1.1
/// and 0.7 Hz, ramped in over 0.25 s.
Motion excursion(const Vec3& home, double depth_m, double duration_s) {
  std::vector<MotionPoint> points;
  const int ticks = static_cast<int>(duration_s * kHapticRateHz);
  for (int i = 0; i <= ticks; ++i) {
    const double t = static_cast<double>(i) / kHapticRateHz, ramp = depth_m * minimum_jerk(t / 0.25);
    const auto wave = [&](double share, double hz) { return share * std::sin(2 * std::numbers::pi * hz * t); };
    points.push_back({t, home + ramp * Vec3(wave(0.4, 1.1), wave(0.3, 0.7), -(1 + wave(0.4, 1.5) + wave(0.03, 9)))});
  }
  return Motion(std::move(points), "excursion");
}

/// A body and a motion, and the curves to which its runs add one point each.
struct Case {
  Scene scene;
  double depth_mm = 0, at = 0;
  std::string body;
  std::vector<Scheme> schemes;
};

/// One reference serves all schemes and delays: without a simulated device the tool's path is the motion itself.
std::vector<LimitCurve> run_case(const Case& c, const LimitsPlan& plan) {
  const Motion motion = excursion(home_of(c.scene), c.depth_mm * 1e-3, plan.motion_s);
  std::vector<LimitCurve> points;
  const ReferenceForce reference = reference_of(c.scene, motion);
  for (const Scheme scheme : c.schemes)
    for (const double rtt_ms : plan.rtt_ms) {
      ReplayOptions options;
      options.scheme = scheme;
      options.link.latency = from_seconds(rtt_ms * 0.5e-3);
      options.references = {&reference, 1};
      const ReplayResult run = replay(c.scene, motion, options, [] { return std::int64_t{0}; });
      points.push_back({c.body, scheme, rtt_ms, {c.at}, {run.fidelity.snr_db}});
    }
  return points;
}

std::vector<LimitCurve> run_cases(const std::vector<Case>& cases, const LimitsPlan& plan) {
  std::vector<std::vector<LimitCurve>> points(cases.size());
  run_all(cases.size(), [&](std::size_t i) { points[i] = run_case(cases[i], plan); });
  std::vector<LimitCurve> curves;
  for (const auto& group : points)
    for (const LimitCurve& p : group) {
      const auto same = [&](const LimitCurve& c) { return c.body == p.body && c.scheme == p.scheme && c.rtt_ms == p.rtt_ms; };
      const auto curve = std::find_if(curves.begin(), curves.end(), same);
      if (curve == curves.end()) {
        curves.push_back(p);
      } else {
        curve->at.push_back(p.at[0]);
        curve->snr_db.push_back(p.snr_db[0]);
      }
    }
  return curves;
}

std::vector<Scheme> shown_schemes() {
  std::vector<Scheme> schemes;
  for (const Scheme s : available_schemes())
    if (s != Scheme::hold) schemes.push_back(s);
  return schemes;
}

void write_curves(const std::filesystem::path& file, const std::string& axis, const std::vector<LimitCurve>& curves) {
  std::string csv = axis;
  for (const LimitCurve& c : curves) csv += fmt::format(",{} {} {:g}ms snr_db", c.body, name_of(c.scheme), c.rtt_ms);
  csv += '\n';
  for (std::size_t i = 0; i < curves[0].at.size(); ++i) {
    csv += fmt::format("{:g}", curves[0].at[i]);
    for (const LimitCurve& c : curves) csv += fmt::format(",{:.3f}", c.snr_db[i]);
    csv += '\n';
  }
  write_text(file, csv);
}

/// Draws one panel per body: colours for schemes, dashes for the longest round trip.
void plot_flaws(const std::filesystem::path& out, const std::vector<LimitCurve>& curves, const LimitsPlan& plan) {
  const std::vector<Scheme> schemes = shown_schemes();
  std::vector<Panel> panels;
  for (const Flaw flaw : kFlaws) {
    // One legend for all panels.
    Panel panel{fmt::format("{} [dB]", name_of(flaw)), {}, false, panels.empty() ? "set yrange [-35:55]" : "unset key"};
    for (std::size_t k = 0; k < curves.size(); ++k) {
      const LimitCurve& c = curves[k];
      if (c.body != name_of(flaw) || (c.rtt_ms != plan.rtt_ms.front() && c.rtt_ms != plan.rtt_ms.back())) continue;
      const auto colour = std::find(schemes.begin(), schemes.end(), c.scheme) - schemes.begin();
      const bool delayed = c.rtt_ms != plan.rtt_ms.front();
      panel.curves.push_back({fmt::format("1:{}", k + 2),
                              fmt::format("{}, {:g} ms", name_of(c.scheme), c.rtt_ms),
                              static_cast<int>(colour) + 1,
                              {},
                              delayed ? "linespoints dt 2" : "linespoints"});
    }
    panels.push_back(panel);
  }
  plot_csv(out / "flaws.csv", out / "flaws.svg", "Fidelity where the body is not of one piece (SNR; 20 dB: an error of a tenth)",
           "ratio of stiff to soft springs", panels,
           {.setup = "set logscale x\nset xtics (1, 3, 10, 30, 100)\nset xrange [0.95:105]"});
}

void plot_depths(const std::filesystem::path& out, const std::vector<LimitCurve>& curves) {
  std::vector<Panel> panels;
  for (std::size_t k = 0; k < curves.size(); ++k) {
    const bool begins = k == 0 || curves[k].body != curves[k - 1].body;
    if (begins) panels.push_back({fmt::format("{}: SNR [dB]", curves[k].body), {}, false, "set yrange [0:80]"});
    panels.back().curves.push_back({fmt::format("1:{}", k + 2),
                                    fmt::format("RTT {:g} ms", curves[k].rtt_ms),
                                    static_cast<int>(panels.back().curves.size()) + 1,
                                    {},
                                    "linespoints"});
  }
  plot_csv(out / "depths.csv", out / "depths.svg", "What is left to scheme port: the body's own nonlinearity",
           "mean depth of the excursion [mm]", panels);
}

LimitsPlan limits_plan(bool quick) {
  if (quick) return {{1, 100}, {2, 10}, {0, 150}, 0.5};
  return {{1, 3, 10, 30, 100}, {2, 4, 6, 8, 10, 12, 15}, {0, 50, 150}, 1.6};
}

Limits find_limits(const LimitsPlan& plan, const std::filesystem::path& out) {
  std::vector<Case> flaws, depths;
  for (const Flaw flaw : kFlaws)
    for (const double ratio : plan.ratios)
      flaws.push_back({flawed_cube(flaw, ratio), kPaperDepthMm, ratio, std::string(name_of(flaw)), shown_schemes()});
  for (const bool stiffening : {false, true})
    for (const double depth_mm : plan.depths_mm) {
      Scene scene = paper_cube(ContactKind::attach);
      if (stiffening) {
        scene.body.law = SpringLaw::stiffening;
        scene.body.stiffening = 10;
      }
      depths.push_back(
          {std::move(scene), depth_mm, depth_mm, stiffening ? "stiffening springs" : "linear springs", {Scheme::port}});
    }
  Limits limits{run_cases(flaws, plan), run_cases(depths, plan)};
  write_curves(out / "flaws.csv", "stiffness_ratio", limits.flaws);
  write_curves(out / "depths.csv", "depth_mm", limits.depths);
  plot_flaws(out, limits.flaws, plan);
  plot_depths(out, limits.depths);
  return limits;
}

const LimitCurve& find(const std::vector<LimitCurve>& curves, std::string_view body, Scheme scheme, double rtt_ms) {
  return *std::find_if(curves.begin(), curves.end(),
                       [&](const LimitCurve& c) { return c.body == body && c.scheme == scheme && c.rtt_ms == rtt_ms; });
}

std::string from_to(const LimitCurve& c, const char* unit) {
  return fmt::format("{:.0f} dB at {:g}{}, {:.0f} dB at {:g}{}", c.snr_db.front(), c.at.front(), unit, c.snr_db.back(),
                     c.at.back(), unit);
}

struct Claim {
  Flaw flaw;
  const char *what, *paper;
  bool ring_fails;
  const char* reason;
};

constexpr Claim kClaims[] = {
    {Flaw::soft_below, "deep tissue softer than the surface", "violates the dominance of local states", true, ""},
    {Flaw::stiff_at_top, "a stiff lump under the tool", "inhomogeneous material: may violate it", true,
     "The ring lies inside the lump, and what gives way lies around it."},
    {Flaw::stiff_inside, "a stiff lump deep inside", "inhomogeneous material: may violate it", false,
     "Far from the tool a lump does no harm: it makes the nodes that ring holds still move less."},
    {Flaw::torn, "a torn layer two cells below the surface", "discontinuities away from the contact violate it", true, ""}};

}  // namespace

PaperSection paper_limits(const std::filesystem::path& folder, bool quick) {
  constexpr double kFailsDb = 6;
  const auto out = make_output_folder(folder.string());
  const LimitsPlan plan = limits_plan(quick);
  const Limits limits = find_limits(plan, out);
  PaperSection s;
  s.title = "Section 7: limits of local models";
  s.text =
      "The 6x6x6 cube with one flaw at a time, stiffness ratios from 1 to 100, grasped and moved 10 mm deep with the base "
      "excursion at "
      "20 Hz; fidelity against the full model at 1 kHz. Then the homogeneous cube, deeper and deeper, with scheme port: a linear "
      "patch "
      "is true as far as the body is linear over its prediction horizon.";
  for (const Claim& claim : kClaims) {
    const LimitCurve& ring = find(limits.flaws, name_of(claim.flaw), Scheme::ring, plan.rtt_ms.front());
    const LimitCurve& port = find(limits.flaws, name_of(claim.flaw), Scheme::port, plan.rtt_ms.front());
    const bool fails = ring.snr_db.back() < ring.snr_db.front() - kFailsDb;
    s.findings.push_back({fmt::format("{}: ring by stiffness ratio", claim.what), claim.paper, from_to(ring, ":1"),
                          fails == claim.ring_fails ? Verdict::agrees : Verdict::differs, claim.reason});
    s.findings.push_back({fmt::format("{}: port", claim.what), "", from_to(port, ":1"), Verdict::beyond, ""});
  }
  for (const char* body : {"linear springs", "stiffening springs"})
    for (const double rtt_ms : {plan.rtt_ms.front(), plan.rtt_ms.back()}) {
      const LimitCurve& port = find(limits.depths, body, Scheme::port, rtt_ms);
      s.findings.push_back({fmt::format("deeper excursions, {}, port, RTT {:g} ms", body, rtt_ms),
                            "significant geometric nonlinearity violates it", from_to(port, " mm"),
                            port.snr_db.back() < port.snr_db.front() ? Verdict::agrees : Verdict::differs, ""});
    }
  s.pictures = {
      {out / "flaws.svg", "SNR of the displayed force against the ratio of stiff to soft springs, for no delay and the longest."},
      {out / "depths.svg", "SNR of scheme port against the mean depth of the excursion."}};
  return s;
}

}  // namespace palpate
