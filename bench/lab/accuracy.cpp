// palpate-lab accuracy: accuracy of every scheme's force over the round trip, on every scene, and its cost.
//
// A cell is the examination of one scene, or fast strokes over it (examination.hpp), through one scheme at one round trip, with
// the real cores in virtual time.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <iterator>
#include <map>
#include <numeric>
#include <tuple>

#include "bench/fidelity/replay.hpp"
#include "bench/lab/cells.hpp"
#include "bench/lab/experiments.hpp"
#include "bench/lab/flags.hpp"
#include "bench/lab/tasks.hpp"
#include "bench/measure/reach.hpp"
#include "bench/output/plot.hpp"
#include "bench/paper/compared_scheme.hpp"
#include "common/base/error.hpp"

namespace palpate {
namespace {

constexpr double kJndLimit = kForceJnd, kHundredth = 0.01;
constexpr double kFirmRttMs = 150;      // round trip of the printed costs
constexpr double kTremorFloorM = 1e-5;  // along (1, 1, 1); a hand trembles by 50 to 200 um rms (client/device/hand.hpp)

/// as_sent: the program as it is. tremor_floor, without a round trip: the reference against itself with the hand kTremorFloorM
/// off its path; accuracy beyond that is finer than any hand can be held.
enum class AccuracyRow : std::uint8_t { as_sent, tremor_floor };
constexpr std::array<std::string_view, 2> kAccuracyRowNames{"as_sent", "tremor_floor"};

struct AccuracyCell {
  std::string scene;  // at_place(), tasks.hpp
  ComparedScheme scheme = ComparedScheme::hyper;
  AccuracyRow row = AccuracyRow::as_sent;
  double rtt_ms = 0;
  // Results:
  ComparedScheme served = ComparedScheme::hyper;  // scheme that the server chose
  double snr_db = 0;                              // as in metrics.hpp
  double median_error = 0, p95_error = 0;         // relative error of the force, where it is at least a tenth of its peak
  double frame_bytes = 0;                         // bytes of the patch and its terms
  double build_ms = 0, tick_us = 0;               // processor time: server per patch, client per tick (median)
};
using AccuracyCells = std::vector<AccuracyCell>;

bool has_round_trip(const AccuracyCell& cell) { return cell.row != AccuracyRow::tremor_floor; }

CellTable<AccuracyCell> accuracy_table() {
  CellTable<AccuracyCell> table;
  table.parameter("scene", &AccuracyCell::scene)
      .parameter("scheme", &AccuracyCell::scheme, kComparedSchemeNames)
      .parameter("row", &AccuracyCell::row, kAccuracyRowNames)
      .parameter("rtt_ms", &AccuracyCell::rtt_ms, "{:g}")
      .result("served", &AccuracyCell::served, kComparedSchemeNames)
      .result("snr_db", &AccuracyCell::snr_db, "{:.3f}")
      .result("median_error", &AccuracyCell::median_error, "{:.5g}")
      .result("p95_error", &AccuracyCell::p95_error, "{:.5g}")
      .result("frame_bytes", &AccuracyCell::frame_bytes, "{:.0f}")
      .result("build_ms", &AccuracyCell::build_ms, "{:.4g}")
      .result("tick_us", &AccuracyCell::tick_us, "{:.4g}");
  return table;
}

struct AccuracyFlags {
  std::string out, scenes = "scenes";
  std::vector<std::string> only, schemes;
  std::vector<double> rtt_ms;
  bool quick = false, as_sent = false, fast_strokes = false;
  int places = 0;
  CellFlags cells;
};

std::vector<std::string> scenes_of(const AccuracyFlags& flags) {
  std::vector<std::string> names = scenes_in(flags.scenes, flags.only);
  if (flags.places == 0) return names;
  std::vector<std::string> places;
  for (const std::string& name : names)
    for (int place = 1; place <= flags.places; ++place) places.push_back(at_place(name, place));
  return places;
}

AccuracyCells accuracy_cells(const AccuracyFlags& flags) {
  std::vector<double> rtt_ms = flags.rtt_ms;
  if (rtt_ms.empty())
    rtt_ms = flags.quick ? std::vector<double>{0, 50, 150, 300, 500}
                         : std::vector<double>{0, 25, 50, 75, 100, 150, 200, 250, 300, 400, 500};
  AccuracyCells cells;
  for (const AccuracyCell& cell : crossed(crossed(AccuracyCells(1), &AccuracyCell::scene, scenes_of(flags)),
                                          &AccuracyCell::scheme, compared_schemes_named(flags.schemes))) {
    for (AccuracyCell& at : crossed(AccuracyCells{cell}, &AccuracyCell::rtt_ms, rtt_ms)) cells.push_back(std::move(at));
    if (flags.as_sent || cell.scheme != ComparedScheme::hyper) continue;
    cells.push_back(cell);
    cells.back().row = AccuracyRow::tremor_floor;
  }
  return cells;
}

void set_errors(AccuracyCell& cell, double snr_db, const std::vector<double>& relative) {
  cell.snr_db = snr_db;
  cell.median_error = percentile(relative, 0.5);
  cell.p95_error = percentile(relative, 0.95);
}

void measure_tremor_floor(AccuracyCell& cell, const SweepTask& task) {
  std::vector<MotionPoint> points(task.motion.points().begin(), task.motion.points().end());
  for (MotionPoint& p : points) p.position += kTremorFloorM * Vec3::Ones().normalized();
  const std::vector<Vec3> aside = reference_of(task.scene, Motion(std::move(points))).force;
  cell.served = cell.scheme;
  set_errors(cell, compare(aside, task.reference.force, kSkipTicks).snr_db, relative_errors(aside, task.reference.force));
}

void measure_accuracy(AccuracyCell& cell, const SweepTask& task) {
  if (cell.row == AccuracyRow::tremor_floor) return measure_tremor_floor(cell, task);
  ReplayOptions options;
  select(cell.scheme, task.scene, options);
  options.link.latency = from_seconds(cell.rtt_ms * 0.5e-3);
  options.references = {&task.reference, 1};
  const ReplayResult result = replay(task.scene, task.motion, options, processor_ns);
  set_errors(cell, result.fidelity.snr_db, relative_errors(result));
  cell.served = offered(cell.scheme) ? compared(result.last_patch.scheme) : cell.scheme;
  cell.frame_bytes = result.patch_bytes_mean;
  cell.build_ms = result.patch_build_ms_mean;
  cell.tick_us = 1e-3 * result.tick_ns_p50;
}

/// Scenes of which the tool never meets the body in the examination: there is nothing to score.
std::vector<std::string> untouched_of(const SweepTasks& tasks) {
  std::vector<std::string> untouched;
  for (const auto& [name, task] : tasks)
    if (compare(task.reference.force, task.reference.force, kSkipTicks).contact_ticks == 0) untouched.push_back(name);
  return untouched;
}

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

std::string_view row_name(const AccuracyCell& c) { return kAccuracyRowNames[static_cast<std::size_t>(c.row)]; }

std::string title_of(const AccuracyCell& c) {
  if (c.row == AccuracyRow::as_sent) return std::string(name_of(c.scheme));
  return fmt::format("tremor noise floor, hand {:g} um off its path", 1e6 * kTremorFloorM);
}

std::filesystem::path curve_file(const std::filesystem::path& out, const AccuracyCell& c) {
  return out / fmt::format("accuracy-{}-{}-{}.csv", c.scene, name_of(c.scheme), row_name(c));
}

void write_curve(const std::filesystem::path& out, const AccuracyCells& curve) {
  std::string csv = "rtt_ms,snr_db,median_jnd,p95_jnd\n";
  for (const AccuracyCell& c : curve)
    fmt::format_to(std::back_inserter(csv), "{:g},{:.3f},{:.5g},{:.5g}\n", c.rtt_ms, c.snr_db, c.median_error / kForceJnd,
                   c.p95_error / kForceJnd);
  write_text(curve_file(out, curve.front()), csv);
}

/// Panel with the curves of a scene over the round trip.
GridPanel panel_of(const std::filesystem::path& out, const std::vector<AccuracyCells>& curves, const std::string& scene,
                   const std::string& what, const std::string& column, const std::string& setup) {
  const std::vector<ComparedScheme> schemes = compared_schemes();
  GridPanel panel{scene, "round trip [ms]", what, {}, setup};
  for (const AccuracyCells& curve : curves) {
    const AccuracyCell& c = curve.front();
    if (c.scene != scene || !has_round_trip(c)) continue;
    const auto style = static_cast<int>(std::find(schemes.begin(), schemes.end(), c.scheme) - schemes.begin()) + 1;
    panel.curves.push_back({column, title_of(c), style, curve_file(out, c), "linespoints"});
  }
  return panel;
}

void draw(const std::filesystem::path& out, const std::vector<AccuracyCells>& curves, bool fast_strokes) {
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
  plot_grid(out / "accuracy.svg",
            fmt::format("Force error against the round trip: {}", fast_strokes ? "fast strokes" : "press, stroke, tap, release"),
            2, panels);
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
           {"row", row_name(c)},
           {"served", name_of(c.served)},
           {"round_trips", rows}};
  if (!has_round_trip(c)) return all;
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
      fmt::print("\n{:<20} SNR [dB] at RTT [ms]", scene);
      for (const AccuracyCell& at : curve) fmt::print(" {:>5g}", at.rtt_ms);
      fmt::print("   p95 < 10 %   < 1 %  patch [B]  server [ms]  tick [us]\n");
    }
    fmt::print("  {:<39}", title_of(c) + (c.served == c.scheme ? "" : fmt::format(" ({})", name_of(c.served))));
    for (const AccuracyCell& at : curve) fmt::print(" {:>5.1f}", at.snr_db);
    if (!has_round_trip(c)) {
      fmt::print("\n");
      continue;
    }
    const auto firm = std::find_if(curve.begin(), curve.end(), [](const AccuracyCell& at) { return at.rtt_ms >= kFirmRttMs; });
    const AccuracyCell& cost = firm == curve.end() ? curve.back() : *firm;
    fmt::print("   {:>10} {:>7} {:>10.0f} {:>11.2f} {:>10.2f}\n", until(curve, kJndLimit), until(curve, kHundredth),
               cost.frame_bytes, cost.build_ms, cost.tick_us);
  }
}

