#include "bench/lab/accuracy_cells.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "bench/fidelity/replay.hpp"
#include "bench/lab/parallel.hpp"
#include "bench/lab/shards.hpp"
#include "bench/lab/tasks.hpp"
#include "bench/measure/local_model.hpp"
#include "bench/output/output.hpp"
#include "common/base/error.hpp"

namespace palpate {
namespace {

constexpr const char* kAccuracyHeader =
    "scene,scheme,row,rtt_ms,served,snr_db,median_error,p95_error,frame_bytes,build_ms,tick_us";

std::filesystem::path file_of(const AccuracyGrid& grid, const std::string& scene) { return grid.scenes / (scene + ".json"); }

std::vector<std::string> scenes_of(const AccuracyGrid& grid) {
  std::vector<std::string> names;
  if (std::filesystem::is_directory(grid.scenes))
    for (const auto& entry : std::filesystem::directory_iterator(grid.scenes))
      if (entry.path().extension() == ".json") names.push_back(entry.path().stem().string());
  if (names.empty()) throw InputError("--scenes " + grid.scenes.string(), "holds no scene", "a folder of *.json");
  std::sort(names.begin(), names.end());
  for (const std::string& name : grid.only)
    if (!std::filesystem::exists(file_of(grid, name)))
      throw InputError("--only " + name, "is no scene of " + grid.scenes.string(),
                       fmt::format("one of {}", fmt::join(names, ", ")));
  if (!grid.only.empty()) names = grid.only;
  if (grid.places == 0) return names;
  std::vector<std::string> places;
  for (const std::string& name : names)
    for (int place = 1; place <= grid.places; ++place) places.push_back(at_place(name, place));
  return places;
}

/// Returns true if a scheme has a row in addition to the real one.
bool has_row(ComparedScheme scheme, AccuracyRow row) {
  switch (row) {
    case AccuracyRow::as_sent:
      return true;
    case AccuracyRow::exact_states:
      return scheme == ComparedScheme::port || scheme == ComparedScheme::hyper;
    case AccuracyRow::full_forces:
    case AccuracyRow::tremor_floor:
      return scheme == ComparedScheme::hyper;
    case AccuracyRow::whole_linear:
      return scheme == ComparedScheme::port;
  }
  return false;
}

/// Returns true for rows of local_model.hpp, which does not support relaxation.
bool is_local_model(AccuracyRow row) { return row == AccuracyRow::full_forces || row == AccuracyRow::whole_linear; }

void measure_tremor_floor(AccuracyCell& cell, const SweepTask& task) {
  std::vector<MotionPoint> points(task.motion.points().begin(), task.motion.points().end());
  for (MotionPoint& p : points) p.position += kTremorFloorM * Vec3::Ones().normalized();
  const ReferenceForce aside = reference_of(task.scene, Motion(std::move(points)));
  const std::vector<double> errors = relative_errors(aside.force, task.reference.force);
  cell.served = cell.scheme;
  cell.snr_db = compare(aside.force, task.reference.force, kSkipTicks).snr_db;
  cell.median_error = percentile(errors, 0.5);
  cell.p95_error = percentile(errors, 0.95);
}

void measure_cell(AccuracyCell& cell, const SweepTask& task) {
  if (cell.row == AccuracyRow::tremor_floor) return measure_tremor_floor(cell, task);
  Scene scene = task.scene;
  if (cell.row != AccuracyRow::as_sent) scene.solver.step_s = scene.body.nodes.size() > kFineNodes ? kTickStepS : kFineStepS;
  ReplayOptions options;
  select(cell.scheme, scene, options);
  options.link.latency = from_seconds(cell.rtt_ms * 0.5e-3);
  options.reference = &task.reference;
  options.keep_starts = is_local_model(cell.row);
  ReplayResult result = replay(scene, task.motion, options, processor_ns);
  if (cell.row == AccuracyRow::full_forces) replace_patches(result, scene, LocalModel::full_forces);
  if (cell.row == AccuracyRow::whole_linear) replace_patches(result, scene, LocalModel::whole_linear);
  const std::vector<double> errors = relative_errors(result);
  cell.served = offered(cell.scheme) ? compared(result.last_patch.scheme) : cell.scheme;
  cell.snr_db = result.fidelity.snr_db;
  cell.median_error = percentile(errors, 0.5);
  cell.p95_error = percentile(errors, 0.95);
  cell.frame_bytes = result.patch_bytes_mean;
  cell.build_ms = result.patch_build_ms_mean;
  cell.tick_us = 1e-3 * result.tick_ns_p50;
}

}  // namespace

std::vector<AccuracyCell> accuracy_cells(const AccuracyGrid& grid) {
  std::vector<AccuracyCell> cells;
  for (const std::string& scene : scenes_of(grid))
    for (const ComparedScheme scheme : grid.schemes.empty() ? compared_schemes() : grid.schemes)
      for (const AccuracyRow row : {AccuracyRow::as_sent, AccuracyRow::exact_states, AccuracyRow::full_forces,
                                    AccuracyRow::whole_linear, AccuracyRow::tremor_floor}) {
        if (!has_row(scheme, row) || (grid.as_sent && row != AccuracyRow::as_sent)) continue;
        const std::vector<double> none{0};
        for (const double rtt_ms : has_round_trip(row) ? grid.rtt_ms : none) {
          AccuracyCell& cell = cells.emplace_back();
          cell.scene = scene;
          cell.scheme = scheme;
          cell.row = row;
          cell.rtt_ms = rtt_ms;
        }
      }
  return cells;
}

std::vector<std::string> measure_cells(const AccuracyGrid& grid, std::vector<AccuracyCell>& cells, unsigned jobs) {
  SweepTasks tasks;
  for (const AccuracyCell& cell : cells) add_examination(tasks, grid.scenes, cell.scene);
  add_references(tasks, jobs);
  std::vector<std::string> untouched;
  for (const auto& [name, task] : tasks)
    if (compare(task.reference.force, task.reference.force, kSkipTicks).contact_ticks == 0) untouched.push_back(name);
  std::erase_if(cells, [&](const AccuracyCell& cell) {
    const LumpedBody& body = tasks.at(cell.scene).scene.body;
    const bool forgets = is_local_model(cell.row) && !body.relaxation.empty();
    return forgets || !suits(cell.scheme, body) || std::find(untouched.begin(), untouched.end(), cell.scene) != untouched.end();
  });
  run_all(
      cells.size(), [&](std::size_t i) { measure_cell(cells[i], tasks.at(cells[i].scene)); }, jobs);
  return untouched;
}

std::string cells_csv(const std::vector<AccuracyCell>& cells) {
  std::string csv = std::string(kAccuracyHeader) + '\n';
  for (const AccuracyCell& c : cells)
    fmt::format_to(std::back_inserter(csv), "{},{},{},{:g},{},{:.3f},{:.5g},{:.5g},{:.0f},{:.4g},{:.4g}\n", c.scene,
                   name_of(c.scheme), name_of(c.row), c.rtt_ms, name_of(c.served), c.snr_db, c.median_error, c.p95_error,
                   c.frame_bytes, c.build_ms, c.tick_us);
  return csv;
}

std::vector<AccuracyCell> read_accuracy_cells(const std::filesystem::path& file) {
  std::vector<AccuracyCell> cells;
  for (const std::vector<std::string>& f : read_rows(file, kAccuracyHeader)) {
    const std::string where = fmt::format("{}:{}", file.string(), cells.size() + 2);
    const auto number = [&](std::size_t k) { return number_from(f[k], where); };
    cells.push_back({f[0], compared_scheme(f[1], where), static_cast<AccuracyRow>(index_from(f[2], kAccuracyRowNames, where)),
                     number(3), compared_scheme(f[4], where), number(5), number(6), number(7), number(8), number(9), number(10)});
  }
  return cells;
}

}  // namespace palpate
