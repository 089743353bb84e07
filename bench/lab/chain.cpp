// Section `chain` of palpate-lab paper: the paper's section 5.1, a chain of masses and its two local models against the printed
// formulas.
#include "bench/paper/chain.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>

#include "bench/lab/experiments.hpp"
#include "bench/output/output.hpp"
#include "bench/output/plot.hpp"

namespace palpate {
namespace {

struct ChainRun {
  ChainParameters parameters;
  std::vector<double> frequency_hz;
  std::array<ChainErrors, 3> errors;  ///< for each model, the worst over `dampings`
  std::vector<double> dampings;       ///< [N s/m]
  std::array<double, 3> dc_n_m{}, asymptote{};
  double lowest_full_hz = 0, lowest_two_level_hz = 0;
};

/// Frequencies two decades either side of the chain's own.
std::vector<double> frequencies(const ChainParameters& p, bool quick) {
  const double own_hz = std::sqrt(p.stiffness_n_m / p.mass_kg) / (2 * std::numbers::pi);
  const int points = quick ? 200 : 2000;
  std::vector<double> f;
  for (int i = 0; i <= points; ++i) f.push_back(own_hz * std::pow(10, -2.5 + 5.0 * i / points));
  return f;
}

double lowest_hz(const std::vector<Complex>& poles) {
  double lowest = std::abs(poles[0]);
  for (const Complex p : poles) lowest = std::min(lowest, std::abs(p));
  return lowest / (2 * std::numbers::pi);
}

ChainRun compute(const ChainParameters& p, bool quick) {
  ChainRun run;
  run.parameters = p;
  run.frequency_hz = frequencies(p, quick);
  // The given damping, critical damping of the first mass alone, and a damping at which every pair of poles is real.
  const double critical = 2 * std::sqrt(p.mass_kg * p.stiffness_n_m / 2),
               slowest = std::sin(0.5 * std::numbers::pi / p.elements());
  run.dampings = {p.damping_n_s_m, critical, 2 * std::sqrt(p.mass_kg * p.stiffness_n_m) / slowest};
  for (std::size_t i = 0; i < 3; ++i) {
    const ChainModel model = kChainModels[i];
    for (const double damping : run.dampings) {
      ChainParameters damped = p;
      damped.damping_n_s_m = damping;
      const ChainErrors e = chain_errors(damped, model, run.frequency_hz);
      run.errors[i].transfer = std::max(run.errors[i].transfer, e.transfer);
      run.errors[i].poles = std::max(run.errors[i].poles, e.poles);
    }
    const SecondOrderSystem system = chain_system(p, model);
    const TransferFunction transfer(system);
    run.dc_n_m[i] = transfer(0)(0, 0).real();
    const Complex fast(0, 1e4 * std::sqrt(p.stiffness_n_m / p.mass_kg) * std::max(1.0, p.damping_n_s_m / critical));
    run.asymptote[i] = std::abs(transfer(fast)(0, 0) / p.element(fast));
  }
  run.lowest_full_hz = lowest_hz(chain_poles(p, ChainModel::full));
  run.lowest_two_level_hz = lowest_hz(chain_poles(p, ChainModel::two_level));
  return run;
}

void write_curves(const std::filesystem::path& file, const ChainRun& run) {
  std::string csv = "frequency_hz";
  for (const char* name : {"full", "first_mass", "two_level"}) csv += fmt::format(",{0}_n_m,{0}_deg", name);
  csv += ",element_n_m\n";
  std::vector<SecondOrderSystem> systems;
  for (const ChainModel model : kChainModels) systems.push_back(chain_system(run.parameters, model));
  for (const double f : run.frequency_hz) {
    const Complex s(0, 2 * std::numbers::pi * f);
    fmt::format_to(std::back_inserter(csv), "{:.9g}", f);
    for (const SecondOrderSystem& system : systems) {
      const Complex g = TransferFunction(system)(s)(0, 0);
      fmt::format_to(std::back_inserter(csv), ",{:.9g},{:.9g}", std::abs(g), std::arg(g) * 180 / std::numbers::pi);
    }
    fmt::format_to(std::back_inserter(csv), ",{:.9g}\n", std::abs(run.parameters.element(s)));
  }
  write_text(file, csv);
}

void write_chain(const std::filesystem::path& out, const ChainRun& run) {
  write_curves(out / "chain.csv", run);
  plot_csv(
      out / "chain.csv", out / "chain.svg",
      fmt::format("Chain of {} masses and its local models: k = {:g} N/m, b = {:g} N s/m, m = {:g} g", run.parameters.masses,
                  run.parameters.stiffness_n_m, run.parameters.damping_n_s_m, 1e3 * run.parameters.mass_kg),
      "frequency [Hz]",
      {{"|F/X| [N/m]",
        {{"1:2", "full (eq. 6)", 0},
         {"1:4", "first mass (eq. 10)", 1, {}, "lines dt 2"},
         {"1:6", "two-level (eq. 12)", 5, {}, "lines dt 4 lw 2.4"},
         {"1:8", "k + b s", 3, {}, "lines dt 3"}},
        true},
       {"phase [degrees]",
        {{"1:3", "", 0}, {"1:5", "", 1, {}, "lines dt 2"}, {"1:7", "", 5, {}, "lines dt 4 lw 2.4"}},
        false,
        "set ytics 45"}},
      {.log_x = true, .setup = fmt::format("set xrange [{}:{}]", run.frequency_hz.front() * 10, run.frequency_hz.back() / 3)});
}

Finding agreement(const std::string& what, const std::string& paper, double error) {
  constexpr double kExact = 1e-9;
  return {what, paper, fmt::format("largest relative difference {:.0e}", error),
          error < kExact ? Verdict::agrees : Verdict::differs,
          error < kExact ? "" : "the elements do not give the printed formula"};
}

Finding gain(const char* what, const char* paper, double found, double expected) {
  constexpr double kExact = 1e-9;
  const bool agrees = std::abs(found / expected - 1) < kExact;
  return {what, paper, fmt::format("{:.9g} k", found), agrees ? Verdict::agrees : Verdict::differs,
          agrees ? "" : "from elements"};
}

}  // namespace

PaperSection paper_chain(const std::filesystem::path& out, bool quick) {
  make_output_folder(out.string());
  const ChainParameters p;
  const ChainRun run = compute(p, quick);
  write_chain(out, run);
  PaperSection s;
  s.title = "Section 5.1, figures 12-15: a chain and its local models";
  s.text =
      "Three masses between the instrument and a wall, built from elements and linearised by the code that linearises every "
      "body; "
      "then with all masses but the first held still, and as the two-layer model of the server makes of it. Differences are the "
      "worst over five decades of frequency and three dampings: light, critical, every pole real.";
  s.findings = {agreement("transfer function of the chain", "eq. 6", run.errors[0].transfer),
                agreement("transfer function with only the first mass free", "eq. 10", run.errors[1].transfer),
                agreement("transfer function of the two-level model", "eq. 12", run.errors[2].transfer),
                agreement("poles of all three", "eqs 7-9, 11 and 13",
                          std::max({run.errors[0].poles, run.errors[1].poles, run.errors[2].poles})),
                gain("static gain of the chain", "k/4", run.dc_n_m[0] / p.stiffness_n_m, 1.0 / 4),
                gain("static gain with only the first mass free", "k/2", run.dc_n_m[1] / p.stiffness_n_m, 1.0 / 2),
                gain("static gain of the two-level model", "k/4", run.dc_n_m[2] / p.stiffness_n_m, 1.0 / 4)};
  const double high = std::max({std::abs(run.asymptote[0] - 1), std::abs(run.asymptote[1] - 1), std::abs(run.asymptote[2] - 1)});
  constexpr double kAsymptote = 1e-3, kNear = 0.1;
  s.findings.push_back({"high-frequency asymptote of all three", "k + b s",
                        fmt::format("within {:.0e} of it at 10^4 sqrt(k/m)", high),
                        high < kAsymptote ? Verdict::agrees : Verdict::differs, "from elements"});
  const double ratio = run.lowest_two_level_hz / run.lowest_full_hz;
  s.findings.push_back(
      {"the two low-frequency poles in the two-level model", "approximated",
       fmt::format("{:.2f} Hz for {:.2f} Hz, {:+.1f} %", run.lowest_two_level_hz, run.lowest_full_hz, 100 * (ratio - 1)),
       std::abs(ratio - 1) < kNear ? Verdict::agrees : Verdict::differs,
       "sqrt(2/3) for sqrt(2 - sqrt 2) of sqrt(k/m), whatever k and m"});
  s.pictures = {{out / "chain.svg",
                 "Figure 15: full chain, its first mass alone, and the two-level model. The first mass alone matches the high "
                 "frequencies, the two-level model both ends and the first resonance."}};
  return s;
}

}  // namespace palpate
