// palpate-lab pareto: error against run time of meshes, bodies and patches; the points that no other beats in both form the
// front.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <iterator>

#include "bench/lab/experiments.hpp"
#include "bench/lab/pareto_cells.hpp"
#include "bench/lab/shards.hpp"
#include "bench/output/output.hpp"
#include "bench/output/plot.hpp"

namespace palpate {
namespace {

struct ParetoFlags {
  std::string out, scenes = "scenes", only;
  bool quick = false;
  ShardFlags shards;
};

using ParetoCells = std::vector<ParetoCell>;

struct Cost {
  const char *name, *label;
  double ParetoCell::*value;
};
constexpr Cost kBodyCost{"server_ms_s", "processor time of a second [ms]", &ParetoCell::server_ms_s};
constexpr Cost kPatchCosts[] = {{"bytes", "bytes a frame", &ParetoCell::bytes},
                                {"build_ms", "server, a patch [ms]", &ParetoCell::build_ms},
                                {"tick_us", "client, a tick [us]", &ParetoCell::tick_us}};

struct Group {
  std::string name;
  ParetoCells cells;
};

/// Cells of each picture, in the order in which the pictures first appear.
std::vector<Group> groups_of(const ParetoCells& cells) {
  std::vector<Group> groups;
  for (const ParetoCell& c : cells) {
    const auto known = std::find_if(groups.begin(), groups.end(), [&](const Group& g) { return g.name == group_of(c); });
    (known == groups.end() ? groups.emplace_back(Group{group_of(c), {}}) : *known).cells.push_back(c);
  }
  return groups;
}

/// Writes cost against error [%]: a file for each method, and one for the front.
std::filesystem::path write_points(const std::filesystem::path& out, const std::string& name, const ParetoCells& cells,
                                   const std::vector<std::size_t>& which, double ParetoCell::*cost) {
  std::string csv = "cost,error_pct\n";
  for (const std::size_t i : which)
    fmt::format_to(std::back_inserter(csv), "{:.5g},{:.5g}\n", cells[i].*cost, 100 * cells[i].error);
  std::string file = "pareto-" + name + ".csv";
  std::replace_if(
      file.begin(), file.end(), [](char c) { return c == ' ' || c == '/' || c == ',' || c == '='; }, '-');
  write_text(out / file, csv);
  return out / file;
}

GridPanel panel_of(const std::filesystem::path& out, const Group& group, const Cost& cost) {
  GridPanel panel{group.name, cost.label, "error of the force [%]", {}, "set logscale xy\nset format xy '%g'\n"};
  panel.curves.push_back(
      {"1:2", "front", 0,
       write_points(out, group.name + "-front-" + cost.name, group.cells, pareto_front(group.cells, cost.value), cost.value),
       "lines dt 3"});
  std::vector<std::string> methods;
  for (const ParetoCell& c : group.cells)
    if (std::find(methods.begin(), methods.end(), method_of(c)) == methods.end()) methods.push_back(method_of(c));
  for (std::size_t m = 0; m < methods.size(); ++m) {
    std::vector<std::size_t> which;
    for (std::size_t i = 0; i < group.cells.size(); ++i)
      if (method_of(group.cells[i]) == methods[m]) which.push_back(i);
    panel.curves.push_back(
        {"1:2", methods[m], static_cast<int>(m) + 1,
         write_points(out, fmt::format("{}-{}-{}", group.name, methods[m], cost.name), group.cells, which, cost.value),
         "points ps 0.9"});
  }
  return panel;
}

void draw(const std::filesystem::path& out, const std::vector<Group>& groups) {
  std::vector<GridPanel> bodies, patches, meshes;
  for (const Group& group : groups) {
    if (group.cells.front().is_mesh)
      meshes.push_back(panel_of(out, group, kBodyCost));
    else if (!group.cells.front().is_patch)
      bodies.push_back(panel_of(out, group, kBodyCost));
    else
      for (const Cost& cost : kPatchCosts) patches.push_back(panel_of(out, group, cost));
  }
  constexpr int kColumns = 3;
  if (!meshes.empty())
    plot_grid_with_one_legend(out / "pareto-continuum.svg", "Error against the continuum over run time", kColumns, meshes);
  if (!bodies.empty())
    plot_grid_with_one_legend(out / "pareto-bodies.svg", "Bodies pushed by 10 mm: error against run time", kColumns, bodies);
  if (!patches.empty())
    plot_grid_with_one_legend(out / "pareto-patches.svg", "Patches: error against what they cost", kColumns, patches);
}

/// For each cell: true if it is on the front.
std::vector<bool> on_front(const ParetoCells& cells, double ParetoCell::*cost) {
  std::vector<bool> on(cells.size(), false);
  for (const std::size_t i : pareto_front(cells, cost)) on[i] = true;
  return on;
}

void print_bodies(const ParetoCells& cells, Json& points) {
  fmt::print("  {:<36} {:>9} {:>10} {:>11}\n", "palpate-lab pareto --only ...", "error %", "ms a s", "x real time");
  const std::vector<bool> front = on_front(cells, kBodyCost.value);
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const ParetoCell& c = cells[i];
    fmt::print("  {:<36} {:>9.3g} {:>9.1f}{} {:>11.2f}\n", key_of(c), 100 * c.error, c.server_ms_s, front[i] ? '*' : ' ',
               1e3 / c.server_ms_s);
    points.push_back({{"point", key_of(c)},
                      {"error", c.error},
                      {"server_ms_s", c.server_ms_s},
                      {"on_front", {{kBodyCost.name, front[i] ? 1 : 0}}}});
  }
}

void print_patches(const ParetoCells& cells, Json& points) {
  fmt::print("  {:<36} {:>9} {:>8} {:>11} {:>9}\n", "palpate-lab pareto --only ...", "error %", "bytes", "server ms", "tick us");
  std::array<std::vector<bool>, std::size(kPatchCosts)> fronts;
  for (std::size_t k = 0; k < fronts.size(); ++k) fronts[k] = on_front(cells, kPatchCosts[k].value);
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const ParetoCell& c = cells[i];
    const auto mark = [&](std::size_t k) { return fronts[k][i] ? '*' : ' '; };
    fmt::print("  {:<36} {:>9.3g} {:>7.0f}{} {:>10.3f}{} {:>8.3f}{}\n", key_of(c), 100 * c.error, c.bytes, mark(0), c.build_ms,
               mark(1), c.tick_us, mark(2));
    Json j{{"point", key_of(c)}, {"error", c.error},       {"server_ms_s", c.server_ms_s},
           {"bytes", c.bytes},   {"build_ms", c.build_ms}, {"tick_us", c.tick_us}};
    for (std::size_t k = 0; k < fronts.size(); ++k) j["on_front"][kPatchCosts[k].name] = fronts[k][i] ? 1 : 0;
    points.push_back(std::move(j));
  }
}