std::string scene_of(const AccuracyCell& cell) { return cell.scene.substr(0, cell.scene.rfind('@')); }

/// Prints the mean and the least over the places of each scene, as a hand feels the error of its own place.
void print_places(const AccuracyCells& cells) {
  std::map<std::tuple<std::string, ComparedScheme, double>, std::pair<std::vector<double>, double>> all;
  for (const AccuracyCell& c : cells) {
    if (c.scene.find('@') == std::string::npos || !has_round_trip(c)) continue;
    auto& [snr_db, p95] = all[{scene_of(c), c.scheme, c.rtt_ms}];
    snr_db.push_back(c.snr_db);
    p95 = std::max(p95, c.p95_error);
  }
  if (!all.empty())
    fmt::print("\n{:<20} {:<9} {:>8} {:>14} {:>17} {:>14}\n", "scene, all places", "scheme", "RTT [ms]", "mean SNR [dB]",
               "minimum SNR [dB]", "worst p95 [%]");
  for (const auto& [key, value] : all) {
    const auto& [scene, scheme, rtt_ms] = key;
    const auto& [snr_db, p95] = value;
    const double mean = std::accumulate(snr_db.begin(), snr_db.end(), 0.0) / static_cast<double>(snr_db.size());
    fmt::print("{:<20} {:<9} {:>8g} {:>14.1f} {:>17.1f} {:>14.1f}\n", scene, name_of(scheme), rtt_ms, mean,
               *std::min_element(snr_db.begin(), snr_db.end()), 100 * p95);
  }
}

