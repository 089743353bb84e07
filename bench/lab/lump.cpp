// palpate-lab lump: the smallest lump that a model observer (lump_trial.hpp) feels, over its stiffness, the scheme and the round
// trip.
//
// A cell is one press over one lump through one scheme at one round trip, with the real cores in virtual time; a diameter of 0 is
// the place beside it. Scheme `none` is the full model without a network.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <utility>

#include "bench/lab/cells.hpp"
#include "bench/lab/experiments.hpp"
#include "bench/lab/tasks.hpp"
#include "bench/measure/lump_trial.hpp"
#include "bench/output/plot.hpp"

namespace palpate {
namespace {

enum class LumpScheme : std::uint8_t { none, hold, port, hyper };
constexpr std::array<std::string_view, 4> kLumpSchemeNames{"none", "hold", "port", "hyper"};

struct LumpCell {
  LumpScheme scheme = LumpScheme::none;
  double rtt_ms = 0, ratio = 1, diameter_mm = 0;
  FeltStiffness felt;  // result
};
using LumpCells = std::vector<LumpCell>;

struct LumpFlags {
  std::string out;
  bool quick = false;
  double weber = kWeber;
  CellFlags cells;
};

CellTable<LumpCell> lump_table() {
  CellTable<LumpCell> table;
  table.parameter("scheme", &LumpCell::scheme, kLumpSchemeNames)
      .parameter("rtt_ms", &LumpCell::rtt_ms, "{:g}")
      .parameter("ratio", &LumpCell::ratio, "{:g}")
      .parameter("diameter_mm", &LumpCell::diameter_mm, "{:g}")
      .result("stiffness_n_m", within(&LumpCell::felt, &FeltStiffness::stiffness_n_m), "{:.4f}")
      .result("spread_n_m", within(&LumpCell::felt, &FeltStiffness::spread_n_m), "{:.4f}");
  return table;
}

LumpCells lump_cells(bool quick) {
  const std::vector<double> ratios = quick ? std::vector<double>{4, 30} : std::vector<double>{2, 4, 10, 30},
                            diameters = quick ? std::vector<double>{8, 16, 24} : std::vector<double>{8, 10, 12, 16, 20, 24};
  LumpCells bodies = crossed(crossed(LumpCells(1), &LumpCell::ratio, ratios), &LumpCell::diameter_mm, diameters);
  bodies.insert(bodies.begin(), LumpCell());
  LumpCells cells = bodies;
  const std::array schemes{LumpScheme::hold, LumpScheme::port, LumpScheme::hyper};
  for (const LumpCell& cell :
       crossed(crossed(bodies, &LumpCell::scheme, schemes), &LumpCell::rtt_ms, std::vector<double>{0, 50, 150, 300}))
    cells.push_back(cell);
  return cells;
}

std::string body_of(const LumpCell& cell) { return fmt::format("{:g},{:g}", cell.ratio, cell.diameter_mm); }

SweepTask task_of(const LumpCell& cell) {
  Scene scene = lump_scene(1e-3 * cell.diameter_mm, cell.ratio);
  Motion motion = lump_press(scene);
  return {std::move(scene), std::move(motion), {}};
}

std::vector<Vec3> path_of(const Motion& motion, std::size_t ticks) {
  std::vector<Vec3> path;
  for (std::size_t i = 0; i < ticks; ++i) path.push_back(motion.position(1e-3 * static_cast<double>(i)));
  return path;
}

void measure_lump(LumpCell& cell, const SweepTask& task) {
  std::vector<Vec3> force = task.reference.force;
  if (cell.scheme != LumpScheme::none) {
    constexpr std::array kSchemes{Scheme::hold, Scheme::hold, Scheme::port, Scheme::hyper};
    ReplayOptions options;
    options.scheme = kSchemes[static_cast<std::size_t>(cell.scheme)];
    options.link.latency = from_seconds(cell.rtt_ms * 0.5e-3);
    options.references = {&task.reference, 1};
    force.clear();
    for (const ReplayTick& tick : replay(task.scene, task.motion, options, processor_ns).ticks) force.push_back(tick.felt);
  }
  cell.felt = felt_stiffness(path_of(task.motion, force.size()), force);
}

/// Cells of one scheme and round trip.
struct LumpCurve {
  LumpScheme scheme = LumpScheme::none;
  double rtt_ms = 0;
  LumpCells cells;

