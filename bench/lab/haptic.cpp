// Section `haptic` of palpate-lab paper: a Phantom in a hand touches the 6x6x6 cube; the force of the low-rate model compared
// with the displayed force. Figure 17 of the paper.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "bench/fidelity/replay.hpp"
#include "bench/lab/experiments.hpp"
#include "bench/output/output.hpp"
#include "bench/output/plot.hpp"
#include "bench/paper/cube.hpp"
#include "common/base/minimum_jerk.hpp"
#include "server/room/room.hpp"

namespace palpate {
namespace {

constexpr double kPullN = 0.07;  ///< one step of a Phantom's force

/// Motion onto the middle of the top, 8 mm deep, along the surface, a second and quicker push, off again [m], [s].
Motion touch_motion(const Vec3& home) {
  struct Stop {
    double t_s;
    Vec3 at;
  };
  const double down = -0.020;  // from the start of a tool to the surface
  const std::vector<Stop> stops{{0.0, {0, 0, 0}},
                                {0.15, {0, 0, 0}},
                                {0.55, {0, 0, down - 0.008}},
                                {0.9, {0, 0, down - 0.008}},
                                {1.5, {0.012, 0.006, down - 0.009}},
                                {1.8, {0.012, 0.006, down + 0.004}},
                                {2.0, {0.012, 0.006, down - 0.010}},
                                {2.2, {0.012, 0.006, down - 0.004}},
                                {2.4, {0.012, 0.006, down - 0.010}},
                                {2.8, {0.012, 0.006, 0}},
                                {3.0, {0.012, 0.006, 0}}};
  std::vector<MotionPoint> points;
  for (std::size_t k = 0; k + 1 < stops.size(); ++k) {
    const double length = stops[k + 1].t_s - stops[k].t_s;
    const int ticks = static_cast<int>(std::lround(length * kHapticRateHz));
    for (int i = 0; i < ticks; ++i) {
      const double u = static_cast<double>(i) / ticks, part = minimum_jerk(u);
      points.push_back({stops[k].t_s + u * length, home + stops[k].at + part * (stops[k + 1].at - stops[k].at)});
    }
  }
  points.push_back({stops.back().t_s, home + stops.back().at});
  return Motion(std::move(points), "touch");
}

struct HapticDisplay {
  Scheme scheme = Scheme::port;
  ReplayResult run;
  std::vector<Vec3> low_rate;  ///< force of the newest frame, held, tick by tick
  Fidelity low_rate_fidelity;
  double pull_max_n = 0;  ///< largest displayed pull along the normal of the top
  int onset_ms = -1, low_rate_onset_ms = -1, reference_onset_ms = -1;
};

std::vector<Vec3> held(const ReplayResult& run) {
  std::vector<Vec3> force(run.ticks.size(), Vec3::Zero());
  std::size_t next = 0;
  for (std::size_t i = 0; i < force.size(); ++i) {
    if (i > 0) force[i] = force[i - 1];
    for (; next < run.frames.size() && run.frames[next].t <= static_cast<std::int64_t>(i) * kTick; ++next)
      force[i] = run.frames[next].force;
  }
  return force;
}

template <typename Force>
int onset(std::size_t count, const Force& force) {
  for (std::size_t i = 0; i < count; ++i)
    if (force(i).squaredNorm() > 0) return static_cast<int>(i);
  return -1;
}

HapticDisplay show(const Scene& scene, const Motion& motion, Scheme scheme) {
  ReplayOptions options;
  options.scheme = scheme;
  options.simulated_device = true;
  HapticDisplay d;
  d.scheme = scheme;
  d.run = replay(scene, motion, options, stopwatch_ns);
  d.low_rate = held(d.run);
  std::vector<Vec3> reference;
  for (const ReplayTick& t : d.run.ticks) reference.push_back(t.reference);
  d.low_rate_fidelity = compare(d.low_rate, reference, kSkipTicks);
  for (const ReplayTick& t : d.run.ticks) d.pull_max_n = std::max(d.pull_max_n, -t.felt.z());
  const std::size_t n = reference.size();
  d.onset_ms = onset(n, [&](std::size_t i) { return d.run.ticks[i].felt; });
  d.low_rate_onset_ms = onset(n, [&](std::size_t i) { return d.low_rate[i]; });
  d.reference_onset_ms = onset(n, [&](std::size_t i) { return reference[i]; });
  return d;
}

void write_display(const std::filesystem::path& file, const HapticDisplay& d) {
  std::string csv =
      "t_s,x_m,y_m,z_m,fx_n,fy_n,fz_n,fx_low_rate_n,fy_low_rate_n,fz_low_rate_n,fx_ref_n,fy_ref_n,fz_ref_n,contact\n";
  for (std::size_t i = 0; i < d.run.ticks.size(); ++i) {
    const ReplayTick& t = d.run.ticks[i];
    const Vec3& l = d.low_rate[i];
    fmt::format_to(std::back_inserter(csv),
                   "{:.3f},{:.6f},{:.6f},{:.6f},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{}\n",
                   static_cast<double>(i) * 1e-3, t.position.x(), t.position.y(), t.position.z(), t.felt.x(), t.felt.y(),
                   t.felt.z(), l.x(), l.y(), l.z(), t.reference.x(), t.reference.y(), t.reference.z(), t.contact ? 1 : 0);
  }
  write_text(file, csv);
}

std::vector<HapticDisplay> run_experiment(const Scene& scene, const Motion& motion, const std::filesystem::path& out) {
  std::vector<HapticDisplay> displays;
  for (const Scheme scheme : {Scheme::ring, Scheme::port}) {
    displays.push_back(show(scene, motion, scheme));
    write_display(out / fmt::format("{}.csv", name_of(scheme)), displays.back());
  }
  return displays;
}

void plot(const std::filesystem::path& out, const std::vector<HapticDisplay>& displays) {
  std::vector<Panel> panels;
  for (const HapticDisplay& d : displays) {
    const auto csv = out / fmt::format("{}.csv", name_of(d.scheme));
    panels.push_back(
        {fmt::format("{}: normal force [N]", name_of(d.scheme)),
         {{"1:13", "1 kHz full model", 0, csv}, {"1:10", "20 Hz full model", 2, csv, "steps"}, {"1:7", "displayed", 1, csv}}});
  }
  const auto csv = out / fmt::format("{}.csv", name_of(displays[0].scheme));
  plot_csv(csv, out / "haptic.svg", "Figure 17: a Phantom in a hand touches the 6x6x6 cube", "time [s]", panels,
           {.rows = displays[0].run.ticks.size()});
  const double onset_s = displays[0].reference_onset_ms * 1e-3;
  plot_csv(csv, out / "onset.svg", "The first contact of figure 17", "time [s]", panels,
           {.setup = fmt::format("set xrange [{}:{}]", onset_s - 0.03, onset_s + 0.15)});
}

std::string words(const Fidelity& f) {
  return fmt::format("steps up to {:.2f} N, {:.1f} dB against the 1 kHz model", f.force_step_max_n, f.snr_db);
}

}  // namespace

PaperSection paper_haptic(const std::filesystem::path& folder, bool /*quick: it is short*/) {
  const auto out = make_output_folder(folder.string());
  const Scene scene = paper_cube(ContactKind::touch);
  const auto displays = run_experiment(scene, touch_motion(home_of(scene)), out);
  plot(out, displays);
  PaperSection s;
  s.title = "Section 6, figure 17: touching the 6x6x6 model";
  s.text =
      "A simulated Phantom in a hand (reference grip, tremor, steps of 0.03 mm and 0.07 N) comes down on the cube, strokes it, "
      "lifts "
      "off and taps. The full model runs at 20 Hz, the display at 1 kHz, contact is unilateral with friction. Beside both: the "
      "full "
      "model stepped at 1 kHz or finer along the very path that the tool took.";
  const HapticDisplay &ring = displays[0], &port = displays[1];
  const auto low = ring.low_rate_fidelity.force_step_max_n, high = ring.run.fidelity.force_step_max_n;
  s.findings = {
      {"force of the low-rate model", "a staircase (dashed line)", words(ring.low_rate_fidelity), Verdict::agrees, ""},
      {"displayed force, the paper's local model (ring)", "follows the motion between the frames (solid line)",
       words(ring.run.fidelity), high < 0.25 * low ? Verdict::agrees : Verdict::differs,
       "Steps against the 1 kHz model from tick to tick; between frames ring overshoots, as its far nodes stand still."},
      {"displayed force, whole-body patch (port)", "", words(port.run.fidelity), Verdict::beyond, ""},
      {"force felt after the first contact", "",
       fmt::format("ring {} ms, port {} ms, low-rate model {} ms late", ring.onset_ms - ring.reference_onset_ms,
                   port.onset_ms - port.reference_onset_ms, ring.low_rate_onset_ms - ring.reference_onset_ms),
       Verdict::beyond, ""},
      {"contact only pushes", "zero force where it would pull",
       fmt::format("largest pull {:.2g} N", std::max(ring.pull_max_n, port.pull_max_n)),
       std::max(ring.pull_max_n, port.pull_max_n) < kPullN ? Verdict::agrees : Verdict::differs,
       "What is left is the 4 ms over which a new patch takes over from the last one."}};
  s.pictures = {{out / "haptic.svg",
                 "Force along the normal: full model at 20 Hz (steps), displayed, and full model at 1 kHz on the same path."},
                {out / "onset.svg", "The same around the first contact."}};
  return s;
}

}  // namespace palpate
