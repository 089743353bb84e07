#include "bench/lab/bode_findings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace palpate {
namespace {

constexpr double kPaperError = 1.6e-3;

/// Largest difference between the magnitudes of one entry [dB].
double magnitude_gap_db(const PortModel& a, const PortModel& b, Complex PortEntries::*entry) {
  double gap = 0;
  for (std::size_t i = 0; i < a.response.value.size(); ++i)
    gap = std::max(gap, std::abs(decibels(std::abs(port_entries(a.response.value[i]).*entry) /
                                          std::abs(port_entries(b.response.value[i]).*entry))));
  return gap;
}

/// Frequency above which the error stays below `error` [Hz].
double good_above_hz(const PortModel& m, double error) {
  double from = 0;
  for (std::size_t i = 0; i < m.error.size(); ++i)
    if (m.error[i] > error) from = m.response.frequency_hz[i];
  return from;
}

double order_error(const std::vector<MapPoint>& map, int order) {
  const auto at = std::find_if(map.begin(), map.end(), [&](const MapPoint& p) { return p.order == order; });
  return at == map.end() ? NAN : at->error;
}

void add_truncation(std::vector<Finding>& f, const BodeRun& run, const PortModel& ten) {
  const PortModel& full = run.study.full();
  f.push_back({"order of the linearised sheet", "524", std::to_string(full.states),
               full.states == 524 ? Verdict::agrees : Verdict::differs, "13 x 13 nodes: the paper's 12 x 12 counts cells"});
  f.push_back(
      {"H-infinity error of 10 balanced states, relative to the whole body", "less than 1 %",
       fmt::format("{:.2f} %, within {:.0e} of it", 100 * ten.hinf.relative, ten.hinf.uncertainty / ten.hinf.peak.norm),
       ten.hinf.relative < kOnePerCent ? Verdict::agrees : Verdict::differs,
       "relative to the norm of G less its damper at the port (G itself grows without limit); at k = 100 N/m, b = 0.5 N s/m, "
       "m = 1 g, which the paper does not print"});
  const double same_k = run.material.stiffness_n_m * kPaperError / ten.hinf.peak.norm;
  f.push_back(
      {"the same error, absolute", "less than 1.6e-3", fmt::format("{:.2f} N/m", ten.hinf.peak.norm), Verdict::differs,
       fmt::format("the figure scales with the stiffness, which the paper does not print: it would be 1.6e-3 N/m at k = {:.2g} "
                   "N/m. Read as a relative error, 1.6e-3 needs {}.",
                   same_k,
                   run.study.find("balanced-12")
                       ? fmt::format("12 states here ({:.1e})", run.study.find("balanced-12")->hinf.relative)
                       : "more states")});
  const double normal = magnitude_gap_db(ten, full, &PortEntries::normal),
               tangential = magnitude_gap_db(ten, full, &PortEntries::tangential);
  constexpr double kVisibleDb = 0.5;
  f.push_back({"responses of whole and reduced system (fig. 5)", "essentially indistinguishable",
               fmt::format("at most {:.2f} dB apart (normal), {:.2f} dB (tangential)", normal, tangential),
               std::max(normal, tangential) < kVisibleDb ? Verdict::agrees : Verdict::differs,
               "0.5 dB can hardly be seen in a plot"});
  const double cross = decibels(std::max(largest_cross(full), largest_cross(ten)));
  f.push_back({"normal-tangential response", "less than -200 dB", fmt::format("{:.0f} dB re 1 N/m, whole and reduced", cross),
               cross < -200 ? Verdict::agrees : Verdict::differs,
               "zero by symmetry about the instrument: what is left is rounding"});
}

void add_map(std::vector<Finding>& f, const BodeRun& run, const std::vector<MapPoint>& light) {
  const double ratio = ratio_needed(run.map, kPaperOrder, kOnePerCent), strict = ratio_needed(run.map, kPaperOrder, kPaperError);
  f.push_back({"where 10 states are enough for 1 %", "not said; no damping is printed",
               fmt::format("b / sqrt(k m) of {:.2f} or more; for 0.16 % {}", ratio,
                           std::isfinite(strict) ? fmt::format("{:.2f}", strict) : std::string("nowhere on the map")),
               Verdict::beyond,
               fmt::format("the relative error depends on that ratio alone; it is {:.2f} here", run.material.damping_ratio())});
  const auto needed = orders_needed(light, kOnePerCent);
  f.push_back({"the same in lightly damped tissue", "less than 1 %",
               fmt::format("{:.1f} % at b / sqrt(k m) = {:.2f}; 1 % needs {}", 100 * order_error(light, kPaperOrder),
                           light.front().damping_ratio,
                           needed.front().order > 0 ? fmt::format("{} states", needed.front().order) : "more than 40 states"),
               Verdict::differs,
               "the lighter the damping the more modes ring separately: the claim holds for well-damped tissue"});
}

void add_local(std::vector<Finding>& f, const BodeRun& run, const PortModel& ring) {
  f.push_back({"DC gain of the ring around the instrument (fig. 9)", "significantly off",
               fmt::format("{:.0f} % too stiff", 100 * ring.dc_rel_error),
               ring.dc_rel_error > 0.1 ? Verdict::agrees : Verdict::differs, "the held nodes are nearer than the real walls"});
  f.push_back({"the ring at high frequency", "approximates the full model",
               fmt::format("within {:.0f} % in 100-1000 Hz", 100 * ring.band_100_1000_rel_error),
               ring.band_100_1000_rel_error < 0.2 ? Verdict::agrees : Verdict::differs, ""});
  const double from = good_above_hz(ring, 0.2);
  const double unit = std::sqrt(run.material.stiffness_n_m / run.material.node_mass_kg) / (2 * std::numbers::pi);
  f.push_back(
      {"the ring over 10-1000 Hz", "close to the full model, as needed between frames",
       fmt::format("off by up to {:.0f} % in 10-100 Hz", 100 * ring.band_10_100_rel_error),
       ring.band_10_100_rel_error < 0.2 ? Verdict::agrees : Verdict::differs,
       fmt::format(
           "within 20 % above {:.0f} Hz = {:.1f} sqrt(k/m) / 2 pi only: the claim needs tissue whose waves are slower than "
           "this, a softer or heavier one",
           from, from / unit)});
  std::string dc, band;
  bool falls = true;
  const PortModel* before = nullptr;
  for (int layers = 1; const PortModel* m = run.study.find("ring-" + std::to_string(layers)); ++layers) {
    dc += fmt::format("{}{:.0f}", layers > 1 ? " / " : "", 100 * m->dc_rel_error);
    band += fmt::format("{}{:.0f}", layers > 1 ? " / " : "", 100 * m->band_10_100_rel_error);
    falls = falls &&
            (!before || (m->dc_rel_error < before->dc_rel_error && m->band_10_100_rel_error < before->band_10_100_rel_error));
    before = m;
  }
  f.push_back({"more layers around the instrument", "improve the low frequencies",
               fmt::format("DC error {} %, 10-100 Hz {} % for 1 / 2 / 3 / 4 layers", dc, band),
               falls ? Verdict::agrees : Verdict::differs,
               before ? fmt::format("slowly: {} states for the last", before->states) : ""});
  if (const PortModel* same = run.study.find("balanced-20"))
    f.push_back({"balanced model with as many states as the ring (fig. 9)", "drawn, no number",
                 fmt::format("{:.0e} relative, the ring {:.0f} %", same->hinf.relative, 100 * ring.hinf.relative),
                 Verdict::beyond, ""});
}

void add_ports(std::vector<Finding>& f, const PortStudy& study) {
  if (const PortModel* m = study.find("two-layer"))
    f.push_back({"two layers with scaled elements (figs 10 and 11)", "captures the first cut-off and the overall shape",
                 fmt::format("DC error {:.0f} %, 10-100 Hz {:.0f} %, 100-1000 Hz {:.0f} %", 100 * m->dc_rel_error,
                             100 * m->band_10_100_rel_error, 100 * m->band_100_1000_rel_error),
                 m->dc_rel_error < study.find("ring-1")->dc_rel_error ? Verdict::agrees : Verdict::differs, ""});
  if (const PortModel* m = study.find("condensed-1"))
    f.push_back({"static condensation onto the same nodes", "",
                 fmt::format("DC exact, 10-100 Hz {:.0f} %, 100-1000 Hz {:.0f} %", 100 * m->band_10_100_rel_error,
                             100 * m->band_100_1000_rel_error),
                 Verdict::beyond, "the low end is right, the far masses arrive at once instead of later"});
  if (const PortModel* m = study.find("port"))
    f.push_back({"the patch that this server sends", "",
                 fmt::format("{} states: DC {:.0e}, 10-100 Hz {:.2f} %, 100-1000 Hz {:.2f} %", m->states, m->dc_rel_error,
                             100 * m->band_10_100_rel_error, 100 * m->band_100_1000_rel_error),
                 Verdict::beyond, "built on-line in milliseconds, which balanced truncation is not"});
}

}  // namespace

std::vector<Finding> bode_findings(const BodeRun& run, const std::vector<MapPoint>& light) {
  std::vector<Finding> f;
  if (const PortModel* ten = run.study.find("balanced-10")) add_truncation(f, run, *ten);
  if (!run.map.empty() && !light.empty()) add_map(f, run, light);
  if (const PortModel* ring = run.study.find("ring-1")) add_local(f, run, *ring);
  add_ports(f, run.study);
  return f;
}

std::vector<Finding> solid_findings(const PortStudy& solid) {
  std::vector<Finding> f;
  f.push_back({"order of a 10 x 10 x 10 cube", "1000 x 3 x 2 = 6000", std::to_string(solid.full().states), Verdict::agrees,
               "1000 free nodes on a fixed floor, less the one that the instrument holds"});
  for (const PortModel& m : solid.models)
    if (m.name.starts_with("balanced-"))
      f.push_back({fmt::format("{} balanced states of the cube", m.states), "",
                   fmt::format("H-infinity error {:.2g} %", 100 * m.hinf.relative), Verdict::beyond,
                   "low-rank Gramians; the paper balanced the sheet only"});
  return f;
}

}  // namespace palpate
