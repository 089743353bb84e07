// palpate-lab couplings --part braking-pulse: an impact on a wall as stiff as sampling allows, with and without a braking pulse.
#include <fmt/format.h>

#include <cmath>
#include <iterator>

#include "bench/lab/coupling_parts.hpp"
#include "common/base/error.hpp"

namespace palpate {
namespace {

constexpr double kWatchedMs = 480;  ///< observed part of the 0.5 s simulated

struct Way {
  const char* name;
  ImpactResult result;
};

std::vector<Way> hit_all_ways(const CouplingFlags& flags, double speed_m_s) {
  Impact spring;
  spring.device = flags.device;
  spring.wall_n_m = flags.wall_n_m;
  spring.speed_m_s = speed_m_s;
  spring.push_n = flags.push_n;
  spring.force_max_n = flags.force_max_n;
  spring.period_s = flags.period_s;
  Impact damped = spring;
  damped.wall_n_s_m = 4 * flags.device.damping_n_s_m;
  Impact spring_pulse = spring, damped_pulse = damped;
  spring_pulse.pulse = damped_pulse.pulse = true;
  return {
      {"spring", hit(spring)}, {"damped", hit(damped)}, {"spring_pulse", hit(spring_pulse)}, {"damped_pulse", hit(damped_pulse)}};
}

std::string history_csv(const std::vector<Way>& ways, double period_s) {
  std::string csv = "t_ms";
  for (const Way& w : ways) csv += fmt::format(",{0}_mm,{0}_n", w.name);
  csv += '\n';
  const auto shown = std::min<std::size_t>(ways[0].result.position_m.size(), static_cast<std::size_t>(0.2 / period_s));
  for (std::size_t n = 0; n < shown; ++n) {
    csv += fmt::format("{:.3f}", static_cast<double>(n) * period_s * 1e3);
    for (const Way& w : ways) csv += fmt::format(",{:.6g},{:.6g}", w.result.position_m[n] * 1e3, w.result.force_n[n]);
    csv += '\n';
  }
  return csv;
}

}  // namespace

CouplingPart show_braking_pulse(const std::filesystem::path& out, const CouplingFlags& flags) {
  const std::vector<Way> ways = hit_all_ways(flags, flags.speed_m_s);
  if (ways[0].result.contacts == 0)
    throw InputError("--speed-m-s, --push-n", "do not carry the device to the wall",
                     "more of them, or less damping of the device");
  const auto history = out / "braking_pulse_history.csv", sweep = out / "braking_pulse_speed.csv";
  write_text(history, history_csv(ways, flags.period_s));
  std::string csv = "speed_m_s";
  for (const Way& w : ways) csv += fmt::format(",{0}_depth_mm,{0}_bounce_mm,{0}_rate_hardness_n_m", w.name);
  csv += '\n';
  const int points = flags.quick ? 10 : 40;
  for (int k = 1; k <= points; ++k) {
    const double speed = 0.5 * k / points;
    csv += fmt::format("{:.6g}", speed);
    for (const Way& w : hit_all_ways(flags, speed))
      csv += fmt::format(",{:.6g},{:.6g},{:.6g}", w.result.depth_max_m * 1e3, w.result.bounce_max_m * 1e3,
                         w.result.rate_hardness_n_m);
    csv += '\n';
  }
  write_text(sweep, csv);

  const auto curves = [](int first, int stride, const std::filesystem::path& file) {
    return std::vector<Curve>{{fmt::format("1:{}", first), "spring", 5, file},
                              {fmt::format("1:{}", first + stride), "spring and damper", 2, file},
                              {fmt::format("1:{}", first + 2 * stride), "spring, pulse", 1, file},
                              {fmt::format("1:{}", first + 3 * stride), "spring and damper, pulse", 3, file}};
  };
  const std::vector<GridPanel> panels{
      {fmt::format("A wall of {:g} N/m hit at {:g} m/s", flags.wall_n_m, flags.speed_m_s), "time [ms]",
       "position, wall above 0 [mm]", curves(2, 2, history), "set xrange [0:120]"},
      {"The force shown", "time [ms]", "force [N]", curves(3, 2, history), "set xrange [0:40]"},
      {"Deepest penetration over the speed", "speed at contact [m/s]", "depth [mm]", curves(2, 3, sweep)},
      {"How hard it feels: rate-hardness", "speed at contact [m/s]", "rise of force over speed [N/m]", curves(4, 3, sweep),
       "set logscale y\nset format y '10^{%T}'"}};
  CouplingPart part;
  part.picture = {out / "braking_pulse.svg",
                  "A braking pulse takes the device's momentum in the first ticks inside: it neither sinks in nor bounces. The "
                  "wall's damper has four times the device's damping."};
  plot_grid(part.picture.svg, "Braking pulse", 2, panels);
  part.key_panel = panels[0];
  for (const Way& w : ways) {
    const ImpactResult& r = w.result;
    part.summary[w.name] = {{"depth_max_mm", r.depth_max_m * 1e3},
                            {"bounce_max_mm", r.bounce_max_m * 1e3},
                            {"contacts", r.contacts},
                            {"rest_ms", r.rest_ms},
                            {"rate_hardness_n_m", r.rate_hardness_n_m},
                            {"pulse_ticks", r.pulse_periods},
                            {"pulse_impulse_n_s", r.pulse_impulse_n_s}};
    part.table +=
        fmt::format("{:<18} {:<14} depth {:5.2f} mm, bounce {:5.2f} mm, {} contacts, {}, rate-hardness {:6.0f} N/m{}\n",
                    part.table.empty() ? "braking-pulse" : "", w.name, r.depth_max_m * 1e3, r.bounce_max_m * 1e3, r.contacts,
                    r.rest_ms < kWatchedMs ? fmt::format("at rest after {:.0f} ms", r.rest_ms) : "not at rest in 0.5 s",
                    r.rate_hardness_n_m, r.pulse_periods > 0 ? fmt::format(", pulse of {} ticks", r.pulse_periods) : "");
  }
  const ImpactResult &spring = ways[0].result, &pulse = ways[2].result;
  part.findings = {
      {fmt::format("Braking pulse [8] on a wall of {:g} N/m at {:g} m/s: rate-hardness [N/m]", flags.wall_n_m, flags.speed_m_s),
       "greatly improves the perception of a stiff wall",
       fmt::format("{:.0f} with, {:.0f} without", pulse.rate_hardness_n_m, spring.rate_hardness_n_m),
       pulse.rate_hardness_n_m > 2 * spring.rate_hardness_n_m ? Verdict::agrees : Verdict::differs,
       "a measure of perceived hardness, not a test with people"},
      {"Penetration and bounce with the pulse [mm]", "",
       fmt::format("{:.2f} and {:.2f} (spring alone {:.2f} and {:.2f})", pulse.depth_max_m * 1e3, pulse.bounce_max_m * 1e3,
                   spring.depth_max_m * 1e3, spring.bounce_max_m * 1e3),
       Verdict::beyond, ""}};
  return part;
}

}  // namespace palpate
