#include "bench/lab/stability_body.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <iterator>

#include "bench/measure/stability_plan.hpp"
#include "bench/output/output.hpp"
#include "bench/output/plot.hpp"

namespace palpate {
namespace {

constexpr std::array<std::string_view, 3> kLaws{"linear", "stiffening", "thigh-skin"};  // names as in scene files

struct BodyCell {
  BodyTrial trial;
  BodyTrialResult result;
  bool holds = false;
};
using StabilityBodyCells = std::vector<BodyCell>;

CellTable<BodyCell> body_table() {
  CellTable<BodyCell> table;
  table.parameter("treatment", within(&BodyCell::trial, &BodyTrial::treatment), kTreatmentNames)
      .parameter("law", within(&BodyCell::trial, &BodyTrial::law), kLaws)
      .parameter("amount", within(&BodyCell::trial, &BodyTrial::amount), "{:.17g}")
      .parameter("ratio", within(&BodyCell::trial, &BodyTrial::ratio), "{:.17g}")
      .parameter("zeta", within(&BodyCell::trial, &BodyTrial::zeta), "{:.17g}")
      .parameter("mass_min_kg", within(&BodyCell::trial, &BodyTrial::mass_min_kg), "{:.17g}")
      .parameter("mass_max_kg", within(&BodyCell::trial, &BodyTrial::mass_max_kg), "{:.17g}")
      .parameter("step_ms", within(&BodyCell::trial, &BodyTrial::step_ms), "{:.17g}")
      .parameter("seed", within(&BodyCell::trial, &BodyTrial::seed))
      .result("holds", &BodyCell::holds, "{:d}")
      .result("finite", within(&BodyCell::result, &BodyTrialResult::finite), "{:d}")
      .result("steps", within(&BodyCell::result, &BodyTrialResult::steps))
      .result("cut_steps", within(&BodyCell::result, &BodyTrialResult::cut_steps))
      .result("failed", within(&BodyCell::result, &BodyTrialResult::failed))
      .result("hidden_cut", within(&BodyCell::result, &BodyTrialResult::hidden_cut), "{:d}")
      .result("released_j", within(&BodyCell::result, &BodyTrialResult::released_j), "{:.4g}")
      .result("growth", within(&BodyCell::result, &BodyTrialResult::growth), "{:.4g}")
      .result("left", within(&BodyCell::result, &BodyTrialResult::left), "{:.4g}")
      .result("off_spacings", within(&BodyCell::result, &BodyTrialResult::off_spacings), "{:.4g}")
      .result("end", within(&BodyCell::result, &BodyTrialResult::end), kBodyEndNames);
  return table;
}

void draw(const std::filesystem::path& out, const StabilityBodyCells& cells) {
  constexpr std::array kColours{0x009e73, 0x56b4e9, 0xe69f00, 0xd55e00};
  std::string csv = "step_ms,mass_max_kg,ratio,zeta,colour,amount\n";
  for (const BodyCell& c : cells)
    fmt::format_to(std::back_inserter(csv), "{:.5g},{:.5g},{:.5g},{:.5g},{},{:.4g}\n", c.trial.step_ms, c.trial.mass_max_kg,
                   c.trial.ratio, std::max(c.trial.zeta, 5e-4), kColours[static_cast<std::size_t>(c.result.end)], c.trial.amount);
  write_text(out / "body-map.csv", csv);
  const std::string file = quoted((out / "body-map.csv").string());
  std::string s =
      "set multiplot layout 1,2 title 'After the release: green at rest, blue on its way to rest, orange in another "
      "equilibrium, red none' font ',13'\nunset key\nset logscale xy\nset format '10^{%T}'\n";
  s += fmt::format(
      "set xlabel 'longest sub-step [ms]'\nset ylabel 'heaviest node [kg]'\nplot {} using 1:2:5 skip 1 with points pt 7 "
      "ps 0.6 lc rgb variable\n",
      file);
  s += fmt::format(
      "set xlabel 'stiffness ratio'\nset ylabel 'damping ratio of an element (left edge of the axis: 0)'\nplot {} using "
      "3:4:5 skip 1 with points pt 7 ps 0.6 lc rgb variable\n",
      file);
  plot_script(out / "body-map.svg", 960, 420, s + "unset multiplot\n");
}

/// Returns false if a trial does not hold.
bool report(const StabilityBodyCells& cells, const std::filesystem::path& out) {
  draw(out, cells);
  Json summary{{"trials", cells.size()}};
  fmt::print("\n  {:<10} {:>7} {:>7} {:>7} {:>7} {:>11} {:>10} {:>6} {:>10} {:>12} {:>8}\n", "treatment", "trials", "hold", "NaN",
             "back", "on its way", "elsewhere", "none", "cut steps", "halted", "growth");
  for (std::size_t k = 0; k < kTreatmentNames.size(); ++k) {
    std::array<int, kBodyEndNames.size()> ends{};
    int trials = 0, hold = 0, nan = 0, with_cuts = 0, halted = 0;
    double growth = -1;
    for (const BodyCell& c : cells) {
      if (static_cast<std::size_t>(c.trial.treatment) != k) continue;
      ++trials;
      hold += c.holds;
      nan += !c.result.finite;
      ++ends[static_cast<std::size_t>(c.result.end)];
      with_cuts += c.result.cut_steps > 0;
      halted += c.result.failed > 0;
      growth = std::max(growth, c.result.growth);
    }
    if (trials == 0) continue;
    fmt::print("  {:<10} {:>7} {:>7} {:>7} {:>7} {:>11} {:>10} {:>6} {:>10} {:>12} {:>8.1e}\n", kTreatmentNames[k], trials, hold,
               nan, ends[0], ends[1], ends[2], ends[3], with_cuts, halted, growth);
    summary["treatments"][std::string(kTreatmentNames[k])] = {
        {"trials", trials},     {"hold", hold},    {"not_finite", nan},           {"back", ends[0]},  {"on_its_way", ends[1]},
        {"elsewhere", ends[2]}, {"none", ends[3]}, {"with_cut_steps", with_cuts}, {"halted", halted}, {"growth_max", growth}};
  }
  fmt::print(
      "\n  All columns but the last count trials. After the release the body ends at its rest shape (back), on its way to it, in "
      "another\n  equilibrium (elsewhere) or in none. Cut steps: the statistics report steps that were shortened. Halted: no "
      "step "
      "converged within a\n  piece of 50 ms. Growth is the largest rise of the energy after the release, as a share of it.\n");
  bool all_hold = true;
  for (const BodyCell& c : cells) {
    if (c.holds) continue;
    all_hold = false;
    fmt::print("  does not hold: palpate-lab stability --body --only {} --out DIR\n", body_table().key(c));
  }
  write_json(out / "summary.json", summary);
  fmt::print("\n{}\n", (out / "summary.json").string());
  return all_hold;
}

}  // namespace

int run_body_sweep(const BodySweep& sweep) {
  constexpr std::size_t kScattered = 400, kScatteredQuick = 40;
  const auto out = make_output_folder(sweep.out);
  CellSweep<BodyCell> trials{body_table(), {}};
  if (sweep.only.empty())
    for (const BodyTrial& t : body_trials(sweep.quick ? kScatteredQuick : kScattered, sweep.seed))
      trials.cells.push_back({t, {}});
  else
    trials.cells.push_back(trials.table.from_key(sweep.only, "--only"));
  trials.measure = [](BodyCell& cell) {
    cell.result = try_body(cell.trial);
    cell.holds = cell.result.holds(cell.trial);
  };
  const auto cells = run_cells(trials, sweep.cells, out);
  return !cells || report(*cells, out) ? 0 : 1;
}

}  // namespace palpate
