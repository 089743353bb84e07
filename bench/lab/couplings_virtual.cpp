// palpate-lab couplings --part virtual-coupling: the sampled wall, its limits, and the coupling that overcomes them.
#include <fmt/format.h>

#include <cmath>
#include <iterator>

#include "bench/lab/coupling_parts.hpp"

namespace palpate {
namespace {

constexpr double kStiffestN = 1e6;

bool stable(const WallLoop& loop) { return spectral_radius(loop) < 1; }

double logarithmic(double from, double to, int k, int points) { return from * std::pow(to / from, k / (points - 1.0)); }

/// K against B: by eigenvalues, simulation, the worst spring as operator, and passivity.
struct DampingMap {
  std::string csv = "wall_damping_n_s_m,passive_n_m,alone_n_m,alone_simulated_n_m,worst_spring_n_m\n";
  double simulation_error = 0;  ///< largest relative error of the simulated boundary
  double held_margin = 1e9;     ///< least ratio of worst_spring to passive
  double at_zero_alone = 0, at_zero_passive = 0, at_zero_held = 0;
};

DampingMap map_damping(const WallLoop& base, bool quick) {
  DampingMap map;
  const int points = quick ? 9 : 25, operators = quick ? 16 : 40;
  const std::size_t periods = quick ? 4000 : 20000;
  for (int k = 0; k < points; ++k) {
    WallLoop loop = base;
    loop.damping_n_s_m = 2 * base.device.damping_n_s_m * k / (points - 1.0);
    const double passive = passive_wall_n_m(loop), alone = stiffest(loop, kStiffestN, stable),
                 simulated = stiffest(loop, kStiffestN, [&](const WallLoop&l) { return settles(l, periods); }),
                 any = stiffest_for_any_spring(loop, kStiffestN, operators);
    fmt::format_to(std::back_inserter(map.csv), "{:.4g},{:.6g},{:.6g},{:.6g},{:.6g}\n", loop.damping_n_s_m, passive, alone,
                   simulated, any);
    if (alone > 0) map.simulation_error = std::max(map.simulation_error, std::abs(simulated / alone - 1));
    if (passive > 1) map.held_margin = std::min(map.held_margin, any / passive);
    if (k == 0) {
      map.at_zero_alone = alone;
      map.at_zero_passive = passive;
      map.at_zero_held = any;
    }
  }
  return map;
}

std::string map_period(const WallLoop& base, int points) {
  std::string csv = "period_ms,passive_n_m,light_n_m,device_n_m,held_n_m\n";
  for (int k = 0; k < points; ++k) {
    WallLoop loop = base;
    loop.period_s = logarithmic(1e-4, 0.1, k, points);
    csv += fmt::format("{:.6g},{:.6g}", loop.period_s * 1e3, passive_wall_n_m(loop));
    for (const double mass : {0.3, 1.0, 10.0}) {
      loop.device.mass_kg = mass * base.device.mass_kg;
      csv += fmt::format(",{:.6g}", stiffest(loop, kStiffestN, stable));
    }
    csv += '\n';
  }
  return csv;
}

constexpr double kWallDampings[] = {0, 2, 8};  ///< multiples of the device's own damping

std::string map_mass(const WallLoop& base, int points) {
  std::string csv = "mass_kg,no_damper_n_m,damper_n_m,strong_damper_n_m\n";
  for (int k = 0; k < points; ++k) {
    WallLoop loop = base;
    loop.device.mass_kg = logarithmic(0.001, 2, k, points);
    csv += fmt::format("{:.6g}", loop.device.mass_kg);
    for (const double damping : kWallDampings) {
      loop.damping_n_s_m = damping * base.device.damping_n_s_m;
      csv += fmt::format(",{:.6g}", stiffest(loop, kStiffestN, stable));
    }
    csv += '\n';
  }
  return csv;
}

/// Growth of the loop's slowest motion over the environment's stiffness: alone, with the coupling, with too stiff a coupling.
struct GrowthMap {
  std::string csv = "environment_n_m,alone_1_s,coupled_1_s,too_stiff_1_s\n";
  double alone_from_n_m = 0;  ///< first environment on which the motion grows without the coupling
  double coupled_most_1_s = -1e9;
  double too_stiff_most_1_s = -1e9;
};

GrowthMap map_growth(const WallLoop& base, const CouplingParameters& coupling, const CouplingParameters& stiff, int points) {
  GrowthMap map;
  for (int k = 0; k < points; ++k) {
    WallLoop loop = base;
    loop.stiffness_n_m = logarithmic(10, 1e6, k, points);
    const auto growth = [&] { return std::log(spectral_radius(loop)) / loop.period_s; };
    const double alone = growth();
    loop.coupling = coupling;
    const double coupled = growth();
    loop.coupling = stiff;
    const double too_stiff = growth();
    if (alone > 0 && map.alone_from_n_m == 0) map.alone_from_n_m = loop.stiffness_n_m;
    map.coupled_most_1_s = std::max(map.coupled_most_1_s, coupled);
    map.too_stiff_most_1_s = std::max(map.too_stiff_most_1_s, too_stiff);
    fmt::format_to(std::back_inserter(map.csv), "{:.6g},{:.6g},{:.6g},{:.6g}\n", loop.stiffness_n_m, alone, coupled, too_stiff);
  }
  return map;
}

}  // namespace

CouplingPart show_virtual_coupling(const std::filesystem::path& out, const CouplingFlags& flags) {
  const WallLoop base{flags.device, 0, 0, flags.period_s, {}};
  const int points = flags.quick ? 16 : 60;
  const double passive = passive_stiffness_n_m(flags.device.damping_n_s_m, flags.coupling.damping_n_s_m, flags.period_s);
  const CouplingParameters stiff{5 * std::max(passive, 100.0), flags.coupling.damping_n_s_m, flags.coupling.tool_mass_kg};
  const DampingMap damping = map_damping(base, flags.quick);
  const GrowthMap growth = map_growth(base, flags.coupling, stiff, points);
  const auto file = [&](const char* name) { return out / fmt::format("virtual_coupling_{}.csv", name); };
  write_text(file("wall_damping"), damping.csv);
  write_text(file("period"), map_period(base, points));
  write_text(file("mass"), map_mass(base, points));
  write_text(file("environment"), growth.csv);

  const double b = flags.device.damping_n_s_m, m = flags.device.mass_kg;
  const std::vector<GridPanel> panels{
      {"Stiffest stable wall, over its damping",
       "wall damping B [N s/m]",
       "wall stiffness K [N/m]",
       {{"1:3", "device alone", 1, file("wall_damping")},
        {"1:4", "alone, simulated", 1, file("wall_damping"), "points"},
        {"1:5", "held by the worst spring", 2, file("wall_damping"), "linespoints"},
        {"1:2", "passive, b = K T/2 + B", 0, file("wall_damping")}}},
      {"Stiffest stable wall, over the sampling period, B = 0",
       "period T [ms]",
       "wall stiffness K [N/m]",
       {{"1:2", "passive, any mass", 0, file("period")},
        {"1:3", fmt::format("alone, {:.3g} kg", 0.3 * m), 2, file("period")},
        {"1:4", fmt::format("alone, {:.3g} kg", m), 1, file("period")},
        {"1:5", fmt::format("alone, {:.3g} kg", 10 * m), 3, file("period")}},
       "set logscale xy\nset format y '10^{%T}'\nset yrange [1:1e5]"},
      {"Stiffest stable wall, over the mass of the device alone",
       "device mass m [kg]",
       "wall stiffness K [N/m]",
       {{"1:2", fmt::format("B = {:g} N s/m", kWallDampings[0] * b), 2, file("mass")},
        {"1:3", fmt::format("B = {:g} N s/m", kWallDampings[1] * b), 1, file("mass")},
        {"1:4", fmt::format("B = {:g} N s/m", kWallDampings[2] * b), 3, file("mass")}},
       "set logscale xy\nset format y '10^{%T}'\nset yrange [1:1e5]"},
      {"On an environment, by the coupling in between",
       "environment stiffness [N/m]",
       "growth of the slowest motion [1/s]",
       {{"1:2", "none", 5, file("environment")},
        {"1:4", fmt::format("{:.0f} N/m: too stiff", stiff.stiffness_n_m), 2, file("environment")},
        {"1:3", fmt::format("{:g} N/m, {:g} N s/m", flags.coupling.stiffness_n_m, flags.coupling.damping_n_s_m), 1,
         file("environment")}},
       "set logscale x\nset format x '10^{%T}'\nset yrange [-20:120]\nset arrow from graph 0, first 0 to graph 1, first 0 nohead "
       "lc rgb "
       "'#888888'"}};
  CouplingPart part;
  part.picture = {out / "virtual_coupling.svg",
                  fmt::format("A device of {:g} kg with {:g} N s/m on a sampled wall: what is stable, what is passive, and how a "
                              "virtual coupling makes it indifferent to the environment's stiffness.",
                              m, b)};
  plot_grid(part.picture.svg, "Virtual coupling", 2, panels);
  part.key_panel = panels[3];
  part.summary = {{"alone_n_m", damping.at_zero_alone},
                  {"passive_n_m", damping.at_zero_passive},
                  {"worst_spring_n_m", damping.at_zero_held},
                  {"simulated_boundary_max_rel_error", damping.simulation_error},
                  {"worst_spring_over_passive_min", damping.held_margin},
                  {"alone_unstable_from_n_m", growth.alone_from_n_m},
                  {"coupled_growth_max_1_s", growth.coupled_most_1_s},
                  {"too_stiff_growth_max_1_s", growth.too_stiff_most_1_s},
                  {"coupling_passive", flags.coupling.stiffness_n_m < passive ? 1 : 0}};
  part.table = fmt::format(
      "virtual-coupling   device {:g} kg, {:g} N s/m, {:g} ms: stiffest wall {:.0f} N/m alone (simulated within {:.2g} %), "
      "{:.0f} N/m "
      "held by the worst spring; passive up to {:.0f} N/m\n"
      "                   through {:g} N/m, {:g} N s/m ({}): growth at most {:.2f} 1/s on 10 to 1e6 N/m; alone it grows from "
      "{:.0f} "
      "N/m on\n",
      m, b, flags.period_s * 1e3, damping.at_zero_alone, 100 * damping.simulation_error, damping.at_zero_held,
      damping.at_zero_passive, flags.coupling.stiffness_n_m, flags.coupling.damping_n_s_m,
      flags.coupling.stiffness_n_m < passive ? "passive" : "not passive", growth.coupled_most_1_s, growth.alone_from_n_m);
  part.findings = {
      {"Virtual coupling [4]: stiffest stable wall, device alone [N/m]", "sampling limits it",
       fmt::format("{:.0f}; simulated within {:.2g} %", damping.at_zero_alone, 100 * damping.simulation_error), Verdict::agrees,
       "eigenvalues of the sampled-data loop against a time-stepped release"},
      {"Passivity b > K T/2 + B: stiffest wall with the worst spring as operator, over the condition's", "sufficient",
       fmt::format("{:.3f} at least", damping.held_margin), damping.held_margin >= 0.999 ? Verdict::agrees : Verdict::differs,
       "no passive wall oscillates; with wall damping a single spring leaves a gap (pi^2/8 b for b), which operators with more "
       "resonances close"},
      {"A device on any environment through a virtual coupling", "stable",
       fmt::format("growth at most {:.2f} 1/s up to 1e6 N/m; without from {:.0f} N/m on it grows", growth.coupled_most_1_s,
                   growth.alone_from_n_m),
       growth.coupled_most_1_s < 0 ? Verdict::agrees : Verdict::differs,
       fmt::format("a coupling of {:.0f} N/m, beyond the condition, grows at {:.0f} 1/s", stiff.stiffness_n_m,
                   growth.too_stiff_most_1_s)}};
  return part;
}

}  // namespace palpate
