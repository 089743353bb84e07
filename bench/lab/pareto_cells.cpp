#include "bench/lab/pareto_cells.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <map>

#include "bench/fidelity/replay.hpp"
#include "bench/lab/link_flags.hpp"
#include "bench/lab/parallel.hpp"
#include "bench/lab/shards.hpp"
#include "bench/lab/tasks.hpp"
#include "bench/measure/pareto.hpp"
#include "bench/output/output.hpp"
#include "common/base/error.hpp"
#include "server/body/unload.hpp"

namespace palpate {
namespace {

constexpr const char* kParetoHeader = "kind,what,variant,method,setting,error,server_ms_s,build_ms,tick_us,bytes";
constexpr std::size_t kParetoCellsKeyFields = 5;
const std::array<std::string_view, 3> kKinds{"body", "patch", "mesh"};
const std::array<std::string_view, 3> kElements{"hexahedron", "tetrahedron", "spring"};   // names of TissueElement
const std::array<std::string_view, 3> kIntegrators{"tr-bdf2", "explicit", "stabilised"};  // names from IntegratorKind::tr_bdf2 on
constexpr auto kFirstIntegrator = static_cast<std::size_t>(IntegratorKind::tr_bdf2);
constexpr std::string_view kSolid = "solid";  // prefix of the size of a cube of tetrahedra
constexpr std::string_view kOwn = "own";      // stands for the damping in the scene
constexpr const char* kLiver = "organ-solid";
constexpr double kWellDampedS = 0.001;                     // least b / k of bodies for stabilised steps
constexpr double kSteps[] = {0.050, 0.025, 0.010, 0.005};  // largest steps [s]

struct References {
  std::map<std::string, std::vector<Vec3>> bodies;  // by group
  SweepTasks exams;                                 // by scene
};

/// Reference of a cell, fine enough that second order leaves at most 0.002 % of the error of 10 ms steps.
ParetoCell reference_cell(ParetoCell cell) {
  constexpr int kSmall = 10;
  cell.cube.integrator = IntegratorKind::tr_bdf2;
  cell.cube.step_s = cell.scene.empty() && cell.cube.n <= kSmall ? 0.0005 : 0.002;
  return cell;
}

PushedCube solid_cube(int n) { return {.n = n, .damping_s = 0.008, .solid = true}; }

void add_bodies(bool quick, std::vector<ParetoCell>& cells) {
  std::vector<PushedCube> bodies{{6, 0.004}, {10, 0.004}, {10, 0.0002}, solid_cube(6), solid_cube(10)};
  if (!quick) bodies.insert(bodies.end(), {{20, 0.004}, {30, 0.004}, {20, 0.0002}, {30, 0.0002}, solid_cube(15)});
  for (PushedCube cube : bodies) {
    const auto add = [&](IntegratorKind integrator, double step_s) {
      cube.integrator = integrator;
      cube.step_s = step_s;
      cells.emplace_back().cube = cube;
    };
    for (const double step_s : kSteps) add(IntegratorKind::tr_bdf2, step_s);
    if (cube.solid) continue;  // explicit steps are for springs
    add(IntegratorKind::leapfrog, 0.010);
    if (cube.damping_s >= kWellDampedS) add(IntegratorKind::stabilised, 0.010);
  }
  for (const double step_s : kSteps) {
    ParetoCell& cell = cells.emplace_back();
    cell.scene = kLiver;
    cell.cube.step_s = step_s;
  }
}

void add_patches(bool quick, std::vector<ParetoCell>& cells) {
  const std::vector<std::string> scenes =
      quick ? std::vector<std::string>{"cube6"} : std::vector<std::string>{"cube6", "touch-cube", "organ-buckling"};
  const std::vector<double> round_trips = quick ? std::vector<double>{150} : std::vector<double>{50, 150, 300};
  struct Made {
    Scheme scheme;
    int order;
  };
  static constexpr Made kMade[] = {{Scheme::hold, 0},  {Scheme::tangent, 0}, {Scheme::ring, 0},  {Scheme::port, 10},
                                   {Scheme::port, 14}, {Scheme::port, 18},   {Scheme::port, 22}, {Scheme::hyper, 0}};
  for (const std::string& scene : scenes)
    for (const double rtt_ms : round_trips)
      for (const auto& [scheme, order] : kMade) {
        ParetoCell& cell = cells.emplace_back();
        cell.is_patch = true;
        cell.scene = scene;
        cell.scheme = scheme;
        cell.order = order;
        cell.rtt_ms = rtt_ms;
      }
}

void add_case_meshes(bool quick, std::vector<ParetoCell>& cells) {
  for (const auto& [body, poisson] :
       {std::pair{"bar", 0.25}, {"bar", 0.45}, {"bar", 0.49}, {"punch 3 mm", 0.45}, {"punch 3 mm", 0.49}}) {
    if (quick && (poisson != 0.45 || body != std::string_view("bar"))) continue;
    const TissueCase& of = tissue_case(fmt::format("{}, nu = {}", body, poisson));
    for (const TissueElement element : of.elements)
      for (const int n : of.cells) {
        if (quick && n == of.cells.back()) continue;
        ParetoCell& cell = cells.emplace_back();
        cell.is_mesh = true;
        cell.body = body;
        cell.poisson = poisson;
        cell.element = element;
        cell.cells = n;
      }
  }
}

const TissueCase& case_of(const ParetoCell& cell) { return tissue_case(group_of(cell)); }

PushedRun push(const ParetoGrid& grid, const ParetoCell& cell) {
  if (cell.scene.empty()) return push_cube(cell.cube, processor_ns);
  const Scene scene = open_scene((grid.scenes / (cell.scene + ".json")).string());
  return push_body(gripped_at_top(scene, cell.cube.integrator, cell.cube.step_s), processor_ns);
}

void measure_body(const ParetoGrid& grid, ParetoCell& cell, const std::vector<Vec3>& reference) {
  const PushedRun run = push(grid, cell);
  cell.error = relative_rms(run.force, reference);
  cell.server_ms_s = 1e3 * run.cost_s;
}

void measure_mesh(ParetoCell& cell) {
  constexpr double kStepS = 0.010;
  const TissueCase& of = case_of(cell);
  cell.error = std::abs(of.solve(cell.element, cell.cells).value / of.reference - 1);
  const Scene scene = gripped_at_top(of.scene(cell.element, cell.cells), IntegratorKind::automatic, kStepS);
  cell.server_ms_s = 1e3 * push_body(scene, processor_ns).cost_s;
}

void measure_patch(ParetoCell& cell, const SweepTask& exam) {
  ReplayOptions options;
  options.scheme = cell.scheme;
  options.order = cell.order;
  options.link.latency = from_seconds(cell.rtt_ms * 0.5e-3);
  options.reference = &exam.reference;
  const ReplayResult result = replay(exam.scene, exam.motion, options, processor_ns);
  cell.error = percentile(relative_errors(result), 0.95);
  cell.server_ms_s = result.frame_ms_mean * options.rate_hz;
  cell.build_ms = result.patch_build_ms_mean;
  cell.tick_us = 1e-3 * result.tick_ns_p50;
  cell.bytes = result.patch_bytes_mean;
}

References references_of(const ParetoGrid& grid, const std::vector<ParetoCell>& cells, unsigned jobs) {
  References references;
  std::vector<std::pair<std::vector<Vec3>*, ParetoCell>> bodies;
  for (const ParetoCell& cell : cells) {
    if (cell.is_mesh) continue;
    if (cell.is_patch) {
      add_examination(references.exams, grid.scenes, cell.scene);
    } else if (const auto [entry, fresh] = references.bodies.try_emplace(group_of(cell)); fresh) {
      bodies.emplace_back(&entry->second, reference_cell(cell));
    }
  }
  run_all(
      bodies.size(), [&](std::size_t i) { *bodies[i].first = push(grid, bodies[i].second).force; }, jobs,
      "the references of the bodies");
  add_references(references.exams, jobs);
  return references;
}

/// Returns true for a cube, named by its nodes per edge; any other body is named by its scene.
bool is_cube(const std::string& what) {
  return what.starts_with(kSolid) || (!what.empty() && what.front() >= '0' && what.front() <= '9');
}

ParetoCell body_from(const std::vector<std::string>& f, const std::string& where) {
  ParetoCell cell;
  cell.cube.integrator = static_cast<IntegratorKind>(kFirstIntegrator + index_from(f[3], kIntegrators, where));
  cell.cube.step_s = 1e-3 * number_from(f[4], where);
  if (!is_cube(f[1])) {
    if (f[2] != kOwn) throw InputError(where, "'" + f[2] + "' for the damping of a scene", std::string(kOwn));
    cell.scene = f[1];
    return cell;
  }
  cell.cube.solid = f[1].starts_with(kSolid);
  const double n = number_from(cell.cube.solid ? f[1].substr(kSolid.size()) : f[1], where);
  if (!(n >= 3 && n <= 40 && n == std::floor(n))) throw InputError(where, "a cube of " + f[1] + " nodes an edge", "3 to 40");
  cell.cube.n = static_cast<int>(n);
  cell.cube.damping_s = 1e-3 * number_from(f[2], where);
  return cell;
}

ParetoCell mesh_from(const std::vector<std::string>& f, const std::string& where) {
  constexpr double kMostCells = 16;
  ParetoCell cell;
  cell.is_mesh = true;
  cell.body = f[1];
  cell.poisson = number_from(f[2], where);
  cell.element = static_cast<TissueElement>(index_from(f[3], kElements, where));
  const double n = number_from(f[4], where);
  if (!(n >= 2 && n <= kMostCells && n == std::floor(n))) throw InputError(where, "a mesh of " + f[4] + " cells", "2 to 16");
  cell.cells = static_cast<int>(n);
  for (const TissueCase& known : tissue_cases())
    if (known.name == group_of(cell) && known.scene) {
      const auto& has = known.elements;
      if (std::find(has.begin(), has.end(), cell.element) != has.end()) return cell;
      throw InputError(where, "'" + f[3] + "' of " + known.name, "an element that has this Poisson's ratio");
    }
  throw InputError(where, "'" + group_of(cell) + "' is no case that CalculiX answered", "one that the table prints");
}

ParetoCell cell_of(const std::vector<std::string>& f, const std::string& where) {
  if (index_from(f[0], kKinds, where) == 0) return body_from(f, where);
  ParetoCell cell;
  if (f[0] == kKinds[2]) return mesh_from(f, where);
  cell.is_patch = true;
  cell.scene = f[1];
  cell.scheme = available_scheme(f[2]);
  cell.order = static_cast<int>(number_from(f[3], where));
  cell.rtt_ms = number_from(f[4], where);
  return cell;
}

}  // namespace

std::vector<ParetoCell> pareto_cells(const ParetoGrid& grid) {
  std::vector<ParetoCell> cells;
  add_case_meshes(grid.quick, cells);
  add_bodies(grid.quick, cells);
  add_patches(grid.quick, cells);
  return cells;
}

void measure_cells(const ParetoGrid& grid, std::vector<ParetoCell>& cells, unsigned jobs) {
  const References references = references_of(grid, cells, jobs);
  const auto measure = [&](std::size_t i) {
    if (cells[i].is_mesh)
      measure_mesh(cells[i]);
    else if (cells[i].is_patch)
      measure_patch(cells[i], references.exams.at(cells[i].scene));
    else
      measure_body(grid, cells[i], references.bodies.at(group_of(cells[i])));
  };
  run_all(cells.size(), measure, jobs);
}

std::string key_of(const ParetoCell& c) {
  if (c.is_mesh) return fmt::format("mesh,{},{},{},{}", c.body, c.poisson, method_of(c), c.cells);
  if (c.is_patch) return fmt::format("patch,{},{},{},{:g}", c.scene, method_of(c), c.order, c.rtt_ms);
  if (!c.scene.empty()) return fmt::format("body,{},{},{},{:g}", c.scene, kOwn, method_of(c), 1e3 * c.cube.step_s);
  return fmt::format("body,{}{},{:g},{},{:g}", c.cube.solid ? kSolid : "", c.cube.n, 1e3 * c.cube.damping_s, method_of(c),
                     1e3 * c.cube.step_s);
}

std::string method_of(const ParetoCell& c) {
  if (c.is_mesh) return std::string(kElements[static_cast<std::size_t>(c.element)]);
  return std::string(c.is_patch ? name_of(c.scheme)
                                : kIntegrators[static_cast<std::size_t>(c.cube.integrator) - kFirstIntegrator]);
}

std::string group_of(const ParetoCell& c) {
  if (c.is_mesh) return fmt::format("{}, nu = {}", c.body, c.poisson);
  if (c.is_patch) return fmt::format("{}, RTT {:g} ms", c.scene, c.rtt_ms);
  if (!c.scene.empty()) return c.scene;
  const int nodes = c.cube.n * c.cube.n * c.cube.n, cells = (c.cube.n - 1) * (c.cube.n - 1) * (c.cube.n - 1);
  if (c.cube.solid) return fmt::format("{} tetrahedra, damping {:g} ms", 6 * cells, 1e3 * c.cube.damping_s);
  return fmt::format("{} nodes, b / k = {:g} ms", nodes, 1e3 * c.cube.damping_s);
}

ParetoCell pareto_cell_from(const std::string& key, const std::string& where) {
  const std::vector<std::string> fields = fields_of(key);
  if (fields.size() != kParetoCellsKeyFields)
    throw InputError(where, fmt::format("'{}' has {} fields", key, fields.size()), "five, as the table prints them");
  return cell_of(fields, where);
}

std::vector<std::size_t> pareto_front(const std::vector<ParetoCell>& cells, double ParetoCell::*cost) {
  std::vector<CostAndError> points;
  for (const ParetoCell& c : cells) points.push_back({c.*cost, c.error});
  return pareto_front(points);
}

std::string cells_csv(const std::vector<ParetoCell>& cells) {
  std::string csv = std::string(kParetoHeader) + '\n';
  for (const ParetoCell& c : cells)
    fmt::format_to(std::back_inserter(csv), "{},{:.5g},{:.5g},{:.4g},{:.4g},{:.0f}\n", key_of(c), c.error, c.server_ms_s,
                   c.build_ms, c.tick_us, c.bytes);
  return csv;
}

std::vector<ParetoCell> read_pareto_cells(const std::filesystem::path& file) {
  std::vector<ParetoCell> cells;
  for (const std::vector<std::string>& row : read_rows(file, kParetoHeader)) {
    const std::string where = fmt::format("{}:{}", file.string(), cells.size() + 2);
    ParetoCell c = cell_of(row, where);
    double* const numbers[] = {&c.error, &c.server_ms_s, &c.build_ms, &c.tick_us, &c.bytes};
    for (std::size_t k = 0; k < std::size(numbers); ++k) *numbers[k] = number_from(row[kParetoCellsKeyFields + k], where);
    cells.push_back(std::move(c));
  }
  return cells;
}

}  // namespace palpate
