#include "bench/lab/masking_cells.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <sstream>

#include "bench/lab/parallel.hpp"
#include "bench/lab/shards.hpp"
#include "bench/lab/tasks.hpp"
#include "common/base/error.hpp"
#include "server/body/unload.hpp"
#include "server/room/room.hpp"

namespace palpate {
namespace {

constexpr double kHomeAboveM = 0.020, kStartAboveM = 0.001;  // Room::home(), and the start of the motions

void add_once(std::vector<MaskingLink>& links, const MaskingLink& link) {
  if (std::find(links.begin(), links.end(), link) == links.end()) links.push_back(link);
}

std::vector<MaskingLink> links_of(const MaskingGrid& grid) {
  const double r = grid.rtt_ms;
  std::vector<MaskingLink> links{{r, 0, 0, 0, 1}};
  for (const std::uint64_t seed : grid.quick ? std::vector<std::uint64_t>{1} : std::vector<std::uint64_t>{1, 2, 3})
    for (const double loss : {0.0, kPromisedLossPct}) add_once(links, {r, kPromisedJitterMs, loss, 0, seed});
  const auto wanted = [&](const char* axis) { return std::find(grid.axes.begin(), grid.axes.end(), axis) != grid.axes.end(); };
  if (wanted("rtt"))
    for (const double rtt : grid.quick ? std::vector{0.0, 500.0} : std::vector{0.0, 50.0, 100.0, 200.0, 300.0, 400.0, 500.0})
      add_once(links, {rtt, 0, 0, 0, 1});
  if (grid.quick) return links;
  if (wanted("jitter"))
    for (const double jitter : {10.0, 35.0, 50.0}) add_once(links, {r, jitter, 0, 0, 1});
  if (wanted("loss"))
    for (const double loss : {1.0, 5.0, 10.0, 20.0, 30.0}) add_once(links, {r, 0, loss, 0, 1});
  if (wanted("burst"))
    for (const double loss : {5.0, 15.0, 30.0}) add_once(links, {r, 0, loss, kBurstMean, 1});
  return links;
}

Motion lifted_above(const Scene& scene, const Motion& motion, double until_s) {
  const Vec3 shift = home_of(scene) - Vec3(0, 0, kHomeAboveM - kStartAboveM) - motion.position(0.0);
  std::vector<MotionPoint> points;
  for (const MotionPoint& p : motion.points())
    if (p.t_s <= until_s) points.push_back({p.t_s, p.position + shift});
  return Motion(std::move(points));
}

std::string task_of(const MaskingCell& cell) { return cell.body + ' ' + cell.motion; }

SweepTasks load_tasks(const MaskingGrid& grid, const std::vector<MaskingCell>& cells) {
  constexpr double kQuickS = 1.2, kWhole = 1e9;
  SweepTasks tasks;
  for (const MaskingCell& cell : cells) {
    if (tasks.contains(task_of(cell))) continue;
    const Scene scene = open_scene((grid.scenes / ("touch-" + cell.body + ".json")).string());
    const Motion motion = read_motion(grid.scenes / "motions" / (cell.motion + ".csv"));
    tasks.emplace(task_of(cell), SweepTask{scene, lifted_above(scene, motion, grid.quick ? kQuickS : kWhole), {}});
  }
  return tasks;
}

void measure_cell(MaskingCell& cell, const SweepTask& task) {
  ReplayOptions options;
  select(cell.scheme, task.scene, options);
  options.link = {.latency = from_seconds(cell.link.rtt_ms * 0.5e-3),
                  .jitter = from_seconds(cell.link.jitter_ms * 1e-3),
                  .loss = cell.link.loss_pct / 100,
                  .burst_mean = cell.link.burst,
                  .seed = cell.link.seed};
  options.seed = cell.link.seed;
  options.reference = &task.reference;
  const ReplayResult result = replay(task.scene, task.motion, options, [] { return std::int64_t{0}; });
  cell.snr_db = result.fidelity.snr_db;
  cell.p95_over_jnd = result.fidelity.p95_rel_error / kForceJnd;
  cell.onset = result.onset;
  cell.hand_over = result.hand_over;
  cell.felt_step = result.felt_step;
  cell.age_p95_ms = 1e3 * seconds(result.age_p95);
  cell.uplink_bytes_s = result.uplink_bytes_s;
}

constexpr const char* kHeader =
    "body,motion,scheme,rtt_ms,jitter_ms,loss_pct,burst,seed,snr_db,p95_over_jnd,onsets,onsets_missed,onset_worst_ms,"
    "onset_median_ms,swaps,step_p50_n,step_p999_n,step_max_n,step_share_within,felt_p50_n,felt_p999_n,felt_max_n,"
    "felt_share_within,age_p95_ms,uplink_bytes_s";

}  // namespace

std::vector<MaskingCell> masking_cells(const MaskingGrid& grid) {
  const std::vector<std::string> bodies =
      grid.quick ? std::vector<std::string>{"softcore"} : std::vector<std::string>{"softcore", "stiff", "stiffening"};
  const std::vector<std::string> motions =
      grid.quick ? std::vector<std::string>{"press", "tap"} : std::vector<std::string>{"press", "stroke", "tap", "grip-release"};
  std::vector<MaskingCell> cells;
  for (const std::string& body : bodies)
    for (const std::string& motion : motions)
      for (const MaskingLink& link : links_of(grid))
        for (const ComparedScheme scheme : grid.schemes.empty() ? compared_schemes() : grid.schemes) {
          MaskingCell cell;
          cell.body = body;
          cell.motion = motion;
          cell.scheme = scheme;
          cell.link = link;
          cells.push_back(std::move(cell));
        }
  return cells;
}

void measure_cells(const MaskingGrid& grid, std::vector<MaskingCell>& cells, unsigned jobs) {
  SweepTasks tasks = load_tasks(grid, cells);
  add_references(tasks, jobs);
  run_all(
      cells.size(), [&](std::size_t i) { measure_cell(cells[i], tasks.at(task_of(cells[i]))); }, jobs);
}

std::string cells_csv(const std::vector<MaskingCell>& cells) {
  std::string csv = std::string(kHeader) + '\n';
  for (const MaskingCell& c : cells) {
    const MaskingLink& l = c.link;
    const HandOverSteps &h = c.hand_over, &f = c.felt_step;
    fmt::format_to(std::back_inserter(csv), "{},{},{},{:g},{:g},{:g},{:g},{},{:.4f},{:.5g},{},{},{},{},{},", c.body, c.motion,
                   name_of(c.scheme), l.rtt_ms, l.jitter_ms, l.loss_pct, l.burst, l.seed, c.snr_db, c.p95_over_jnd,
                   c.onset.onsets, c.onset.missed, c.onset.worst_ms, c.onset.median_ms, h.swaps);
    fmt::format_to(std::back_inserter(csv), "{:.5g},{:.5g},{:.5g},{:.5g},{:.5g},{:.5g},{:.5g},{:.5g},{:.3f},{:.0f}\n", h.p50_n,
                   h.p999_n, h.max_n, h.share_within, f.p50_n, f.p999_n, f.max_n, f.share_within, c.age_p95_ms, c.uplink_bytes_s);
  }
  return csv;
}

std::vector<MaskingCell> read_cells(const std::filesystem::path& file) {
  std::vector<MaskingCell> cells;
  for (const std::vector<std::string>& fields : read_rows(file, kHeader)) {
    std::string line;
    for (const std::string& field : fields) line += field + ' ';
    std::istringstream row(line);
    MaskingCell c;
    std::string scheme;
    MaskingLink& l = c.link;
    HandOverSteps &h = c.hand_over, &f = c.felt_step;
    row >> c.body >> c.motion >> scheme >> l.rtt_ms >> l.jitter_ms >> l.loss_pct >> l.burst >> l.seed >> c.snr_db >>
        c.p95_over_jnd >> c.onset.onsets >> c.onset.missed >> c.onset.worst_ms >> c.onset.median_ms >> h.swaps >> h.p50_n >>
        h.p999_n >> h.max_n >> h.share_within >> f.p50_n >> f.p999_n >> f.max_n >> f.share_within >> c.age_p95_ms >>
        c.uplink_bytes_s;
    const std::string where = fmt::format("{}:{}", file.string(), cells.size() + 2);
    if (!row) throw InputError(where, "is no cell", "what masking wrote");
    f.swaps = h.swaps;
    c.scheme = compared_scheme(scheme, where);
    cells.push_back(std::move(c));
  }
  return cells;
}

}  // namespace palpate