void report(const AccuracyCells& cells, const std::vector<std::string>& untouched, const std::filesystem::path& out,
            bool fast_strokes) {
  const std::vector<AccuracyCells> curves = curves_of(cells);
  if (!curves.empty()) draw(out, curves, fast_strokes);
  print(curves);
  print_places(cells);
  Json summary{{"jnd_share", kForceJnd}, {"curves", Json::array()}};
  for (const AccuracyCells& curve : curves) summary["curves"].push_back(to_json(curve));
  if (!untouched.empty()) summary["scenes_without_contact"] = untouched;
  write_json(out / "summary.json", summary);
  fmt::print("\n{}\n{}\n", (out / "accuracy.svg").string(), (out / "summary.json").string());
}

int run_accuracy(const AccuracyFlags& flags) {
  check_once_each("--rtt-ms", flags.rtt_ms);
  const auto out = make_output_folder(flags.out);
  SweepTasks tasks;
  std::vector<std::string> untouched;
  CellSweep<AccuracyCell> sweep{accuracy_table(), {}};
  if (!flags.cells.merge) sweep.cells = accuracy_cells(flags);
  sweep.prepare = [&](AccuracyCells& cells, unsigned jobs) {
    for (const AccuracyCell& cell : cells) add_examination(tasks, flags.scenes, cell.scene, flags.fast_strokes);
    add_references(tasks, jobs);
    untouched = untouched_of(tasks);
    std::erase_if(cells, [&](const AccuracyCell& cell) {
      return !suits(cell.scheme, tasks.at(cell.scene).scene.body) || std::ranges::count(untouched, cell.scene) > 0;
    });
  };
  sweep.measure = [&](AccuracyCell& cell) { measure_accuracy(cell, tasks.at(cell.scene)); };
  if (const auto cells = run_cells(sweep, flags.cells, out)) report(*cells, untouched, out, flags.fast_strokes);
  for (const std::string& scene : untouched)
    fmt::print(stderr, "palpate-lab: no contact: the motion never meets the body of {}, so it is not scored\n", scene);
  return untouched.empty() ? 0 : 1;
}

}  // namespace

