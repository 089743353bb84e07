// Section `bode` of palpate-lab paper: frequency responses at the port of the paper's sheet, whole and reduced (sections 4 and 5,
// figs 5, 9 and 11).
#include <fmt/format.h>

#include <array>
#include <cmath>

#include "bench/lab/bode_findings.hpp"
#include "bench/lab/experiments.hpp"
#include "bench/output/output.hpp"

namespace palpate {
namespace {

constexpr int kSolidNodes = 10;

/// Logarithmic from 0.02 to 2 N s/m; the map depends on b / sqrt(k m) alone.
std::vector<double> map_dampings(int count) {
  std::vector<double> b;
  for (int i = 0; i < count; ++i) b.push_back(0.02 * std::pow(100, static_cast<double>(i) / (count - 1)));
  return b;
}

/// `solid`: the cube of section 3 instead of the sheet, without the map.
BodeRun compute(bool solid, bool quick) {
  BodeRun run;
  const std::vector<double> dampings = solid ? std::vector<double>{} : map_dampings(quick ? 4 : 13);
  const Specimen specimen = solid ? Specimen::cube(kSolidNodes, run.material) : Specimen::sheet(kPaperNodes, run.material);
  PortStudyOptions options;
  options.per_decade = quick ? 40 : 100;
  if (solid) {
    options.rings = 1;
    options.per_decade = 20;
  }
  run.study = study_port(specimen, BalancedReduction(specimen.system()), options);
  std::vector<int> orders;
  for (int order = 2; order <= 40; order += quick ? 4 : 2) orders.push_back(order);
  if (!dampings.empty()) run.map = truncation_map(kPaperNodes, run.material, dampings, orders);
  return run;
}

/// Adds the cube of section 3, for which the paper gives the order but no reduction.
void add_solid(PaperSection& section, const std::filesystem::path& out) {
  make_output_folder(out.string());
  const BodeRun run = compute(true, false);
  write_bode(out, run);
  plot_bode(out, run);
  for (const Finding& f : solid_findings(run.study)) section.findings.push_back(f);
  section.pictures.push_back({out / "bode.svg", "A cube of 5994 states and balanced truncations of it."});
}

}  // namespace

PaperSection paper_bode(const std::filesystem::path& out, bool quick) {
  make_output_folder(out.string());
  const BodeRun run = compute(false, quick);
  write_bode(out, run);
  plot_bode(out, run);
  constexpr double kLight = 0.1;
  std::vector<int> orders;
  for (int order = 2; order <= 40; order += 2) orders.push_back(order);
  const std::vector<MapPoint> light = truncation_map(kPaperNodes, run.material, std::array{kLight}, orders);

  PaperSection s;
  s.title = "Sections 4 and 5, figures 4, 5, 7-11: the sheet at its port, whole and reduced";
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