Json print(const Group& group) {
  fmt::print("\n{}\n", group.name);
  Json points = Json::array();
  (group.cells.front().is_patch ? print_patches : print_bodies)(group.cells, points);
  return points;
}

void report(const ParetoCells& cells, const std::filesystem::path& out) {
  const std::vector<Group> groups = groups_of(cells);
  draw(out, groups);
  Json summary;
  for (const Group& group : groups) summary[group.name] = print(group);
  write_json(out / "summary.json", summary);
  fmt::print(
      "\n  *: no other of these is both cheaper and truer. Times are processor time, of a machine that others may use.\n{}\n",
      (out / "summary.json").string());
}

int run_pareto(const ParetoFlags& flags) {
  const Shard shard = Shard::from(flags.shards.shard);
  const ParetoGrid grid{flags.scenes, flags.quick};
  const auto out = make_output_folder(flags.out);
  ParetoCells cells;
  if (flags.shards.merge) {
    cells = merged_cells(out, read_pareto_cells);
    write_text(out / "cells.csv", cells_csv(cells));
    report(cells, out);
    return 0;
  }
  cells = flags.only.empty() ? shard.part_of(pareto_cells(grid)) : ParetoCells{pareto_cell_from(flags.only, "--only")};
  fmt::print("{} points\n", cells.size());
  measure_cells(grid, cells, flags.shards.jobs);
  write_text(shard.file(out), cells_csv(cells));
  if (shard.of == 1) report(cells, out);
  return 0;
}

}  // namespace

void add_pareto(CLI::App& app, Run& run) {
  auto flags = std::make_shared<ParetoFlags>();
  CLI::App* c = app.add_subcommand("pareto",
                                   "error against run time: meshes against the continuum, bodies and integrators, schemes and "
                                   "states, and which no other beats");
  c->add_option("--scenes", flags->scenes, "folder of the scenes")->type_name("DIR")->capture_default_str();
  c->add_option("--only", flags->only, "one point, as the table prints it")->type_name("POINT");
  c->add_flag("--quick", flags->quick, "small bodies, one scene and one round trip");
  flags->shards.add_to(*c);
  c->add_option("--out", flags->out, "folder for cells.csv, summary.json and plots")->type_name("DIR")->required();
  c->callback([flags, &run] { run = [flags] { return run_pareto(*flags); }; });
}

}  // namespace palpate
