// palpate-lab pareto: error against run time of bodies and integrators; the points that no other beats in both form the front.
// A cell is a pushed cube (pushed_cube.hpp), or the body of a scene pushed likewise at its highest node; its error is that of the
// holding force against finer steps, its cost that of a second.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <map>

#include "bench/lab/cells.hpp"
#include "bench/lab/experiments.hpp"
#include "bench/measure/pareto.hpp"
#include "bench/measure/pushed_cube.hpp"
#include "bench/output/plot.hpp"
#include "common/base/error.hpp"
#include "server/body/unload.hpp"

namespace palpate {
namespace {

constexpr std::array<std::string_view, 4> kIntegrators{"automatic", "tr-bdf2", "explicit", "stabilised"};  // of IntegratorKind
constexpr std::string_view kSolid = "solid";  // prefix of the size of a cube of tetrahedra
constexpr const char *kOwn = "own", *kLiver = "organ-solid";
constexpr double kWellDampedS = 0.001;  // least b / k of bodies for stabilised steps

struct ParetoCell {
  std::string what;     // nodes per edge of a cube of springs, "10", or of tetrahedra, "solid10"; or a scene
  std::string damping;  // b / k [ms] of a cube; kOwn of a scene
  IntegratorKind integrator = IntegratorKind::tr_bdf2;
  double step_ms = 10;  // largest step
  // Results:
  double error = 0;        // relative
  double server_ms_s = 0;  // processor time per second of the body
};
using ParetoCells = std::vector<ParetoCell>;

CellTable<ParetoCell> pareto_table() {
  CellTable<ParetoCell> table;
  table.parameter("body", &ParetoCell::what)
      .parameter("damping_ms", &ParetoCell::damping)
      .parameter("integrator", &ParetoCell::integrator, kIntegrators)
      .parameter("step_ms", &ParetoCell::step_ms, "{:g}")
      .result("error", &ParetoCell::error, "{:.5g}")
      .result("server_ms_s", &ParetoCell::server_ms_s, "{:.5g}");
  return table;
}

struct ParetoFlags {
  std::string out, scenes = "scenes", only;
  bool quick = false;
  CellFlags cells;
};

/// Returns true for a cube, named by its nodes per edge; any other body is named by its scene.
bool is_cube(const ParetoCell& cell) {
  return cell.what.starts_with(kSolid) || (!cell.what.empty() && cell.what.front() >= '0' && cell.what.front() <= '9');
}

/// Throws InputError for a cell that cannot be measured.
PushedCube cube_of(const ParetoCell& cell) {
  PushedCube cube;
  cube.solid = cell.what.starts_with(kSolid);
  const double n = number_from(cube.solid ? cell.what.substr(kSolid.size()) : cell.what, "--only");
  if (!(n >= 3 && n <= 40 && n == std::floor(n)))
    throw InputError("--only", "a cube of " + cell.what + " nodes an edge", "3 to 40");
  cube.n = static_cast<int>(n);
  cube.damping_s = 1e-3 * number_from(cell.damping, "--only");
  cube.integrator = cell.integrator;
  cube.step_s = 1e-3 * cell.step_ms;
  return cube;
}

/// Picture to which a point belongs: the body.
std::string group_of(const ParetoCell& cell) {
  if (!is_cube(cell)) return cell.what;
  const PushedCube cube = cube_of(cell);
  const auto cubed = [](int n) { return n * n * n; };
  if (cube.solid) return fmt::format("{} tetrahedra, damping {} ms", 6 * cubed(cube.n - 1), cell.damping);
  return fmt::format("{} nodes, b / k = {} ms", cubed(cube.n), cell.damping);
}

ParetoCells pareto_cells(bool quick) {
  ParetoCells cells;
  struct Cube {
    const char *what, *damping_ms;
    bool quick;
  };
  for (const Cube& cube : {Cube{"6", "4", true},
                           {"10", "4", true},
                           {"10", "0.2", true},
                           {"solid6", "8", true},
                           {"solid10", "8", true},
                           {"20", "4", false},
                           {"30", "4", false},
                           {"20", "0.2", false},
                           {"30", "0.2", false},
                           {"solid15", "8", false},
                           {kLiver, kOwn, true}}) {
    if (quick && !cube.quick) continue;
    const ParetoCell cell{cube.what, cube.damping_ms};
    for (ParetoCell& at : crossed(ParetoCells{cell}, &ParetoCell::step_ms, std::array{50.0, 25.0, 10.0, 5.0}))
      cells.push_back(std::move(at));
    if (!is_cube(cell) || cube_of(cell).solid) continue;  // explicit steps are for springs
    cells.push_back({cube.what, cube.damping_ms, IntegratorKind::leapfrog});
    if (cube_of(cell).damping_s >= kWellDampedS) cells.push_back({cube.what, cube.damping_ms, IntegratorKind::stabilised});
  }
  return cells;
}

PushedRun push(const std::filesystem::path& scenes, const ParetoCell& cell) {
  if (is_cube(cell)) return push_cube(cube_of(cell), processor_ns);
  const Scene scene = open_scene((scenes / (cell.what + ".json")).string());
  return push_body(gripped_at_top(scene, cell.integrator, 1e-3 * cell.step_ms), processor_ns);
}

/// A cell whose steps are so fine that second order leaves at most 0.002 % of the error of 10 ms steps.
ParetoCell finest(ParetoCell cell) {
  constexpr int kSmall = 10;
  cell.integrator = IntegratorKind::tr_bdf2;
  cell.step_ms = is_cube(cell) && cube_of(cell).n <= kSmall ? 0.5 : 2;
  return cell;
}

using BodyReferences = std::map<std::string, std::vector<Vec3>>;  // by group

BodyReferences references_of(const std::filesystem::path& scenes, const ParetoCells& cells, unsigned jobs) {
  BodyReferences references;
  std::vector<std::pair<std::vector<Vec3>*, ParetoCell>> due;
  for (const ParetoCell& cell : cells)
    if (const auto [entry, fresh] = references.try_emplace(group_of(cell)); fresh) due.emplace_back(&entry->second, finest(cell));
  run_all(
      due.size(), [&](std::size_t i) { *due[i].first = push(scenes, due[i].second).force; }, jobs,
      "the references of the bodies");
  return references;
}

struct Group {
  std::string name;
  ParetoCells cells;
};

/// Cells of each picture, in the order in which the pictures first appear.
std::vector<Group> groups_of(const ParetoCells& cells) {
  std::vector<Group> groups;
  for (const ParetoCell& c : cells) {
    const auto known = std::ranges::find(groups, group_of(c), &Group::name);
    (known == groups.end() ? groups.emplace_back(Group{group_of(c), {}}) : *known).cells.push_back(c);
  }
  return groups;
}

std::vector<std::size_t> front_of(const ParetoCells& cells) {
  std::vector<CostAndError> points;
  for (const ParetoCell& c : cells) points.push_back({c.server_ms_s, c.error});
  return pareto_front(points);
}

/// Writes cost against error [%]: a file for each method, and one for the front.
std::filesystem::path write_points(const std::filesystem::path& out, const std::string& name, const ParetoCells& cells) {
  std::string csv = "cost,error_pct\n";
  for (const ParetoCell& c : cells) fmt::format_to(std::back_inserter(csv), "{:.5g},{:.5g}\n", c.server_ms_s, 100 * c.error);
  std::string file = "pareto-" + name + ".csv";
  std::replace_if(
      file.begin(), file.end(), [](char c) { return c == ' ' || c == '/' || c == ',' || c == '='; }, '-');
  write_text(out / file, csv);
  return out / file;
}

GridPanel panel_of(const std::filesystem::path& out, const Group& group) {
  GridPanel panel{group.name, "processor time per second [ms]", "error [%]", {}, "set logscale xy\nset format xy '%g'\n"};
  ParetoCells front;
  for (const std::size_t i : front_of(group.cells)) front.push_back(group.cells[i]);
  panel.curves.push_back({"1:2", "front", 0, write_points(out, group.name + "-front", front), "lines dt 3"});
  for (std::size_t k = 0; k < kIntegrators.size(); ++k) {
    ParetoCells cells;
    std::ranges::copy_if(group.cells, std::back_inserter(cells),
                         [&](const ParetoCell& c) { return static_cast<std::size_t>(c.integrator) == k; });
    if (cells.empty()) continue;
    const std::string name(kIntegrators[k]);
    panel.curves.push_back(
        {"1:2", name, static_cast<int>(k), write_points(out, group.name + "-" + name, cells), "points ps 0.9"});
  }
  return panel;
}

void draw(const std::filesystem::path& out, const std::vector<Group>& groups) {
  std::vector<GridPanel> panels;
  for (const Group& group : groups) panels.push_back(panel_of(out, group));
  plot_grid(out / "pareto.svg", "Bodies pushed by 10 mm: error against run time", 3, panels);
}

Json print(const Group& group) {
  fmt::print("\n{}\n  {:<36} {:>9} {:>15} {:>15}\n", group.name, "palpate-lab pareto --only ...", "error [%]", "cost [ms/s]",
             "real time [x]");
  const std::vector<std::size_t> front = front_of(group.cells);
  Json points = Json::array();
  for (std::size_t i = 0; i < group.cells.size(); ++i) {
    const ParetoCell& c = group.cells[i];
    const bool on_front = std::ranges::count(front, i) > 0;
    const std::string key = pareto_table().key(c);
    fmt::print("  {:<36} {:>9.3g} {:>14.1f}{} {:>15.2f}\n", key, 100 * c.error, c.server_ms_s, on_front ? '*' : ' ',
               1e3 / c.server_ms_s);
    points.push_back({{"point", key}, {"error", c.error}, {"server_ms_s", c.server_ms_s}, {"on_front", on_front ? 1 : 0}});
  }
  return points;
}

void report(const ParetoCells& cells, const std::filesystem::path& out) {
  const std::vector<Group> groups = groups_of(cells);
  draw(out, groups);
  Json summary;
  for (const Group& group : groups) summary[group.name] = print(group);
  write_json(out / "summary.json", summary);
  fmt::print(
      "\n  A star marks a point that no other of its table beats in both error and cost. The cost is processor time; other load "
      "on "
      "the\n  machine affects it.\n{}\n",
      (out / "summary.json").string());
}

int run_pareto(const ParetoFlags& flags) {
  const auto out = make_output_folder(flags.out);
  BodyReferences references;
  CellSweep<ParetoCell> sweep{pareto_table(), {}};
  sweep.cells = flags.only.empty() ? pareto_cells(flags.quick) : ParetoCells{sweep.table.from_key(flags.only, "--only")};
  for (const ParetoCell& cell : sweep.cells)
    if (is_cube(cell)) cube_of(cell);
  sweep.prepare = [&](const ParetoCells& cells, unsigned jobs) { references = references_of(flags.scenes, cells, jobs); };
  sweep.measure = [&](ParetoCell& cell) {
    const PushedRun run = push(flags.scenes, cell);
    cell.error = relative_rms(run.force, references.at(group_of(cell)));
    cell.server_ms_s = 1e3 * run.cost_s;
  };
  if (const auto cells = run_cells(sweep, flags.cells, out)) report(*cells, out);
  return 0;
}

}  // namespace

void add_pareto(CLI::App& app, Run& run) {
  auto flags = std::make_shared<ParetoFlags>();
  CLI::App* c = app.add_subcommand(
      "pareto", "measure error against run time of bodies and integrators, and which points no other beats in both");
  c->add_option("--scenes", flags->scenes, "folder of the scenes")->type_name("DIR")->capture_default_str();
  c->add_option("--only", flags->only, "only this point, as the table prints it")->type_name("POINT");
  c->add_flag("--quick", flags->quick, "use small bodies");
  flags->cells.add_to(*c);
  c->add_option("--out", flags->out, "folder for cells.csv, summary.json and plots")->type_name("DIR")->required();
  c->callback([flags, &run] { run = [flags] { return run_pareto(*flags); }; });
}

}  // namespace palpate
