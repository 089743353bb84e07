// palpate-lab masking: effects of the network that a hand can notice, for every scheme, over round trip, jitter and loss.
//
// A cell is one motion on one body through one scheme over one link (replay.hpp). Bodies are touched scenes, so that contacts
// begin and end; motions are those of scenes/motions, raised so that they begin 1 mm above the middle of the top.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <limits>
#include <set>

#include "bench/fidelity/replay.hpp"
#include "bench/lab/cells.hpp"
#include "bench/lab/experiments.hpp"
#include "bench/lab/tasks.hpp"
#include "bench/measure/gestures.hpp"
#include "bench/output/plot.hpp"
#include "bench/paper/compared_scheme.hpp"
#include "server/body/unload.hpp"

namespace palpate {
namespace {

/// Link for which the design's promise holds: 20 ms jitter, 5 % loss; also tried without loss, and without either.
constexpr double kPromisedJitterMs = 20, kPromisedLossPct = 5, kPromisedDropDb = 1.5;
/// Mean run of lost datagrams on the burst axis: four patches, 0.2 s at 20 Hz.
constexpr double kBurstMean = 4;

struct MaskingLink {
  double rtt_ms = 0, jitter_ms = 0, loss_pct = 0, burst = 0;
  std::uint64_t seed = 1;
  bool operator==(const MaskingLink&) const = default;
};

struct MaskingCell {
  std::string body, motion;
  ComparedScheme scheme = ComparedScheme::port;
  MaskingLink link;
  // Results:
  double snr_db = 0, p95_over_jnd = 0;
  OnsetErrors onset;
  HandOverSteps hand_over, felt_step;
  double age_p95_ms = 0, uplink_bytes_s = 0;
};
using MaskingCells = std::vector<MaskingCell>;

CellTable<MaskingCell> masking_table() {
  CellTable<MaskingCell> table;
  table.parameter("body", &MaskingCell::body)
      .parameter("motion", &MaskingCell::motion)
      .parameter("scheme", &MaskingCell::scheme, kComparedSchemeNames)
      .parameter("rtt_ms", within(&MaskingCell::link, &MaskingLink::rtt_ms), "{:g}")
      .parameter("jitter_ms", within(&MaskingCell::link, &MaskingLink::jitter_ms), "{:g}")
      .parameter("loss_pct", within(&MaskingCell::link, &MaskingLink::loss_pct), "{:g}")
      .parameter("burst", within(&MaskingCell::link, &MaskingLink::burst), "{:g}")
      .parameter("seed", within(&MaskingCell::link, &MaskingLink::seed))
      .result("snr_db", &MaskingCell::snr_db, "{:.4f}")
      .result("p95_over_jnd", &MaskingCell::p95_over_jnd, "{:.5g}")
      .result("onsets", within(&MaskingCell::onset, &OnsetErrors::onsets))
      .result("onsets_missed", within(&MaskingCell::onset, &OnsetErrors::missed))
      .result("onset_worst_ms", within(&MaskingCell::onset, &OnsetErrors::worst_ms))
      .result("onset_median_ms", within(&MaskingCell::onset, &OnsetErrors::median_ms))
      .result("swaps", within(&MaskingCell::hand_over, &HandOverSteps::swaps))
      .result("step_p999_n", within(&MaskingCell::hand_over, &HandOverSteps::p999_n), "{:.5g}")
      .result("step_share_within", within(&MaskingCell::hand_over, &HandOverSteps::share_within), "{:.5g}")
      .result("felt_p999_n", within(&MaskingCell::felt_step, &HandOverSteps::p999_n), "{:.5g}")
      .result("felt_share_within", within(&MaskingCell::felt_step, &HandOverSteps::share_within), "{:.5g}")
      .result("age_p95_ms", &MaskingCell::age_p95_ms, "{:.3f}")
      .result("uplink_bytes_s", &MaskingCell::uplink_bytes_s, "{:.0f}");
  return table;
}

struct MaskingFlags {
  std::string out, scenes = "scenes";
  std::vector<std::string> schemes, axes{"rtt", "jitter", "loss", "burst"};
  bool quick = false;
  double rtt_ms = 150;
  CellFlags cells;
};

/// The promised link, with and without loss and jitter, and the links along the axes, each once.
std::vector<MaskingLink> links_of(const MaskingFlags& flags) {
  const double r = flags.rtt_ms;
  const auto wanted = [&](const char* axis) { return std::ranges::count(flags.axes, axis) > 0; };
  std::vector<MaskingLink> links{{r, 0, 0, 0, 1}};
  const auto add = [&](const MaskingLink& link) {
    if (std::ranges::count(links, link) == 0) links.push_back(link);
  };
  for (const std::uint64_t seed : flags.quick ? std::vector<std::uint64_t>{1} : std::vector<std::uint64_t>{1, 2, 3})
    for (const double loss : {0.0, kPromisedLossPct}) add({r, kPromisedJitterMs, loss, 0, seed});
  if (wanted("rtt"))
    for (const double rtt : flags.quick ? std::vector{0.0, 500.0} : std::vector{0.0, 50.0, 100.0, 200.0, 300.0, 400.0, 500.0})
      add({rtt, 0, 0, 0, 1});
  if (flags.quick) return links;
  if (wanted("jitter"))
    for (const double jitter : {10.0, 35.0, 50.0}) add({r, jitter, 0, 0, 1});
  if (wanted("loss"))
    for (const double loss : {1.0, 5.0, 10.0, 20.0, 30.0}) add({r, 0, loss, 0, 1});
  if (wanted("burst"))
    for (const double loss : {5.0, 15.0, 30.0}) add({r, 0, loss, kBurstMean, 1});
  return links;
}

MaskingCells masking_cells(const MaskingFlags& flags) {
  const std::vector<std::string> bodies =
      flags.quick ? std::vector<std::string>{"softcore"} : std::vector<std::string>{"softcore", "stiff", "stiffening"};
  const std::vector<std::string> motions =
      flags.quick ? std::vector<std::string>{"press", "tap"} : std::vector<std::string>{"press", "stroke", "tap", "grip-release"};
  MaskingCells cells(1);
  cells = crossed(crossed(cells, &MaskingCell::body, bodies), &MaskingCell::motion, motions);
  return crossed(crossed(cells, &MaskingCell::link, links_of(flags)), &MaskingCell::scheme,
                 compared_schemes_named(flags.schemes));
}

Motion lifted_above(const Scene& scene, const Motion& motion, double until_s) {
  const Vec3 shift = start_of(scene) - motion.position(0.0);
  std::vector<MotionPoint> points;
  for (const MotionPoint& p : motion.points())
    if (p.t_s <= until_s) points.push_back({p.t_s, p.position + shift});
  return Motion(std::move(points));
}

std::string task_of(const MaskingCell& cell) { return cell.body + ' ' + cell.motion; }

SweepTasks load_tasks(const MaskingFlags& flags, const MaskingCells& cells) {
  constexpr double kQuickS = 1.2, kWhole = 1e9;
  const std::filesystem::path folder = flags.scenes;
  SweepTasks tasks;
  for (const MaskingCell& cell : cells) {
    if (tasks.contains(task_of(cell))) continue;
    const Scene scene = open_scene((folder / ("touch-" + cell.body + ".json")).string());
    const Motion motion = read_motion(folder / "motions" / (cell.motion + ".csv"));
    tasks.emplace(task_of(cell), SweepTask{scene, lifted_above(scene, motion, flags.quick ? kQuickS : kWhole), {}});
  }
  return tasks;
}

void measure_masking(MaskingCell& cell, const SweepTask& task) {
  ReplayOptions options;
  select(cell.scheme, task.scene, options);
  options.link = {.latency = from_seconds(cell.link.rtt_ms * 0.5e-3),
                  .jitter = from_seconds(cell.link.jitter_ms * 1e-3),
                  .loss = cell.link.loss_pct / 100,
                  .burst_mean = cell.link.burst,
                  .seed = cell.link.seed};
  options.seed = cell.link.seed;
  options.references = {&task.reference, 1};
  const ReplayResult result = replay(task.scene, task.motion, options, [] { return std::int64_t{0}; });
  cell.snr_db = result.fidelity.snr_db;
  cell.p95_over_jnd = result.fidelity.p95_rel_error / kForceJnd;
  cell.onset = result.onset;
  cell.hand_over = result.hand_over;
  cell.felt_step = result.felt_step;
  cell.age_p95_ms = 1e3 * seconds(result.age_p95);
  cell.uplink_bytes_s = result.uplink_bytes_s;
}

MaskingCells those(const MaskingCells& cells, const std::function<bool(const MaskingCell&)>& wanted) {
  MaskingCells chosen;
  std::copy_if(cells.begin(), cells.end(), std::back_inserter(chosen), wanted);
  return chosen;
}

double median(const MaskingCells& cells, const std::function<double(const MaskingCell&)>& value) {
  std::vector<double> values;
  for (const MaskingCell& c : cells) values.push_back(value(c));
  return percentile(std::move(values), 0.5);
}

/// Many cells in one line: the median of figures that are alike in all, the worst of those that must never be bad.
struct Digest {
  std::size_t swaps = 0;
  double snr_db = 0, p95_over_jnd = 0;
  int onsets = 0, onsets_missed = 0, onset_worst_ms = 0;
  double onset_median_ms = 0, step_worst_n = 0, step_within = 1, felt_worst_n = 0, felt_within = 1, uplink_bytes_s = 0;
};

Digest digest(const MaskingCells& cells) {
  Digest d;
  d.snr_db = median(cells, [](const MaskingCell& c) { return c.snr_db; });
  d.p95_over_jnd = median(cells, [](const MaskingCell& c) { return c.p95_over_jnd; });
  double step_within = 0, felt_within = 0;
  MaskingCells met;
  for (const MaskingCell& c : cells) {
    d.swaps += c.hand_over.swaps;
    step_within += c.hand_over.share_within * static_cast<double>(c.hand_over.swaps);
    felt_within += c.felt_step.share_within * static_cast<double>(c.hand_over.swaps);
    d.step_worst_n = std::max(d.step_worst_n, c.hand_over.p999_n);
    d.felt_worst_n = std::max(d.felt_worst_n, c.felt_step.p999_n);
    d.onsets += c.onset.onsets;
    d.onsets_missed += c.onset.missed;
    if (std::abs(c.onset.worst_ms) > std::abs(d.onset_worst_ms)) d.onset_worst_ms = c.onset.worst_ms;
    d.uplink_bytes_s = std::max(d.uplink_bytes_s, c.uplink_bytes_s);
    if (c.onset.onsets > c.onset.missed) met.push_back(c);
  }
  d.onset_median_ms = median(met, [](const MaskingCell& c) { return c.onset.median_ms; });
  if (d.swaps > 0) {
    d.step_within = step_within / static_cast<double>(d.swaps);
    d.felt_within = felt_within / static_cast<double>(d.swaps);
  }
  return d;
}

struct Axis {
  const char* name;
  const char* label;
  double MaskingLink::*value;
  double burst;  ///< mean run of losses; the point without loss belongs to both
};
constexpr Axis kAxes[] = {{"rtt", "round trip [ms]", &MaskingLink::rtt_ms, 0},
                          {"jitter", "jitter, each way +- [ms]", &MaskingLink::jitter_ms, 0},
                          {"loss", "datagrams lost, each way [%]", &MaskingLink::loss_pct, 0},
                          {"burst", "datagrams lost in runs of 4 (mean), each way [%]", &MaskingLink::loss_pct, kBurstMean}};

/// Cells along one axis through (rtt, no jitter, no loss).
MaskingCells along(const MaskingCells& cells, const Axis& axis, double rtt_ms) {
  return those(cells, [&](const MaskingCell& c) {
    MaskingLink l = c.link;
    if (l.loss_pct > 0 && l.burst != axis.burst) return false;
    l.*axis.value = axis.value == &MaskingLink::rtt_ms ? rtt_ms : 0;
    return l.rtt_ms == rtt_ms && l.jitter_ms == 0 && l.loss_pct == 0;
  });
}

void plot_axis(const std::filesystem::path& out, const Axis& axis, const MaskingCells& cells, double rtt_ms) {
  std::set<double> xs;
  std::vector<ComparedScheme> schemes;
  for (const MaskingCell& c : cells) {
    xs.insert(c.link.*axis.value);
    if (std::find(schemes.begin(), schemes.end(), c.scheme) == schemes.end()) schemes.push_back(c.scheme);
  }
  if (xs.size() < 2) return;
  std::string csv = axis.value == &MaskingLink::rtt_ms      ? "rtt_ms"
                    : axis.value == &MaskingLink::jitter_ms ? "jitter_ms"
                                                            : "loss_pct";
  for (const ComparedScheme s : schemes)
    csv += fmt::format(",{0}_snr_db,{0}_p95_over_jnd,{0}_onset_worst_ms,{0}_felt_step_n,{0}_uplink_kb_s", name_of(s));
  csv += '\n';
  for (const double x : xs) {
    fmt::format_to(std::back_inserter(csv), "{:g}", x);
    for (const ComparedScheme s : schemes) {
      const MaskingCells here = those(cells, [&](const MaskingCell& c) { return c.scheme == s && c.link.*axis.value == x; });
      if (here.empty()) {
        csv += ",nan,nan,nan,nan,nan";
        continue;
      }
      const Digest d = digest(here);
      fmt::format_to(std::back_inserter(csv), ",{:.3f},{:.4g},{},{:.4g},{:.4g}", d.snr_db, d.p95_over_jnd,
                     std::abs(d.onset_worst_ms), d.felt_worst_n, 1e-3 * d.uplink_bytes_s);
    }
    csv += '\n';
  }
  const auto file = out / fmt::format("masking-{}.csv", axis.name);
  write_text(file, csv);
  std::vector<Panel> panels{{"force SNR [dB], median", {}},
                            {"p95 error / JND, median", {}, true},
                            {"onset error [ms], worst", {}, false, "set yrange [0:*]"},
                            {"felt step at swaps [N], p99.9", {}, false, "set yrange [0:*]"},
                            {"sent to the server [kB/s], most", {}, false, "set yrange [0:*]"}};
  const auto columns = panels.size();
  for (std::size_t k = 0; k < schemes.size(); ++k)
    for (std::size_t p = 0; p < columns; ++p)
      panels[p].curves.push_back({fmt::format("1:{}", 2 + columns * k + p),
                                  std::string(name_of(schemes[k])),
                                  static_cast<int>(k) + 1,
                                  {},
                                  "linespoints"});
  constexpr const char* kDashed = "lines dt 2";
  panels[1].curves.push_back({"1:(1)", "just noticed", 8, {}, kDashed});
  panels[3].curves.push_back({fmt::format("1:({})", kStepLimitN), "least limit", 8, {}, kDashed});
  const bool over_rtt = axis.value == &MaskingLink::rtt_ms;
  plot_csv(
      file, out / fmt::format("masking-{}.svg", axis.name),
      over_rtt ? "What the hand notices, without jitter or loss" : fmt::format("What the hand notices at {:g} ms RTT", rtt_ms),
      axis.label, panels);
}

Json to_json(const Digest& d) {
  return {{"snr_db", d.snr_db},
          {"p95_over_jnd", d.p95_over_jnd},
          {"onsets", d.onsets},
          {"onsets_missed", d.onsets_missed},
          {"onset_median_ms", d.onset_median_ms},
          {"onset_worst_ms", d.onset_worst_ms},
          {"swaps", d.swaps},
          {"step_p999_worst_n", d.step_worst_n},
          {"step_share_within", d.step_within},
          {"felt_step_p999_worst_n", d.felt_worst_n},
          {"felt_step_share_within", d.felt_within},
          {"uplink_bytes_s", d.uplink_bytes_s}};
}

/// Reduction of the SNR by loss: each cell with the promised loss against its twin without, with the same jitter and draws.
struct Drops {
  double mean_db = 0, worst_db = -std::numeric_limits<double>::infinity();
  std::string worst_where;
  std::size_t count = 0;
};

Drops drops_of(const MaskingCells& lossy, const MaskingCells& clean) {
  Drops drops;
  for (const MaskingCell& c : lossy)
    for (const MaskingCell& twin : clean) {
      if (twin.scheme != c.scheme || twin.body != c.body || twin.motion != c.motion || twin.link.seed != c.link.seed) continue;
      const double drop_db = twin.snr_db - c.snr_db;
      drops.mean_db += drop_db;
      ++drops.count;
      if (drop_db <= drops.worst_db) continue;
      drops.worst_db = drop_db;
      drops.worst_where = fmt::format("{} on {}, seed {}", c.motion, c.body, c.link.seed);
    }
  if (drops.count > 0) drops.mean_db /= static_cast<double>(drops.count);
  return drops;
}

Json promise(const MaskingCells& cells, double rtt_ms) {
  const auto at = [&](ComparedScheme scheme, double jitter_ms, double loss_pct) {
    return those(cells, [&](const MaskingCell& c) {
      return c.scheme == scheme && c.link.rtt_ms == rtt_ms && c.link.jitter_ms == jitter_ms && c.link.loss_pct == loss_pct &&
             c.link.burst == 0;
    });
  };
  fmt::print("\nRTT {:g} ms, {:g} ms jitter, {:g} % loss, over all bodies and motions:\n\n", rtt_ms, kPromisedJitterMs,
             kPromisedLossPct);
  fmt::print("  {:<9} {:>9} {:>9} {:>9} {:>10} {:>10} {:>8} {:>11} {:>11} {:>7} {:>9} {:>10} {:>10} {:>11}\n", "", "SNR calm",
             "no loss", "loss", "mean drop", "worst drop", "p95/JND", "onset, med.", "worst onset", "missed", "raw p99.9",
             "raw within", "felt p99.9", "felt within");
  fmt::print("  {:<9} {:>9} {:>9} {:>9} {:>10} {:>10} {:>8} {:>11} {:>11} {:>7} {:>9} {:>10} {:>10} {:>11}\n", "scheme", "[dB]",
             "[dB]", "[dB]", "[dB]", "[dB]", "[-]", "[ms]", "[ms]", "[-]", "[N]", "[%]", "[N]", "[%]");
  Json json;
  for (const ComparedScheme scheme : compared_schemes()) {
    const MaskingCells lossy = at(scheme, kPromisedJitterMs, kPromisedLossPct), clean = at(scheme, kPromisedJitterMs, 0);
    if (lossy.empty() || clean.empty()) continue;
    const Digest d = digest(lossy);
    const double calm_db = digest(at(scheme, 0, 0)).snr_db, clean_db = digest(clean).snr_db;
    const Drops drops = drops_of(lossy, clean);
    fmt::print(
        "  {:<9} {:>9.1f} {:>9.1f} {:>9.1f} {:>10.2f} {:>10.2f} {:>8.2f} {:>11g} {:>11} {:>7} {:>9.3f} {:>10.1f} {:>10.3f} "
        "{:>11.1f}\n",
        name_of(scheme), calm_db, clean_db, d.snr_db, drops.mean_db, drops.worst_db, d.p95_over_jnd, d.onset_median_ms,
        d.onset_worst_ms, d.onsets_missed, d.step_worst_n, 100 * d.step_within, d.felt_worst_n, 100 * d.felt_within);
    Json& j = json[std::string(name_of(scheme))] = to_json(d);
    j["calm_snr_db"] = calm_db;
    j["loss_free_snr_db"] = clean_db;
    j["drop_mean_db"] = drops.mean_db;
    j["drop_worst_db"] = drops.worst_db;
    if (scheme == ComparedScheme::port) {
      fmt::print("  {:<9} largest drop by loss: {:.2f} dB, {}\n", "", drops.worst_db, drops.worst_where);
      j["drop_within_promise"] = drops.worst_db <= kPromisedDropDb ? 1 : 0;
      j["steps_within_promise"] = d.felt_within >= 0.999 ? 1 : 0;
    }
  }
  fmt::print(
      "\n  SNR is the median against the full model at 1 kHz; the calm link has neither jitter nor loss. A p95/JND of 1 is just "
      "noticed\n  (10 % of the force). The raw step is the difference between two patches at a swap, the felt step the largest "
      "change "
      "from one\n  tick to the next in the cross-fade. A step is within if it is at most 0.05 N or 5 % of the force, whichever "
      "is larger. "
      "The\n  promise of 99.9 % is about the felt step.\n\n");
  return json;
}

void port_by_body(const MaskingCells& cells, double rtt_ms) {
  const MaskingCells port = those(cells, [&](const MaskingCell& c) {
    return c.scheme == ComparedScheme::port && c.link.rtt_ms == rtt_ms && c.link.jitter_ms == kPromisedJitterMs;
  });
  if (port.empty()) return;
  fmt::print("  port on {:<12} {:<13} {:>13} {:>10} {:>11} {:>16} {:>13}\n", "body", "motion", "no loss [dB]", "loss [dB]",
             "p95/JND [-]", "worst onset [ms]", "felt step [N]");
  std::set<std::pair<std::string, std::string>> kinds;
  for (const MaskingCell& c : port) kinds.insert({c.body, c.motion});
  for (const auto& [body, motion] : kinds) {
    const auto at = [&](double loss_pct) {
      return digest(
          those(port, [&](const MaskingCell& c) { return c.body == body && c.motion == motion && c.link.loss_pct == loss_pct; }));
    };
    const Digest clean = at(0), lossy = at(kPromisedLossPct);
    fmt::print("          {:<12} {:<13} {:>13.1f} {:>10.1f} {:>11.2f} {:>16} {:>13.3f}\n", body, motion, clean.snr_db,
               lossy.snr_db, lossy.p95_over_jnd, lossy.onset_worst_ms, lossy.felt_worst_n);
  }
}

void report(const MaskingCells& cells, const std::filesystem::path& out, double rtt_ms) {
  for (const Axis& axis : kAxes) plot_axis(out, axis, along(cells, axis, rtt_ms), rtt_ms);
  Json summary{{"cells", cells.size()}, {"rtt_ms", rtt_ms}, {"jitter_ms", kPromisedJitterMs}, {"loss_pct", kPromisedLossPct}};
  summary["schemes"] = promise(cells, rtt_ms);
  port_by_body(cells, rtt_ms);
  write_json(out / "summary.json", summary);
  fmt::print("\n{}\n", (out / "summary.json").string());
}

int run_masking(const MaskingFlags& flags) {
  const auto out = make_output_folder(flags.out);
  SweepTasks tasks;
  CellSweep<MaskingCell> sweep{masking_table(), masking_cells(flags)};
  sweep.prepare = [&](const MaskingCells& cells, unsigned jobs) {
    tasks = load_tasks(flags, cells);
    add_references(tasks, jobs);
  };
  sweep.measure = [&](MaskingCell& cell) { measure_masking(cell, tasks.at(task_of(cell))); };
  if (const auto cells = run_cells(sweep, flags.cells, out)) report(*cells, out, flags.rtt_ms);
  return 0;
}

}  // namespace

void add_masking(CLI::App& app, Run& run) {
  auto flags = std::make_shared<MaskingFlags>();
  CLI::App* c = app.add_subcommand(
      "masking",
      "measure what a hand notices of the network: force error, onset of contact and steps at swaps, for every scheme");
  c->add_option("--rtt-ms", flags->rtt_ms, "round trip at which jitter and loss are varied")
      ->check(number_from<double>(0, 2'000));
  c->add_option("--schemes", flags->schemes, "only these schemes, separated by commas")->type_name("NAME")->delimiter(',');
  c->add_option("--axes", flags->axes, "vary only these in addition to the promised link (20 ms jitter, 5 % loss), or none")
      ->delimiter(',')
      ->check(one_of({"rtt", "jitter", "loss", "burst", "none"}));
  c->add_flag("--quick", flags->quick, "use one body, two short motions and the ends of the axes");
  c->add_option("--scenes", flags->scenes, "folder of the scenes and motions")->type_name("DIR")->capture_default_str();
  flags->cells.add_to(*c);
  c->add_option("--out", flags->out, "folder for summary.json, cells.csv, masking-*.csv and .svg")->type_name("DIR")->required();
  c->callback([flags, &run] { run = [flags] { return run_masking(*flags); }; });
}

}  // namespace palpate