void add_accuracy(CLI::App& app, Run& run) {
  auto flags = std::make_shared<AccuracyFlags>();
  CLI::App* c = app.add_subcommand("accuracy",
                                   "measure the force error over the round trip, for every scheme on every scene, and its cost");
  c->add_option("--scenes", flags->scenes, "folder of the scenes")->type_name("DIR")->capture_default_str();
  c->add_option("--only", flags->only, "only these scenes, by file name without .json, separated by commas")
      ->type_name("NAME")
      ->delimiter(',');
  c->add_option("--schemes", flags->schemes, "only these schemes, separated by commas")->type_name("NAME")->delimiter(',');
  c->add_flag("--quick", flags->quick, "use five round trips instead of eleven");
  c->add_option("--rtt-ms", flags->rtt_ms, "use only these round trips, separated by commas")
      ->type_name("MS")
      ->delimiter(',')
      ->check(CLI::Range(0.0, 2000.0));
  c->add_flag("--as-sent", flags->as_sent, "leave out the tremor noise floor");
  c->add_flag("--fast-strokes", flags->fast_strokes, "stroke at up to 131 mm/s, and leave out the examination");
  c->add_option("--places", flags->places, "number of places drawn on the surface of each scene; 0: its top")
      ->type_name("N")
      ->check(CLI::Range(0, 64));
  flags->cells.add_to(*c);
  c->add_option("--out", flags->out, "folder for cells.csv, summary.json and accuracy.svg")->type_name("DIR")->required();
  c->callback([flags, &run] { run = [flags] { return run_accuracy(*flags); }; });
}

}  // namespace palpate
