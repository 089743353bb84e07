// palpate-lab masking: effects of the network that a hand can notice, for every scheme, over round trip, jitter and loss.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <limits>
#include <set>

#include "bench/lab/experiments.hpp"
#include "bench/lab/masking_cells.hpp"
#include "bench/lab/shards.hpp"
#include "bench/output/output.hpp"
#include "bench/output/plot.hpp"
#include "bench/output/routes.hpp"
#include "common/base/error.hpp"

namespace palpate {
namespace {

struct MaskingFlags {
  std::string out, route, scenes = "scenes";
  std::vector<std::string> schemes, axes;
  bool quick = false;
  ShardFlags shards;
};

using MaskingCells = std::vector<MaskingCell>;

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
  fmt::print("  {:<9} {:>7} {:>7} {:>7} {:>11} {:>7} {:>14} {:>7} {:>17} {:>17}\n", "scheme", "calm", "no loss", "loss",
             "drop [dB]", "p95/JND", "onset [ms]", "missed", "between patches", "felt in 1 ms");
  fmt::print("  {:<9} {:>7} {:>7} {:>7} {:>11} {:>7} {:>14} {:>7} {:>17} {:>17}\n", "", "[dB]", "[dB]", "[dB]", "mean, worst", "",
             "median, worst", "", "p99.9 [N], within", "p99.9 [N], within");
  Json json;
  for (const ComparedScheme scheme : compared_schemes()) {
    const MaskingCells lossy = at(scheme, kPromisedJitterMs, kPromisedLossPct), clean = at(scheme, kPromisedJitterMs, 0);
    if (lossy.empty() || clean.empty()) continue;
    const Digest d = digest(lossy);
    const double calm_db = digest(at(scheme, 0, 0)).snr_db, clean_db = digest(clean).snr_db;
    const Drops drops = drops_of(lossy, clean);
    fmt::print(
        "  {:<9} {:>7.1f} {:>7.1f} {:>7.1f} {:>5.2f} {:>5.2f} {:>7.2f} {:>7g} {:>6} {:>7} {:>8.3f} {:>6.1f} % {:>8.3f} {:>6.1f} "
        "%\n",
        name_of(scheme), calm_db, clean_db, d.snr_db, drops.mean_db, drops.worst_db, d.p95_over_jnd, d.onset_median_ms,
        d.onset_worst_ms, d.onsets_missed, d.step_worst_n, 100 * d.step_within, d.felt_worst_n, 100 * d.felt_within);
    Json& j = json[std::string(name_of(scheme))] = to_json(d);
    j["calm_snr_db"] = calm_db;
    j["loss_free_snr_db"] = clean_db;
    j["drop_mean_db"] = drops.mean_db;
    j["drop_worst_db"] = drops.worst_db;
    if (scheme == ComparedScheme::port) {
      fmt::print("  {:<9} most taken by loss: {:.2f} dB, {}\n", "", drops.worst_db, drops.worst_where);
      j["drop_within_promise"] = drops.worst_db <= kPromisedDropDb ? 1 : 0;
      j["steps_within_promise"] = d.felt_within >= 0.999 ? 1 : 0;
    }
  }
  fmt::print(
      "\n  SNR in dB against the full model at 1 kHz (median); calm: no jitter, no loss. p95/JND: 1 is just noticed (10 % of the "
      "force).\n"
      "  within: share of the swaps whose step is at most 0.05 N or 5 % of the force, whichever is larger: raw, between the old "
      "patch\n"
      "  and the new one (nobody feels it), and felt, from one tick to the next in the cross-fade. The promise of 99.9 % is "
      "about "
      "felt.\n\n");
  return json;
}

void port_by_body(const MaskingCells& cells, double rtt_ms) {
  const MaskingCells port = those(cells, [&](const MaskingCell& c) {
    return c.scheme == ComparedScheme::port && c.link.rtt_ms == rtt_ms && c.link.jitter_ms == kPromisedJitterMs;
  });
  if (port.empty()) return;
  fmt::print("  port on {:<12} {:<13} {:>13} {:>10} {:>8} {:>11} {:>10}\n", "body", "motion", "no loss [dB]", "loss [dB]",
             "p95/JND", "onset [ms]", "felt [N]");
  std::set<std::pair<std::string, std::string>> kinds;
  for (const MaskingCell& c : port) kinds.insert({c.body, c.motion});
  for (const auto& [body, motion] : kinds) {
    const auto at = [&](double loss_pct) {
      return digest(
          those(port, [&](const MaskingCell& c) { return c.body == body && c.motion == motion && c.link.loss_pct == loss_pct; }));
    };
    const Digest clean = at(0), lossy = at(kPromisedLossPct);
    fmt::print("          {:<12} {:<13} {:>13.1f} {:>10.1f} {:>8.2f} {:>11} {:>10.3f}\n", body, motion, clean.snr_db,
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

int merge(const std::filesystem::path& out, double rtt_ms) {
  const MaskingCells cells = merged_cells(out, read_cells);
  write_text(out / "cells.csv", cells_csv(cells));
  report(cells, out, rtt_ms);
  return 0;
}

int run_masking(const MaskingFlags& flags) {
  MaskingGrid grid;
  grid.quick = flags.quick;
  grid.scenes = flags.scenes;
  for (const std::string& name : flags.schemes) grid.schemes.push_back(compared_scheme(name, "--schemes"));
  if (!flags.route.empty()) {
    grid.rtt_ms = route_from_name(flags.route).rtt_ms;
    grid.axes = {"jitter", "loss", "burst"};
  }
  if (!flags.axes.empty()) grid.axes = flags.axes;
  const Shard shard = Shard::from(flags.shards.shard);
  const auto out = make_output_folder(flags.out);
  if (flags.shards.merge) return merge(out, grid.rtt_ms);
  const MaskingCells all = masking_cells(grid);
  MaskingCells cells = shard.part_of(all);
  fmt::print("{} runs of {}\n", cells.size(), all.size());
  measure_cells(grid, cells, flags.shards.jobs);
  const auto file = shard.file(out);
  write_text(file, cells_csv(cells));
  if (shard.of > 1)
    fmt::print("{}\n", file.string());
  else
    report(cells, out, grid.rtt_ms);
  return 0;
}

}  // namespace

void add_masking(CLI::App& app, Run& run) {
  auto flags = std::make_shared<MaskingFlags>();
  CLI::App* c = app.add_subcommand(
      "masking", "what the hand notices of the network: force error, onset of contact, steps at swaps, for every scheme");
  c->add_option("--route", flags->route,
                "around the round trip of a measured route instead of 150 ms: san-francisco, bangalore, buenos-aires, shanghai")
      ->type_name("NAME");
  c->add_option("--schemes", flags->schemes, "these alone, separated by commas")->type_name("NAME")->delimiter(',');
  c->add_option("--axes", flags->axes, "these sweeps beside the link of the promise (20 ms jitter, 5 % loss), or none of them")
      ->delimiter(',')
      ->check(one_of({"rtt", "jitter", "loss", "burst", "none"}));
  c->add_flag("--quick", flags->quick, "one body, two short motions, the ends of the axes");
  c->add_option("--scenes", flags->scenes, "folder of the scenes and motions")->type_name("DIR")->capture_default_str();
  flags->shards.add_to(*c);
  c->add_option("--out", flags->out, "folder for summary.json, cells.csv, masking-*.csv and .svg")->type_name("DIR")->required();
  c->callback([flags, &run] { run = [flags] { return run_masking(*flags); }; });
}

}  // namespace palpate
