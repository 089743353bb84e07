#include "bench/lab/stability_cells.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <stdexcept>

#include "bench/lab/link_flags.hpp"
#include "bench/lab/parallel.hpp"
#include "bench/lab/shards.hpp"
#include "bench/paper/cube.hpp"
#include "common/base/error.hpp"
#include "common/base/limits.hpp"

namespace palpate {
namespace {

constexpr const char* kKeys = "scheme,contact,hand,gesture,stiffness_n_m,rate_hz,rtt_ms,jitter_ms,loss_pct,burst,seed";
constexpr const char* kMeasures = "fault,tail_mm,growth_1_s,shake_mm,shake_mm_s,generated_mj,cut_ms";
constexpr std::size_t kStabilityCellsKeyFields = 11;
constexpr double kTipRadiusM = 0.020;

const std::array<std::string_view, 2> kContacts{"grasp", "touch"};

Scene scene_of(StabilityCube cube, ContactKind contact) {
  Scene scene = cube == StabilityCube::solid ? solid_cube(contact) : paper_cube(contact);
  if (contact == ContactKind::touch) scene.tool.radius_m = kTipRadiusM;
  return scene;
}

using ReferenceKey = std::tuple<ContactKind, std::string, Gesture, double>;
ReferenceKey reference_key(const StabilityPoint& p) { return {p.contact, p.hand, p.gesture, p.stiffness_n_m}; }

StabilityResult result_of(const StabilityPoint& point, const StabilityReference& reference) {
  try {
    return measure_stability(point, reference);
  } catch (const std::runtime_error& failure) {
    throw std::runtime_error(fmt::format("{}: {}", key_of(point), failure.what()));
  }
}

void measure_cell(StabilityCell& cell, const StabilityReference& reference) {
  const StabilityResult result = result_of(cell.point, reference);
  const LoopVerdict& v = result.verdict;
  cell.fault = v.fault;
  cell.tail_mm = 1e3 * v.rest.tail_m();
  cell.growth_1_s = v.rest.growth_1_s;
  cell.shake_mm = 1e3 * v.shake.motion_m;
  cell.shake_mm_s = 1e3 * v.shake.speed_m_s;
  cell.generated_mj = 1e3 * v.generated_j;
  cell.cut_ms = 1e3 * result.cut_s;
}

StabilityPoint point_of(const std::vector<std::string>& f, const std::string& where) {
  StabilityPoint p;
  p.scheme = available_scheme(f[0]);
  p.contact = index_from(f[1], kContacts, where) == 0 ? ContactKind::attach : ContactKind::touch;
  p.hand = f[2];
  if (!hand_from_name(p.hand)) throw InputError(where, "'" + p.hand + "' is no hand", "free, light or firm");
  p.gesture = static_cast<Gesture>(index_from(f[3], kGestureNames, where));
  double* const numbers[] = {&p.stiffness_n_m, &p.rate_hz, &p.rtt_ms, &p.jitter_ms, &p.loss_pct, &p.burst};
  for (std::size_t k = 0; k < std::size(numbers); ++k) *numbers[k] = number_from(f[4 + k], where);
  p.seed = static_cast<std::uint64_t>(number_from(f[10], where));
  if (!(p.stiffness_n_m > 0)) throw InputError(where, "a stiffness of " + f[4], "more than 0 N/m");
  if (p.rate_hz < kMinRateHz || p.rate_hz > kMaxRateHz) throw InputError(where, "a rate of " + f[5], "a rate that is served");
  if (!is_possible(p)) throw InputError(where, "no hand can do that", "a combination that docs/results/stability.md names");
  return p;
}

}  // namespace

double cube_stiffness_n_m() {
  static const double stiffness = std::round(10 * port_stiffness_n_m(scene_of(StabilityCube::springs, ContactKind::attach))) / 10;
  return stiffness;
}

StabilityReference reference_of(const StabilityPoint& point, StabilityCube cube) {
  return stability_reference(scene_of(cube, point.contact), point);
}

void measure_cells(std::vector<StabilityCell>& cells, StabilityCube cube, unsigned jobs) {
  std::map<ReferenceKey, StabilityReference> references;
  std::map<ReferenceKey, const StabilityPoint*> wanted;
  for (const StabilityCell& c : cells) {
    wanted.emplace(reference_key(c.point), &c.point);
    references[reference_key(c.point)];
  }
  std::vector<std::pair<const StabilityPoint*, StabilityReference*>> list;
  for (const auto& [key, point] : wanted) list.emplace_back(point, &references[key]);
  run_all(
      list.size(), [&](std::size_t i) { *list[i].second = reference_of(*list[i].first, cube); }, jobs, "the references");
  run_all(
      cells.size(), [&](std::size_t i) { measure_cell(cells[i], references.at(reference_key(cells[i].point))); }, jobs);
}

std::string key_of(const StabilityPoint& p) {
  return fmt::format("{},{},{},{},{:g},{:g},{:g},{:g},{:g},{:g},{}", name_of(p.scheme),
                     kContacts[p.contact == ContactKind::attach ? 0 : 1], p.hand, name_of(p.gesture), p.stiffness_n_m, p.rate_hz,
                     p.rtt_ms, p.jitter_ms, p.loss_pct, p.burst, p.seed);
}

StabilityPoint point_from(const std::string& key, const std::string& where) {
  const std::vector<std::string> fields = fields_of(key);
  if (fields.size() != kStabilityCellsKeyFields) throw InputError(where, fmt::format("has {} fields", fields.size()), kKeys);
  return point_of(fields, where);
}

std::string cells_csv(const std::vector<StabilityCell>& cells) {
  std::string csv = fmt::format("{},{}\n", kKeys, kMeasures);
  for (const StabilityCell& c : cells)
    fmt::format_to(std::back_inserter(csv), "{},{},{:.4g},{:.4g},{:.4g},{:.4g},{:.4g},{:.0f}\n", key_of(c.point),
                   name_of(c.fault), c.tail_mm, c.growth_1_s, c.shake_mm, c.shake_mm_s, c.generated_mj, c.cut_ms);
  return csv;
}

std::vector<StabilityCell> read_stability_cells(const std::filesystem::path& file) {
  std::vector<StabilityCell> cells;
  for (const std::vector<std::string>& row : read_rows(file, fmt::format("{},{}", kKeys, kMeasures))) {
    const std::string where = fmt::format("{}:{}", file.string(), cells.size() + 2);
    StabilityCell c;
    c.point = point_of(row, where);
    c.fault = static_cast<LoopFault>(index_from(row[kStabilityCellsKeyFields], kLoopFaultNames, where));
    double* const numbers[] = {&c.tail_mm, &c.growth_1_s, &c.shake_mm, &c.shake_mm_s, &c.generated_mj, &c.cut_ms};
    for (std::size_t k = 0; k < std::size(numbers); ++k) *numbers[k] = number_from(row[kStabilityCellsKeyFields + 1 + k], where);
    cells.push_back(std::move(c));
  }
  return cells;
}

}  // namespace palpate