  const LumpCell* beside() const {
    const auto at = std::ranges::find_if(cells, [](const LumpCell& c) { return c.diameter_mm == 0; });
    return at == cells.end() ? nullptr : &*at;
  }
  /// Smallest diameter that is felt at a ratio [mm], an upper bound where it is the smallest that was tried; negative: none.
  double detectable_mm(double ratio, double weber) const {
    std::vector<IndexAt> indices;
    for (const LumpCell& c : cells)
      if (c.diameter_mm > 0 && c.ratio == ratio)
        indices.push_back({1e-3 * c.diameter_mm, detection_index(c.felt, beside()->felt, weber)});
    return 1e3 * detectable_diameter_m(indices);
  }
};

std::vector<LumpCurve> curves_of(const LumpCells& cells) {
  std::vector<LumpCurve> curves;
  for (const LumpCell& cell : cells) {
    auto known =
        std::ranges::find_if(curves, [&](const LumpCurve& c) { return c.scheme == cell.scheme && c.rtt_ms == cell.rtt_ms; });
    if (known == curves.end()) known = curves.insert(curves.end(), {cell.scheme, cell.rtt_ms, {}});
    known->cells.push_back(cell);
  }
  std::ranges::sort(curves, {}, [](const LumpCurve& c) { return std::pair(c.scheme, c.rtt_ms); });
  std::erase_if(curves, [](const LumpCurve& c) { return c.beside() == nullptr; });
  return curves;
}

std::vector<double> ratios_of(const std::vector<LumpCurve>& curves) {
  std::vector<double> ratios;
  for (const LumpCurve& curve : curves)
    for (const LumpCell& c : curve.cells)
      if (c.diameter_mm > 0 && std::ranges::count(ratios, c.ratio) == 0) ratios.push_back(c.ratio);
  std::ranges::sort(ratios);
  return ratios;
}

std::string_view name_of(LumpScheme scheme) { return kLumpSchemeNames[static_cast<std::size_t>(scheme)]; }

/// Draws the detectable diameter over the ratio, a panel for each scheme, with that without a network in all of them.
void draw(const std::filesystem::path& out, const std::vector<LumpCurve>& curves, const std::vector<double>& ratios,
          double weber) {
  std::map<std::pair<LumpScheme, double>, std::filesystem::path> files;
  for (const LumpCurve& curve : curves) {
    std::string csv = "ratio,diameter_mm\n";
    for (const double ratio : ratios)
      if (const double mm = curve.detectable_mm(ratio, weber); mm >= 0) csv += fmt::format("{:g},{:.2f}\n", ratio, mm);
    const auto file = out / fmt::format("lump-{}-{:g}.csv", name_of(curve.scheme), curve.rtt_ms);
    write_text(file, csv);
    files[{curve.scheme, curve.rtt_ms}] = file;
  }
  std::vector<GridPanel> panels;
  for (const LumpScheme scheme : {LumpScheme::hold, LumpScheme::port, LumpScheme::hyper}) {
    GridPanel panel{std::string(name_of(scheme)),
                    "stiffness of the lump, times that of the tissue",
                    "smallest felt diameter [mm]",
                    {},
                    "set logscale x\nset xtics (2, 4, 10, 30)\nset xrange [1.8:35]\nset yrange [0:24]"};
    panel.curves.push_back({"1:2", "no network", 0, files.at({LumpScheme::none, 0})});
    for (const LumpCurve& curve : curves)
      if (curve.scheme == scheme)
        panel.curves.push_back({"1:2", fmt::format("{:g} ms", curve.rtt_ms), static_cast<int>(panel.curves.size()),
                                files.at({scheme, curve.rtt_ms}), "linespoints"});
    panels.push_back(std::move(panel));
  }
  plot_grid(out / "lump.svg", "The smallest lump that a model observer feels, 5 mm under the surface", 3, panels);
}

void report(const LumpCells& cells, double weber, const std::filesystem::path& out) {
  const std::vector<LumpCurve> curves = curves_of(cells);
  const std::vector<double> ratios = ratios_of(curves);
  double smallest_mm = kLargestLumpM * 1e3;
  for (const LumpCell& c : cells)
    if (c.diameter_mm > 0) smallest_mm = std::min(smallest_mm, c.diameter_mm);
  Json summary{{"weber", weber}, {"smallest_tried_mm", smallest_mm}, {"curves", Json::array()}};
  fmt::print("\nsmallest felt diameter [mm], Weber fraction {:g}\n{:<8} {:>8} {:>12} {:>10}", weber, "scheme", "RTT [ms]",
             "beside [N/m]", "spread");
  for (const double ratio : ratios) fmt::print(" {:>9}", fmt::format("ratio {:g}", ratio));
  fmt::print("\n");
  for (const LumpCurve& curve : curves) {
    const FeltStiffness& beside = curve.beside()->felt;
    Json row{{"scheme", name_of(curve.scheme)},
             {"rtt_ms", curve.rtt_ms},
             {"beside_n_m", beside.stiffness_n_m},
             {"spread_n_m", beside.spread_n_m},
             {"detectable_mm", Json::object()}};
    fmt::print("{:<8} {:>8g} {:>12.1f} {:>10.2f}", name_of(curve.scheme), curve.rtt_ms, beside.stiffness_n_m, beside.spread_n_m);
    for (const double ratio : ratios) {
      const double mm = curve.detectable_mm(ratio, weber);
      fmt::print(" {:>9}", mm < 0 ? "none" : fmt::format("{}{:.1f}", mm > smallest_mm ? "" : "<= ", mm));
      row["detectable_mm"][fmt::format("{:g}", ratio)] = mm < 0 ? Json() : Json(mm);
    }
    fmt::print("\n");
    summary["curves"].push_back(std::move(row));
  }
  if (!curves.empty() && curves.front().scheme == LumpScheme::none) draw(out, curves, ratios, weber);
  write_json(out / "summary.json", summary);
  fmt::print("\n{}\n", (out / "summary.json").string());
}

int run_lump(const LumpFlags& flags) {
  const auto out = make_output_folder(flags.out);
  SweepTasks tasks;
  CellSweep<LumpCell> sweep{lump_table(), {}};
  if (!flags.cells.merge) sweep.cells = lump_cells(flags.quick);
  sweep.prepare = [&](LumpCells& cells, unsigned jobs) {
    for (const LumpCell& cell : cells)
      if (!tasks.contains(body_of(cell))) tasks.emplace(body_of(cell), task_of(cell));
    add_references(tasks, jobs);
  };
  sweep.measure = [&](LumpCell& cell) { measure_lump(cell, tasks.at(body_of(cell))); };
  if (const auto cells = run_cells(sweep, flags.cells, out)) report(*cells, flags.weber, out);
  return 0;
}

}  // namespace

void add_lump(CLI::App& app, Run& run) {
  auto flags = std::make_shared<LumpFlags>();
  CLI::App* c =
      app.add_subcommand("lump", "find the smallest lump that a model observer feels, over its stiffness and the round trip");
  c->add_flag("--quick", flags->quick, "use three diameters and two ratios instead of six and four");
  c->add_option("--weber", flags->weber, "Weber fraction of stiffness; 0.08 to 0.23 were measured")
      ->check(number_from(0.01, 1.0));
  flags->cells.add_to(*c);
  c->add_option("--out", flags->out, "folder for cells.csv, summary.json and lump.svg")->type_name("DIR")->required();
  c->callback([flags, &run] { run = [flags] { return run_lump(*flags); }; });
}

}  // namespace palpate
