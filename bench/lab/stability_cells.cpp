#include "bench/lab/stability_cells.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <tuple>

#include "bench/lab/link_flags.hpp"
#include "bench/measure/tools_apart.hpp"
#include "bench/paper/cube.hpp"
#include "common/base/error.hpp"
#include "common/base/limits.hpp"
#include "server/scene/tools.hpp"

namespace palpate {
namespace {

constexpr double kTipRadiusM = 0.020;
constexpr std::array<std::string_view, 2> kContacts{"grasp", "touch"};  // of ContactKind

/// Width of the block on which the hands of a point stand at least kTipRadiusM from the edge [m]: a multiple of its cells.
double width_for(const StabilityPoint& point) {
  constexpr double kCellM = 0.02;
  double reach_m = 0;
  for (int k = 0; k < point.hands; ++k)
    reach_m = std::max(reach_m, place_apart(k, point.hands, 1e-3 * point.apart_mm).norm() + kTipRadiusM);
  return std::max(kPaperCubeM, kCellM * std::ceil(2 * reach_m / kCellM));
}

Scene scene_of(StabilityCube cube, const StabilityPoint& point) {
  const double width_m = width_for(point);
  const bool needle = point.tool == kNeedle;
  Scene scene = needle || cube == StabilityCube::solid ? solid_cube(point.contact, width_m) : paper_cube(point.contact, width_m);
  if (point.contact == ContactKind::touch) scene.tool.radius_m = kTipRadiusM;
  if (needle) {
    scene.body.tissue = {{.toughness_j_m2 = 164, .puncture_n = 0.6, .friction_n_m = 10}};  // scenes/needles/liver.json
    scene.tool.needle = NeedleSpec{.length_m = 0.045, .width_m = 0.00127};
  } else if (!point.tool.empty()) {
    scene.tool.shape = find_tool(point.tool)->shape;
  }
  return scene;
}

using ReferenceKey = std::tuple<ContactKind, std::string, std::string, Gesture, double, int, double>;
ReferenceKey reference_key(const StabilityPoint& p) {
  return {p.contact, p.hand, p.tool, p.gesture, p.stiffness_n_m, p.hands, p.apart_mm};
}
using StabilityReferences = std::map<ReferenceKey, StabilityReference>;

StabilityReferences references_of(const std::vector<StabilityCell>& cells, StabilityCube cube, unsigned jobs) {
  StabilityReferences references;
  std::vector<std::pair<const StabilityPoint*, StabilityReference*>> due;
  for (const StabilityCell& c : cells)
    if (const auto [entry, fresh] = references.try_emplace(reference_key(c.point)); fresh)
      due.emplace_back(&c.point, &entry->second);
  run_all(
      due.size(), [&](std::size_t i) { *due[i].second = reference_of(*due[i].first, cube); }, jobs, "the references");
  return references;
}

void measure_point(StabilityCell& cell, const StabilityReference& reference, const CellTable<StabilityCell>& table) try {
  const StabilityResult result = measure_stability(cell.point, reference);
  const LoopVerdict& v = result.verdict;
  cell.fault = v.fault;
  cell.tail_mm = 1e3 * v.rest.tail_m();
  cell.growth_1_s = v.rest.growth_1_s;
  cell.shake_mm = 1e3 * v.shake.motion_m;
  cell.shake_mm_s = 1e3 * v.shake.speed_m_s;
  cell.generated_mj = 1e3 * v.generated_j;
  cell.cut_ms = 1e3 * result.cut_s;
  cell.step_max_n = result.step_max_n;
} catch (const std::runtime_error& failure) {
  throw std::runtime_error(fmt::format("{}: {}", table.key(cell), failure.what()));
}

}  // namespace

StabilityKind kind_of(const StabilityPoint& point) {
  if (!point.tool.empty()) return StabilityKind::tools;
  return point.hands > 1 ? StabilityKind::hands : StabilityKind::hand;
}

CellTable<StabilityCell> stability_table(StabilityKind kind) {
  CellTable<StabilityCell> table;
  table.parameter("scheme", within(&StabilityCell::point, &StabilityPoint::scheme), kSchemeNames)
      .parameter("contact", within(&StabilityCell::point, &StabilityPoint::contact), kContacts)
      .parameter("hand", within(&StabilityCell::point, &StabilityPoint::hand))
      .parameter("gesture", within(&StabilityCell::point, &StabilityPoint::gesture), kGestureNames)
      .parameter("stiffness_n_m", within(&StabilityCell::point, &StabilityPoint::stiffness_n_m), "{:g}")
      .parameter("rate_hz", within(&StabilityCell::point, &StabilityPoint::rate_hz), "{:g}")
      .parameter("rtt_ms", within(&StabilityCell::point, &StabilityPoint::rtt_ms), "{:g}")
      .parameter("jitter_ms", within(&StabilityCell::point, &StabilityPoint::jitter_ms), "{:g}")
      .parameter("loss_pct", within(&StabilityCell::point, &StabilityPoint::loss_pct), "{:g}")
      .parameter("burst", within(&StabilityCell::point, &StabilityPoint::burst), "{:g}")
      .parameter("seed", within(&StabilityCell::point, &StabilityPoint::seed));
  if (kind == StabilityKind::tools) table.parameter("tool", within(&StabilityCell::point, &StabilityPoint::tool));
  if (kind == StabilityKind::hands)
    table.parameter("hands", within(&StabilityCell::point, &StabilityPoint::hands))
        .parameter("apart_mm", within(&StabilityCell::point, &StabilityPoint::apart_mm), "{:g}")
        .parameter("others_rtt_ms", within(&StabilityCell::point, &StabilityPoint::others_rtt_ms), "{:g}");
  table.result("fault", &StabilityCell::fault, kLoopFaultNames)
      .result("tail_mm", &StabilityCell::tail_mm, "{:.4g}")
      .result("growth_1_s", &StabilityCell::growth_1_s, "{:.4g}")
      .result("shake_mm", &StabilityCell::shake_mm, "{:.4g}")
      .result("shake_mm_s", &StabilityCell::shake_mm_s, "{:.4g}")
      .result("generated_mj", &StabilityCell::generated_mj, "{:.4g}")
      .result("cut_ms", &StabilityCell::cut_ms, "{:.0f}")
      .result("step_max_n", &StabilityCell::step_max_n, "{:.3g}");
  return table;
}

StabilityPoint stability_point(const std::string& key, StabilityKind kind) {
  const std::string where = "--only";
  StabilityPoint p = stability_table(kind).from_key(key, where).point;
  p.scheme = available_scheme(std::string(name_of(p.scheme)));
  if (!hand_from_name(p.hand)) throw InputError(where, "'" + p.hand + "' is no hand", "free, light or firm");
  if (!(p.stiffness_n_m > 0)) throw InputError(where, fmt::format("a stiffness of {:g}", p.stiffness_n_m), "more than 0 N/m");
  if (p.rate_hz < kMinRateHz || p.rate_hz > kMaxRateHz)
    throw InputError(where, fmt::format("a rate of {:g}", p.rate_hz), "a rate that a server accepts");
  if (kind == StabilityKind::tools && p.tool != kNeedle && !find_tool(p.tool))
    throw InputError(where, "'" + p.tool + "' is no tool",
                     fmt::format("{}, or a tool of scenes/tools:\n{}", kNeedle, list_of_tools()));
  if (kind == StabilityKind::hands && (p.hands < 2 || p.hands > kMaxStations))
    throw InputError(where, fmt::format("{} hands", p.hands), fmt::format("2 to {}", kMaxStations));
  if (!(p.apart_mm >= 0 && p.apart_mm <= kApartMostMm))
    throw InputError(where, fmt::format("hands {:g} mm apart", p.apart_mm), fmt::format("0 to {:g} mm", kApartMostMm));
  if (!is_possible(p)) throw InputError(where, "no hand can do that", "a combination that docs/results/stability.md names");
  return p;
}

double cube_stiffness_n_m() {
  static const double stiffness = std::round(10 * port_stiffness_n_m(paper_cube(ContactKind::attach))) / 10;
  return stiffness;
}

StabilityReference reference_of(const StabilityPoint& point, StabilityCube cube) {
  return stability_reference(scene_of(cube, point), point);
}

CellSweep<StabilityCell> stability_sweep(const std::vector<StabilityPoint>& points, StabilityCube cube, StabilityKind kind) {
  CellSweep<StabilityCell> sweep{stability_table(kind), {}};
  for (const StabilityPoint& p : points) sweep.cells.push_back({p});
  const auto references = std::make_shared<StabilityReferences>();
  sweep.prepare = [=](const std::vector<StabilityCell>& cells, unsigned jobs) { *references = references_of(cells, cube, jobs); };
  sweep.measure = [references, table = sweep.table](StabilityCell& cell) {
    measure_point(cell, references->at(reference_key(cell.point)), table);
  };
  return sweep;
}

}  // namespace palpate
