// Section `modes` of palpate-lab paper: location of the reduced model's states in the sheet (the paper's fig. 6), and decay of
// its stress.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "bench/lab/experiments.hpp"
#include "bench/output/output.hpp"
#include "bench/output/plot.hpp"
#include "bench/paper/balance.hpp"
#include "bench/paper/locality.hpp"

namespace palpate {
namespace {

/// Depths between which the exponent of the stress is fitted: from about the first node of the paper's sheet to a third of the
/// sheet, before the fixed edges have an effect. Curves are drawn relative to the stress at kReferenceM.
constexpr double kFitFromM = 0.008, kFitToM = 0.034, kReferenceM = 0.02;
/// Radius of the headline figure: a quarter of the sheet.
constexpr double kNearM = 0.025;

constexpr int kModesOrder = 10;

struct Decay {
  std::string name, title;
  std::vector<StressAt> stress;
  double exponent = 0;
};

struct ModesRun {
  std::vector<double> radii_m, even;
  std::vector<StateShape> shapes;
  std::vector<Decay> decays;
};

std::size_t near_index(const ModesRun& run) {
  std::size_t k = 0;
  while (run.radii_m[k] < kNearM * (1 - 1e-9)) ++k;
  return k;
}

/// Interpolates between two nodes, along a power law.
double stress_at(const std::vector<StressAt>& line, double depth_m) {
  std::size_t k = 1;
  while (k + 1 < line.size() && line[k].depth_m < depth_m) ++k;
  const double part = std::log(depth_m / line[k - 1].depth_m) / std::log(line[k].depth_m / line[k - 1].depth_m);
  return line[k - 1].stress * std::pow(line[k].stress / line[k - 1].stress, part);
}

Decay decay_of(const std::string& name, const std::string& title, const Specimen& specimen) {
  Decay d{name, title, stress_below_port(specimen), 0};
  d.exponent = decay_exponent(d.stress, kFitFromM, kFitToM);
  return d;
}

ModesRun compute(bool quick) {
  const Material material;
  const Specimen sheet = Specimen::sheet(kPaperNodes, material);
  const SecondOrderSystem system = sheet.system();
  const BalancedReduction balanced(system);
  ModesRun run;
  for (int k = 1; k <= 24; ++k) run.radii_m.push_back(0.005 * k);
  run.even = even_share(sheet, run.radii_m);
  run.shapes = state_shapes(sheet, system, balanced.directions(kModesOrder), run.radii_m);
  run.decays.push_back(decay_of("sheet", fmt::format("sheet, {0} x {0} nodes", kPaperNodes), sheet));
  if (!quick) run.decays.push_back(decay_of("fine-sheet", "sheet, 49 x 49 nodes", Specimen::sheet(49, material)));
  run.decays.push_back(decay_of("cube", "cube, 10 x 10 x 10 nodes", Specimen::cube(10, material)));
  if (!quick) run.decays.push_back(decay_of("fine-cube", "cube, 20 x 20 x 20 nodes", Specimen::cube(20, material)));
  return run;
}

void write_tables(const std::filesystem::path& out, const ModesRun& run) {
  const Specimen sheet = Specimen::sheet(kPaperNodes, Material());
  std::string csv = "x_mm,depth_mm";
  for (std::size_t k = 0; k < run.shapes.size(); ++k) csv += fmt::format(",displacement_{0},velocity_{0}", k + 1);
  csv += '\n';
  for (std::size_t i = 0; i < sheet.body().nodes.size(); ++i) {
    const Vec3& x = sheet.body().nodes[i];
    csv += fmt::format("{:.6g},{:.6g}", 1e3 * x.x(), 1e3 * (kSpecimenSizeM - x.y()));
    for (const StateShape& s : run.shapes)
      fmt::format_to(std::back_inserter(csv), ",{:.6g},{:.6g}", s.displacement[i], s.velocity[i]);
    csv += '\n';
  }
  write_text(out / "states.csv", csv);

  csv = "radius_mm,evenly_spread";
  for (std::size_t k = 0; k < run.shapes.size(); ++k) csv += fmt::format(",state_{}", k + 1);
  csv += '\n';
  for (std::size_t r = 0; r < run.radii_m.size(); ++r) {
    csv += fmt::format("{:.6g},{:.6g}", 1e3 * run.radii_m[r], run.even[r]);
    for (const StateShape& s : run.shapes) csv += fmt::format(",{:.6g}", s.share_within[r]);
    csv += '\n';
  }
  write_text(out / "energy.csv", csv);

  for (const Decay& d : run.decays) {
    csv = "depth_mm,stress,relative\n";
    const double reference = stress_at(d.stress, kReferenceM);
    for (const StressAt& s : d.stress)
      csv += fmt::format("{:.6g},{:.6g},{:.6g}\n", 1e3 * s.depth_m, s.stress, s.stress / reference);
    write_text(out / ("stress-" + d.name + ".csv"), csv);
  }
}

/// Draws one small map per state, in the orientation of the sheet: free edge on top, the instrument a ring at (50, 0).
void plot_states(const std::filesystem::path& out, const ModesRun& run) {
  const auto count = static_cast<int>(run.shapes.size());
  const int columns = std::min(5, count), rows = (count + columns - 1) / columns;
  constexpr int kWidth = 960, kHeaderHeight = 40, kFooterHeight = 20, kRow = 215;
  const int height = kHeaderHeight + rows * kRow + kFooterHeight;
  std::string s = fmt::format("set multiplot layout {},{} title {} font ',15' margins 0.055,0.91,{},{} spacing 0.025,{}\n", rows,
                              columns, quoted("Displacements that each reduced state stands for (1 = largest; position in mm)"),
                              1.6 * kFooterHeight / height, 1 - 1.6 * kHeaderHeight / height, 0.22 * kRow / height);
  s += map_palette();
  const double half = 50.0 / (kPaperNodes - 1);
  s += fmt::format(
      "set cbrange [0:1]\nset xrange [{0}:{1}]\nset yrange [{1}:{0}]\nset xtics 50\nset ytics 50\nset size ratio -1\nunset key\n"
      "unset grid\nunset colorbox\n",
      -half, 100 + half);
  const std::string csv = quoted((out / "states.csv").string());
  const std::size_t near = near_index(run);
  for (int k = 0; k < count; ++k) {
    s += fmt::format("set title 'state {}: {:.0f} % within 25 mm' font ',11' offset 0,-0.6\n", k + 1,
                     100 * run.shapes[static_cast<std::size_t>(k)].share_within[near]);
    s += k % columns == 0 ? "set format y '%h'\n" : "set format y ''\n";
    s += k + columns >= count ? "set format x '%h'\n" : "set format x ''\n";
    if (k + 1 == count) s += "set colorbox user origin 0.93,0.3 size 0.015,0.4\n";
    s += fmt::format(
        "plot {} using 1:2:{} skip 1 with image, '+' using (50):(0) every ::0::0 with points pt 6 ps 1.4 lw 2 lc rgb '#009e73'\n",
        csv, 3 + 2 * k);
  }
  plot_script(out / "states.svg", kWidth, height, s + "unset multiplot\n");
}

void plot_locality(const std::filesystem::path& out, const ModesRun& run) {
  constexpr int kWidth = 960, kHeight = 440;
  const std::string side = "set lmargin 9\nset key outside right top vertical Left reverse samplen 2\n";
  std::string s =
      side +
      "set title 'Energy of the reduced states around the instrument' font ',15'\nset xlabel 'distance from the instrument "
      "[mm]'\nset ylabel 'share of the energy within it [-]'\nset yrange [0:1.02]\nplot ";
  const std::string energy = quoted((out / "energy.csv").string());
  for (std::size_t k = 0; k < std::min<std::size_t>(run.shapes.size(), 7); ++k)
    s += fmt::format("{} using 1:{} skip 1 with lines lt {} lw 2 title 'state {}', ", energy, k + 3, k + 1, k + 1);
  plot_script(out / "energy.svg", kWidth, kHeight, s + energy + " using 1:2 skip 1 with lines lt 8 title 'evenly spread'\n");

  s = side +
      fmt::format(
          "set title 'Static stress straight below the instrument' font ',15'\nset logscale xy\nset xrange [5:100]\nset yrange "
          "[0.03:20]\nset xtics (5,10,20,50,100)\nset xlabel 'depth [mm]'\nset ylabel 'stress over that at {:g} mm [-]'\nplot ",
          1e3 * kReferenceM);
  int type = 1;
  for (const Decay& d : run.decays) {
    s += fmt::format("{} using 1:3 skip 1 with linespoints lt {} title {}, ",
                     quoted((out / ("stress-" + d.name + ".csv")).string()), type,
                     quoted(fmt::format("{}: r^{{-{:.2f}}}", d.title, d.exponent)));
    ++type;
  }
  s += fmt::format("{0}/x with lines lt 8 lw 2 dt 2 title '1/r', ({0}/x)**2 with lines lt 8 lw 2 dt 3 title '1/r^2'\n",
                   1e3 * kReferenceM);
  plot_script(out / "stress.svg", kWidth, kHeight, s);
}

void write(const std::filesystem::path& out, const ModesRun& run) {
  write_tables(out, run);
  plot_states(out, run);
  plot_locality(out, run);
}

}  // namespace

PaperSection paper_modes(const std::filesystem::path& out, bool quick) {
  make_output_folder(out.string());
  const ModesRun run = compute(quick);
  write(out, run);
  const std::size_t near = near_index(run);
  double least = 1, first = run.shapes.front().share_within[near];
  for (const StateShape& s : run.shapes) least = std::min(least, s.share_within[near]);

  PaperSection s;
  s.title = "Section 4, figure 6: where the reduced states live";
  s.text =
      "Each of the 10 balanced states stands for displacements and velocities of all nodes; the pictures show the displacements "
      "over the "
      "sheet, the instrument at (50, 0). Its locality as a number: the share of its energy (elements and moving masses) within "
      "25 mm, "
      "against that of a state spread evenly. The paper explains the locality by the decay of stress; that is measured too.";
  s.findings.push_back(
      {"states of the reduced model", "a local approximation, around (50, 0)",
       fmt::format("{:.0f} % of the energy of the first state lies within 25 mm, at least {:.0f} % of any; spread evenly "
                   "it would be {:.0f} %",
                   100 * first, 100 * least, 100 * run.even[near]),
       least > run.even[near] ? Verdict::agrees : Verdict::differs, "the leading states are the most local"});
  for (const Decay& d : run.decays) {
    const bool planar = d.name.find("sheet") != std::string::npos;
    s.findings.push_back(
        {"decay of stress below the instrument, " + d.title, "1/r^2 (half-space)", fmt::format("r^-{:.2f}", d.exponent),
         planar ? Verdict::differs : Verdict::agrees,
         planar ? "1/r^2 is the law of a solid (Boussinesq); a sheet is a half-plane, where it is 1/r (Flamant): fig. 6 is "
                  "local in spite of it"
                : "short of 2 by the fixed floor and the size of a cell"});
  }
  s.pictures = {{out / "states.svg", "Figure 6: magnitude of the displacements of each reduced state over the sheet."},
                {out / "energy.svg", "Energy of the reduced states against the distance from the instrument."},
                {out / "stress.svg", "Stress straight below the instrument: 1/r in a sheet, towards 1/r^2 in a cube."}};
  return s;
}

}  // namespace palpate
