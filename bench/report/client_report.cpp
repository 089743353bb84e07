#include "bench/report/client_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <sstream>

#include "bench/output/output.hpp"
#include "common/base/error.hpp"
#include "common/wire/scheme_in_use.hpp"

namespace palpate {
namespace {

std::vector<std::string> split(const std::string& line) {
  std::vector<std::string> cells;
  std::stringstream in(line);
  for (std::string cell; std::getline(in, cell, ',');) cells.push_back(cell);
  return cells;
}

/// Reads what was requested from summary.json; leaves `report` unchanged if there is no such file.
void read_summary(const std::filesystem::path& file, ClientReport& report) {
  std::ifstream in(file);
  const Json summary = Json::parse(in, nullptr, false);
  if (!summary.is_object()) return;
  const Json run = summary.value("run", Json::object());
  report.scheme = run.value("scheme", "");
  report.chosen_by_server = run.value("scheme_asked", report.scheme) == kAutoName;
  const Json scene = run.value("scene", Json::object());
  report.scene = scene.value("name", "");
  report.mesh = scene.value("mesh", "");
  report.scene_hash = scene.value("hash", "");
  report.tool = run.value("tool", "");
  report.order = run.value("order", 0);
  report.rate_hz = run.value("rate_hz", 0.0);
}

/// Name of the felt display, distinct from those of comparisons.
std::string felt_display(const std::string& name, const std::vector<std::string>& compared) {
  return std::find(compared.begin(), compared.end(), name) == compared.end() ? name : name + ", felt";
}

}  // namespace

ClientReport read_client_report(const std::filesystem::path& folder, const std::string& felt_name) {
  const std::filesystem::path file = folder / "forces.csv";
  std::ifstream in(file);
  std::string line;
  if (!std::getline(in, line)) throw InputError(file.string(), "cannot be read", "forces.csv of palpate-client --report");
  const auto header = split(line);
  constexpr std::size_t kFirst = 9, kEach = 4, kTurn = 4, kTorque = 3;
  const auto turned_at = static_cast<std::size_t>(std::find(header.begin(), header.end(), "qx") - header.begin());
  const bool turned = turned_at < header.size(), opened = turned && header.back() == "grip_nm";
  constexpr std::size_t kJaws = 2;
  const bool whole = turned_at >= kFirst && (turned_at - kFirst) % kEach == 0;
  const std::size_t displays = whole ? 1 + (turned_at - kFirst) / kEach : 0;
  if (!whole || header[0] != "t_s" || (turned && header.size() != turned_at + kTurn + kTorque * displays + (opened ? kJaws : 0)))
    throw InputError(file.string() + ":1", "has another header", "t_s,x_m,y_m,z_m,fx_n,fy_n,fz_n,patch_age_ms,contact,...");
  ClientReport r;
  std::vector<std::string> compared;
  for (std::size_t c = kFirst; c < turned_at; c += kEach) compared.emplace_back(header[c].substr(0, header[c].rfind("_fx_n")));
  read_summary(folder / "summary.json", r);
  const std::string scheme = r.scheme + (r.chosen_by_server ? " (auto)" : "");
  const std::string felt = !felt_name.empty() ? felt_name : !scheme.empty() ? scheme : "felt";
  r.displays.push_back({felt_display(felt, compared), {}, {}, {}});
  for (const std::string& name : compared) r.displays.push_back({name, {}, {}, {}});

  std::vector<double> last;
  for (std::size_t number = 2; std::getline(in, line); ++number) {
    std::vector<double> row;
    for (const std::string& cell : split(line)) {
      char* end = nullptr;
      row.push_back(std::strtod(cell.c_str(), &end));
      if (end == cell.c_str())
        throw InputError(fmt::format("{}:{}", file.string(), number), "'" + cell + "' is no number", "a number");
    }
    if (row.size() != header.size())
      throw InputError(fmt::format("{}:{}", file.string(), number), "has another number of columns",
                       std::to_string(header.size()));
    const auto tick = static_cast<std::size_t>(std::max(0.0, std::round(row[0] * 1e3)));
    const std::size_t from = r.positions.size();
    for (std::size_t i = from; i <= tick; ++i) {
      const double part =
          last.empty() || tick == i ? 1.0 : static_cast<double>(i + 1 - from) / static_cast<double>(tick + 1 - from);
      const auto value = [&](std::size_t c) { return last.empty() ? row[c] : last[c] + part * (row[c] - last[c]); };
      r.positions.emplace_back(value(1), value(2), value(3));
      r.patch_age_ms.push_back(row[7]);
      for (std::size_t d = 0; d < r.displays.size(); ++d) {
        const std::size_t c = d == 0 ? 4 : kFirst + (d - 1) * kEach;
        r.displays[d].force.emplace_back(value(c), value(c + 1), value(c + 2));
        r.displays[d].contact.push_back(row[d == 0 ? 8 : c + 3] > 0.5);
        const std::size_t t = turned_at + kTurn + kTorque * d;
        if (turned) r.displays[d].torque.emplace_back(value(t), value(t + 1), value(t + 2));
      }
      if (opened) r.openings.push_back(value(header.size() - kJaws));
      // Within the small angle of a skipped tick the mean of two quaternions, made of unit length, lies between them evenly.
      if (turned)
        r.turns.push_back(
            Rotation(value(turned_at + 3), value(turned_at), value(turned_at + 1), value(turned_at + 2)).normalized());
    }
    last = row;
  }
  if (r.positions.size() <= 1000) throw InputError(file.string(), "is too short", "more than a second of ticks");
  return r;
}

}  // namespace palpate
