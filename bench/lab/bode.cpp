// palpate-lab bode: frequency responses at the port of the paper's sheet, whole and reduced (sections 4 and 5, figs 5, 9 and 11).
#include <fmt/format.h>

#include <array>
#include <cmath>

#include "bench/lab/bode_findings.hpp"
#include "bench/lab/experiments.hpp"
#include "bench/lab/material_flags.hpp"
#include "bench/output/output.hpp"
#include "bench/output/progress.hpp"

namespace palpate {
namespace {

constexpr int kSolidNodes = 10;

struct BodeFlags {
  Material material;
  std::vector<int> orders{10, 12, 20};
  int nodes = 0;  ///< nodes along an edge; 0: the paper's
  bool solid = false, map = true;
  std::string out;
};

Specimen specimen_of(const BodeFlags& f) {
  return f.solid ? Specimen::cube(f.nodes > 0 ? f.nodes : kSolidNodes, f.material)
                 : Specimen::sheet(f.nodes > 0 ? f.nodes : kPaperNodes, f.material);
}

/// Logarithmic from 0.02 to 2 N s/m at the paper's k and m; scaled by b / sqrt(k m), so that the map is the same for all k and m.
std::vector<double> map_dampings(const Material& material, int count) {
  const double unit = std::sqrt(material.stiffness_n_m * material.node_mass_kg);
  const Material low{100, 0.02, 0.001}, high{100, 2, 0.001};
  std::vector<double> b;
  for (int i = 0; i < count; ++i)
    b.push_back(unit * low.damping_ratio() *
                std::pow(high.damping_ratio() / low.damping_ratio(), static_cast<double>(i) / (count - 1)));
  return b;
}

BodeRun compute(const BodeFlags& flags, bool quick) {
  const bool map = flags.map && !flags.solid;
  const std::vector<double> dampings = map ? map_dampings(flags.material, quick ? 4 : 13) : std::vector<double>{};
  Steps steps(2 + dampings.size());
  steps.begin("balancing the body");
  const Specimen specimen = specimen_of(flags);
  const BalancedReduction balanced(specimen.system());
  PortStudyOptions options;
  for (const int order : flags.orders) {
    if (order > balanced.states())
      throw InputError("--order " + std::to_string(order), "is more than the states that stand above rounding",
                       "at most " + std::to_string(balanced.states()));
    if (const int stable = balanced.stable_order(order); stable != order)
      throw InputError("--order " + std::to_string(order), "parts two states that belong together", std::to_string(stable));
  }
  options.orders = flags.orders;
  options.per_decade = quick ? 40 : 100;
  if (flags.solid) {
    options.rings = 1;
    options.per_decade = 20;
  }
  BodeRun run;
  run.material = flags.material;
  steps.begin("its reductions, and their errors");
  run.study = study_port(specimen, balanced, options);
  std::vector<int> orders;
  for (int order = 2; order <= 40; order += quick ? 4 : 2) orders.push_back(order);
  for (const double damping : dampings) {
    steps.begin(fmt::format("the map, {:.3g} N s/m", damping));
    for (const MapPoint& point :
         truncation_map(flags.nodes > 0 ? flags.nodes : kPaperNodes, flags.material, std::array{damping}, orders))
      run.map.push_back(point);
  }
  return run;
}

void print_table(const BodeRun& run) {
  fmt::print("{:<64} {:>6}  {:>12} {:>10} {:>10} {:>12}\n", "relative error", "states", "H-infinity", "DC", "10-100 Hz",
             "100-1000 Hz");
  for (const PortModel& m : run.study.models)
    fmt::print("{:<64} {:>6}  {:>12.2g} {:>10.2g} {:>10.2g} {:>12.2g}\n", m.name + ": " + m.title, m.states, m.hinf.relative,
               m.dc_rel_error, m.band_10_100_rel_error, m.band_100_1000_rel_error);
  fmt::print("H-infinity norm of the whole body less its damper at the port: {:.4g} N/m\n", run.study.proper_norm.norm);
}

/// Adds the cube of section 3, for which the paper gives the order but no reduction.
void add_solid(PaperSection& section, const std::filesystem::path& out) {
  BodeFlags flags;
  flags.solid = true;
  make_output_folder(out.string());
  const BodeRun run = compute(flags, false);
  write_bode(out, run);
  plot_bode(out, run);
  for (const Finding& f : solid_findings(run.study)) section.findings.push_back(f);
  section.pictures.push_back({out / "bode.svg", "A cube of 5994 states and balanced truncations of it."});
}

int run_bode(const BodeFlags& flags) {
  refuse_nan(flags.material);
  const auto out = make_output_folder(flags.out);
  const BodeRun run = compute(flags, false);
  write_bode(out, run);
  plot_bode(out, run);
  print_table(run);
  fmt::print("{}\n", (out / "summary.json").string());
  return 0;
}

}  // namespace

void add_bode(CLI::App& app, Run& run) {
  auto flags = std::make_shared<BodeFlags>();
  CLI::App* c = app.add_subcommand("bode", "frequency responses of the paper's sheet, whole, balanced, ring and port bases");
  add_material(*c, flags->material);
  c->add_option("--order", flags->orders, "states of balanced truncation, for example 10,12,20")
      ->delimiter(',')
      ->check(number_from(1, 200));
  c->add_option("--nodes", flags->nodes, "along an edge (default: 13, solid: 10)")->check(number_from(3, 40));
  c->add_flag("--solid", flags->solid, "a cube of 10 x 10 x 10 free nodes instead: the paper's 6000th order; minutes");
  c->add_flag("--map,!--no-map", flags->map, "error over order and damping");
  c->add_option("--out", flags->out, "folder for a CSV of every curve, summary.json and plots")->type_name("DIR")->required();
  c->callback([flags, &run] { run = [flags] { return run_bode(*flags); }; });
}

PaperSection paper_bode(const std::filesystem::path& out, bool quick) {
  make_output_folder(out.string());
  const BodeFlags flags;
  const BodeRun run = compute(flags, quick);
  write_bode(out, run);
  plot_bode(out, run);
  constexpr double kLight = 0.1;
  std::vector<int> orders;
  for (int order = 2; order <= 40; order += 2) orders.push_back(order);
  const std::vector<MapPoint> light = truncation_map(kPaperNodes, flags.material, std::array{kLight}, orders);

  PaperSection s;
  s.title = "Sections 4 and 5, figures 4, 5, 7-11: the sheet at its port, whole and reduced";
  s.command = "palpate-lab bode --out DIR";
  s.text =
      "A sheet of 13 x 13 nodes, three edges fixed, held at the middle of the free one, linearised at rest: force over "
      "displacement "
      "of the instrument. H-infinity norms are computed by bisection on the Hamiltonian, with a bound of what a balanced "
      "stand-in for "
      "the whole body leaves out. Relative errors over bands: the largest singular value of the difference over that of the "
      "whole "
      "body, at the worst frequency.";
  s.findings = bode_findings(run, light);
  s.pictures = {
      {out / "bode.svg", "Figure 5: whole sheet and 10 balanced states. The cross term is zero by symmetry."},
      {out / "map.svg", "Where the paper's 10 states with 1 % hold: error over order and damping."},
      {out / "ring.svg", "Figure 9: the ring of figure 8, the whole sheet, and a balanced model of as many states."},
      {out / "layers.svg", "More layers around the instrument improve the low frequencies, slowly."},
      {out / "local.svg", "Figures 10 and 11: local models that keep the stiffness at rest, and the patch as it is sent."},
      {out / "error.svg", "Error over frequency; the model runs alone between frames in the grey band."}};
  if (!quick) add_solid(s, out / "solid");
  return s;
}

}  // namespace palpate
