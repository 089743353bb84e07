// palpate-lab accuracy: accuracy of every scheme's force over the round trip, on every scene, and its cost.
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <iterator>
#include <map>
#include <numeric>
#include <tuple>

#include "bench/fidelity/metrics.hpp"
#include "bench/lab/accuracy_cells.hpp"
#include "bench/lab/experiments.hpp"
#include "bench/lab/shards.hpp"
#include "bench/measure/reach.hpp"
#include "bench/output/output.hpp"
#include "bench/output/plot.hpp"

namespace palpate {
namespace {

constexpr double kJndLimit = kForceJnd, kHundredth = 0.01;
constexpr double kFirmRttMs = 150;  // round trip of the printed costs

struct AccuracyFlags {
  std::string out, scenes = "scenes";
  std::vector<std::string> only, schemes;
  std::vector<double> rtt_ms;
  bool quick = false, as_sent = false;
  int places = 0;
  ShardFlags shards;
};

using AccuracyCells = std::vector<AccuracyCell>;

bool same_curve(const AccuracyCell& a, const AccuracyCell& b) {
  return a.scene == b.scene && a.scheme == b.scheme && a.row == b.row;
}

/// Cells of each curve, in the order in which the curves first appear.
std::vector<AccuracyCells> curves_of(const AccuracyCells& cells) {
  std::vector<AccuracyCells> curves;
  for (const AccuracyCell& c : cells) {
    const auto known =
        std::find_if(curves.begin(), curves.end(), [&](const AccuracyCells& k) { return same_curve(k.front(), c); });
    (known == curves.end() ? curves.emplace_back() : *known).push_back(c);
  }
  for (AccuracyCells& curve : curves)
    std::sort(curve.begin(), curve.end(), [](const AccuracyCell& a, const AccuracyCell& b) { return a.rtt_ms < b.rtt_ms; });
  return curves;
}

/// Returns true if the felt force came from a patch; otherwise its cost is meaningless.
bool is_sent(AccuracyRow row) { return row == AccuracyRow::as_sent || row == AccuracyRow::exact_states; }

std::string title_of(const AccuracyCell& c) {
  std::string title(name_of(c.scheme));
  switch (c.row) {
    case AccuracyRow::as_sent:
      return title;
    case AccuracyRow::exact_states:
      return title + ", exact states";
    case AccuracyRow::full_forces:
      return title + ", full forces";
    case AccuracyRow::whole_linear:
      return "whole body, linear";
    case AccuracyRow::tremor_floor:
      return fmt::format("tremor noise floor, hand {:g} um off its path", 1e6 * kTremorFloorM);
  }
  return title;
}

std::filesystem::path curve_file(const std::filesystem::path& out, const AccuracyCell& c) {
  return out / fmt::format("accuracy-{}-{}-{}.csv", c.scene, name_of(c.scheme), name_of(c.row));
}

void write_curve(const std::filesystem::path& out, const AccuracyCells& curve) {
  std::string csv = "rtt_ms,snr_db,median_jnd,p95_jnd\n";
  for (const AccuracyCell& c : curve)
    fmt::format_to(std::back_inserter(csv), "{:g},{:.3f},{:.5g},{:.5g}\n", c.rtt_ms, c.snr_db, c.median_error / kForceJnd,
                   c.p95_error / kForceJnd);
  write_text(curve_file(out, curve.front()), csv);
}

/// Panel with the curves of a scene over the round trip. Curves of a single point are omitted, and those with exact states, which
/// would cover the ones as sent.
GridPanel panel_of(const std::filesystem::path& out, const std::vector<AccuracyCells>& curves, const std::string& scene,
                   const std::string& what, const std::string& column, const std::string& setup) {
  const std::vector<ComparedScheme> schemes = compared_schemes();
  GridPanel panel{scene, "round trip [ms]", what, {}, setup};
  for (const AccuracyCells& curve : curves) {
    const AccuracyCell& c = curve.front();
    if (c.scene != scene || c.row == AccuracyRow::exact_states || !has_round_trip(c.row)) continue;
    const bool beside = c.row != AccuracyRow::as_sent;
    const auto style = static_cast<int>(std::find(schemes.begin(), schemes.end(), c.scheme) - schemes.begin()) + 1;
    panel.curves.push_back({column, title_of(c), style, curve_file(out, c), beside ? "lines dt 3" : "linespoints"});
  }
  return panel;
}

void draw(const std::filesystem::path& out, const std::vector<AccuracyCells>& curves) {
  std::vector<std::string> scenes;
  for (const AccuracyCells& curve : curves) {
    write_curve(out, curve);
    const std::string& scene = curve.front().scene;
    if (std::find(scenes.begin(), scenes.end(), scene) == scenes.end()) scenes.push_back(scene);
  }
  std::vector<GridPanel> panels;
  for (const std::string& scene : scenes) {
    panels.push_back(panel_of(out, curves, scene, "accuracy of the force [dB]", "1:2", "set yrange [-10:80]"));
    panels.push_back(panel_of(out, curves, scene, "p95 error [noticeable differences]", "1:4",
                              "set logscale y\nset format y '%g'\nset yrange [0.003:30]\n"
                              "set arrow from graph 0, first 1 to graph 1, first 1 nohead lc rgb '#888888' dt 2\n"
                              "set arrow from graph 0, first 0.1 to graph 1, first 0.1 nohead lc rgb '#888888' dt 2"));
  }
  plot_grid_with_one_legend(out / "accuracy.svg", "Force error against the round trip: press, stroke, tap, release", 2, panels);
}

/// Round trip up to which the p95 error stays below `limit` [ms].
double holds_until_ms(const AccuracyCells& curve, double limit) {
  std::vector<ErrorAt> sweep;
  for (const AccuracyCell& c : curve) sweep.push_back({c.rtt_ms, c.p95_error});
  return reach(std::move(sweep), limit);
}

Json to_json(const AccuracyCells& curve) {
  Json rows = Json::array();
  for (const AccuracyCell& c : curve)
    rows.push_back({{"rtt_ms", c.rtt_ms},
                    {"snr_db", c.snr_db},
                    {"median_jnd", c.median_error / kForceJnd},
                    {"p95_jnd", c.p95_error / kForceJnd},
                    {"frame_bytes", c.frame_bytes},
                    {"build_ms", c.build_ms},
                    {"tick_us", c.tick_us}});
  const AccuracyCell& c = curve.front();
  Json all{{"scene", c.scene},
           {"scheme", name_of(c.scheme)},
           {"row", name_of(c.row)},
           {"served", name_of(c.served)},
           {"round_trips", rows}};
  if (!has_round_trip(c.row)) return all;
  all["within_10_pct_until_ms"] = holds_until_ms(curve, kJndLimit);
  all["within_1_pct_until_ms"] = holds_until_ms(curve, kHundredth);
  return all;
}

std::string until(const AccuracyCells& curve, double limit) {
  const double ms = holds_until_ms(curve, limit);
  return ms < 0 ? "never" : fmt::format("{:g} ms", ms);
}

void print(const std::vector<AccuracyCells>& curves) {
  std::string scene;
  for (const AccuracyCells& curve : curves) {
    const AccuracyCell& c = curve.front();
    if (c.scene != scene) {
      scene = c.scene;
      fmt::print("\n{:<24} dB at RTT", scene);
      for (const AccuracyCell& at : curve) fmt::print(" {:>5g}", at.rtt_ms);
      fmt::print("   p95 < 10 %   < 1 %    bytes  server ms  tick us\n");
    }
    fmt::print("  {:<32}", title_of(c) + (c.served == c.scheme ? "" : fmt::format(" ({})", name_of(c.served))));
    for (const AccuracyCell& at : curve) fmt::print(" {:>5.1f}", at.snr_db);
    if (!has_round_trip(c.row)) {
      fmt::print("\n");
      continue;
    }
    const auto firm = std::find_if(curve.begin(), curve.end(), [](const AccuracyCell& at) { return at.rtt_ms >= kFirmRttMs; });
    const AccuracyCell& cost = firm == curve.end() ? curve.back() : *firm;
    fmt::print("   {:>10} {:>7}", until(curve, kJndLimit), until(curve, kHundredth));
    if (is_sent(c.row)) fmt::print(" {:>8.0f} {:>10.2f} {:>8.2f}", cost.frame_bytes, cost.build_ms, cost.tick_us);
    fmt::print("\n");
  }
}

std::string scene_of(const AccuracyCell& cell) { return cell.scene.substr(0, cell.scene.rfind('@')); }

/// Prints the mean and the least over the places of each scene, as a hand feels the error of its own place.
void print_places(const AccuracyCells& cells) {
  std::map<std::tuple<std::string, ComparedScheme, AccuracyRow, double>, std::pair<std::vector<double>, double>> all;
  for (const AccuracyCell& c : cells) {
    if (c.scene.find('@') == std::string::npos) continue;
    auto& [snr_db, p95] = all[{scene_of(c), c.scheme, c.row, c.rtt_ms}];
    snr_db.push_back(c.snr_db);
    p95 = std::max(p95, c.p95_error);
  }
  if (!all.empty())
    fmt::print("\n{:<20} {:<8} {:<14} {:>6} {:>9} {:>9} {:>14}\n", "over all places", "scheme", "row", "RTT ms", "mean dB",
               "least dB", "worst p95, %");
  for (const auto& [key, value] : all) {
    const auto& [scene, scheme, row, rtt_ms] = key;
    const auto& [snr_db, p95] = value;
    const double mean = std::accumulate(snr_db.begin(), snr_db.end(), 0.0) / static_cast<double>(snr_db.size());
    fmt::print("{:<20} {:<8} {:<14} {:>6g} {:>9.1f} {:>9.1f} {:>14.1f}\n", scene, name_of(scheme), name_of(row), rtt_ms, mean,
               *std::min_element(snr_db.begin(), snr_db.end()), 100 * p95);
  }
}

void report(const AccuracyCells& cells, const std::vector<std::string>& untouched, const std::filesystem::path& out) {
  const std::vector<AccuracyCells> curves = curves_of(cells);
  if (!curves.empty()) draw(out, curves);
  print(curves);
  print_places(cells);
  Json summary{{"jnd_share", kForceJnd}, {"curves", Json::array()}};
  for (const AccuracyCells& curve : curves) summary["curves"].push_back(to_json(curve));
  if (!untouched.empty()) summary["scenes_without_contact"] = untouched;
  write_json(out / "summary.json", summary);
  fmt::print("\n{}\n{}\n", (out / "accuracy.svg").string(), (out / "summary.json").string());
}

AccuracyGrid grid_of(const AccuracyFlags& flags) {
  AccuracyGrid grid{flags.scenes, flags.only, {}, flags.rtt_ms, flags.as_sent, flags.places};
  for (const std::string& name : flags.schemes) grid.schemes.push_back(compared_scheme(name, "--schemes"));
  if (grid.rtt_ms.empty())
    grid.rtt_ms = flags.quick ? std::vector<double>{0, 50, 150, 300, 500}
                              : std::vector<double>{0, 25, 50, 75, 100, 150, 200, 250, 300, 400, 500};
  return grid;
}

int run_accuracy(const AccuracyFlags& flags) {
  const Shard shard = Shard::from(flags.shards.shard);
  const AccuracyGrid grid = grid_of(flags);
  const auto out = make_output_folder(flags.out);
  AccuracyCells cells;
  if (flags.shards.merge) {
    cells = merged_cells(out, read_accuracy_cells);
    write_text(out / "cells.csv", cells_csv(cells));
    report(cells, {}, out);
    return 0;
  }
  const AccuracyCells all = accuracy_cells(grid);
  cells = shard.part_of(all);
  fmt::print("{} runs of {}\n", cells.size(), all.size());
  const std::vector<std::string> untouched = measure_cells(grid, cells, flags.shards.jobs);
  write_text(shard.file(out), cells_csv(cells));
  if (shard.of == 1) report(cells, untouched, out);
  for (const std::string& scene : untouched)
    fmt::print(stderr, "palpate-lab: no contact: the examination never meets the body of {}, so it is not scored\n", scene);
  return untouched.empty() ? 0 : 1;
}

}  // namespace

void add_accuracy(CLI::App& app, Run& run) {
  auto flags = std::make_shared<AccuracyFlags>();
  CLI::App* c = app.add_subcommand(
      "accuracy", "force error against the round trip for every scheme on every scene, what limits it, and what it costs");
  c->add_option("--scenes", flags->scenes, "folder of the scenes")->type_name("DIR")->capture_default_str();
  c->add_option("--only", flags->only, "these scenes alone, by file name without .json, separated by commas")
      ->type_name("NAME")
      ->delimiter(',');
  c->add_option("--schemes", flags->schemes, "these alone, separated by commas")->type_name("NAME")->delimiter(',');
  c->add_flag("--quick", flags->quick, "five round trips instead of eleven");
  c->add_option("--rtt-ms", flags->rtt_ms, "these round trips alone, separated by commas")
      ->type_name("MS")
      ->delimiter(',')
      ->check(CLI::Range(0.0, 2000.0));
  c->add_flag("--as-sent", flags->as_sent, "without what limits a scheme: what is sent alone");
  c->add_option("--places", flags->places, "places drawn by chance on the surface of each scene; 0: the top alone")
      ->type_name("N")
      ->check(CLI::Range(0, 64));
  flags->shards.add_to(*c);
  c->add_option("--out", flags->out, "folder for cells.csv, summary.json and accuracy.svg")->type_name("DIR")->required();
  c->callback([flags, &run] { run = [flags] { return run_accuracy(*flags); }; });
}

}  // namespace palpate
