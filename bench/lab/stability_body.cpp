#include "bench/lab/stability_body.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iterator>

#include "bench/lab/parallel.hpp"
#include "bench/measure/stability_plan.hpp"
#include "bench/output/output.hpp"
#include "bench/output/plot.hpp"
#include "common/base/error.hpp"

namespace palpate {
namespace {

constexpr const char* kBodyKeys = "treatment,law,amount,ratio,zeta,mass_min_kg,mass_max_kg,step_ms,seed";
constexpr const char* kBodyMeasures = "holds,finite,steps,cut_steps,failed,hidden_cut,released_j,growth,left,off_spacings,end";
constexpr std::size_t kStabilityBodyKeyFields = 9;
constexpr std::array<std::string_view, 3> kLaws{"linear", "stiffening", "thigh-skin"};  // names as in scene files

struct BodyCell {
  BodyTrial trial;
  BodyTrialResult result;
};
using StabilityBodyCells = std::vector<BodyCell>;

std::string key_of(const BodyTrial& t) {
  return fmt::format("{},{},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g},{}", name_of(t.treatment),
                     kLaws[static_cast<std::size_t>(t.law)], t.amount, t.ratio, t.zeta, t.mass_min_kg, t.mass_max_kg, t.step_ms,
                     t.seed);
}

BodyTrial trial_from(const std::vector<std::string>& f, const std::string& where) {
  if (f.size() < kStabilityBodyKeyFields) throw InputError(where, fmt::format("has {} fields", f.size()), kBodyKeys);
  BodyTrial t;
  t.treatment = static_cast<Treatment>(index_from(f[0], kTreatmentNames, where));
  t.law = static_cast<SpringLaw>(index_from(f[1], kLaws, where));
  double* const numbers[] = {&t.amount, &t.ratio, &t.zeta, &t.mass_min_kg, &t.mass_max_kg, &t.step_ms};
  for (std::size_t k = 0; k < std::size(numbers); ++k) *numbers[k] = number_from(f[2 + k], where);
  t.seed = static_cast<std::uint64_t>(number_from(f[8], where));
  return t;
}

std::string cells_csv(const StabilityBodyCells& cells) {
  std::string csv = fmt::format("{},{}\n", kBodyKeys, kBodyMeasures);
  for (const BodyCell& c : cells) {
    const BodyTrialResult& r = c.result;
    fmt::format_to(std::back_inserter(csv), "{},{:d},{:d},{},{},{},{:d},{:.4g},{:.4g},{:.4g},{:.4g},{}\n", key_of(c.trial),
                   r.holds(c.trial), r.finite, r.steps, r.cut_steps, r.failed, r.hidden_cut, r.released_j, r.growth, r.left,
                   r.off_spacings, name_of(r.end));
  }
  return csv;
}

StabilityBodyCells read_body_cells(const std::filesystem::path& file) {
  StabilityBodyCells cells;
  for (const std::vector<std::string>& f : read_rows(file, fmt::format("{},{}", kBodyKeys, kBodyMeasures))) {
    const std::string where = fmt::format("{}:{}", file.string(), cells.size() + 2);
    BodyCell c{trial_from(f, where), {}};
    const auto number = [&](std::size_t k) { return number_from(f[kStabilityBodyKeyFields + k], where); };
    BodyTrialResult& r = c.result;
    r.finite = number(1) > 0;
    r.steps = static_cast<int>(number(2));
    r.cut_steps = static_cast<int>(number(3));
    r.failed = static_cast<int>(number(4));
    r.hidden_cut = number(5) > 0;
    r.released_j = number(6);
    r.growth = number(7);
    r.left = number(8);
    r.off_spacings = number(9);
    r.end = static_cast<BodyEnd>(index_from(f[kStabilityBodyKeyFields + 10], kBodyEndNames, where));
    cells.push_back(c);
  }
  return cells;
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
      hold += c.result.holds(c.trial);
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
      "\n  Trials by where the body ends after everything let go: at its rest shape, on its way to it, in another equilibrium.\n"
      "  cut steps: trials whose statistics report any; halted: those in which a piece of 50 ms was given up and the body "
      "halted;\n"
      "  growth: most that the energy rose after the release, as a share.\n");
  bool all_hold = true;
  for (const BodyCell& c : cells) {
    if (c.result.holds(c.trial)) continue;
    all_hold = false;
    fmt::print("  does not hold: palpate-lab stability --body --only {} --out DIR\n", key_of(c.trial));
  }
  write_json(out / "summary.json", summary);
  fmt::print("\n{}\n", (out / "summary.json").string());
  return all_hold;
}

}  // namespace

int run_body_sweep(const BodySweep& sweep) {
  constexpr std::size_t kScattered = 400, kScatteredQuick = 40;
  const Shard shard = Shard::from(sweep.shards.shard);
  const auto out = make_output_folder(sweep.out);
  StabilityBodyCells cells;
  if (sweep.shards.merge) {
    cells = merged_cells(out, read_body_cells);
  } else {
    const std::vector<BodyTrial> trials = sweep.only.empty()
                                              ? shard.part_of(body_trials(sweep.quick ? kScatteredQuick : kScattered, sweep.seed))
                                              : std::vector{trial_from(fields_of(sweep.only), "--only")};
    for (const BodyTrial& t : trials) cells.push_back({t, {}});
    fmt::print("{} trials\n", cells.size());
    run_all(
        cells.size(), [&](std::size_t i) { cells[i].result = try_body(cells[i].trial); }, sweep.shards.jobs);
  }
  const bool part = shard.of > 1 && !sweep.shards.merge;
  write_text(part ? shard.file(out) : out / "cells.csv", cells_csv(cells));
  return part || report(cells, out) ? 0 : 1;
}

}  // namespace palpate
