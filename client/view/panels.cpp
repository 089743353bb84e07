#include "client/view/panels.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <sstream>

#include "client/view/foresight.hpp"
#include "client/view/pen.hpp"
#include "client/view/round_125.hpp"
#include "client/view/sight.hpp"

namespace palpate {
namespace {

constexpr float kWidth = 404, kMargin = 24, kPad = 14, kRow = 19, kUnits = 14, kPlot = 74, kLeastPicture = 860;
constexpr std::size_t kMostRows = 8;

/// Writes downwards inside the column.
struct Column {
  const Pen& pen;
  const PanelFigures& figures;
  float left, right, y;

  float at(float units) const { return units * pen.scale; }
  Vec3f color(const std::string& station) const {
    const auto& tools = figures.stations;
    const auto place = std::find(tools.begin(), tools.end(), station);
    std::size_t index = static_cast<std::size_t>(place - tools.begin());
    if (place != tools.end()) return station_color(index);
    // Stations without a visible tool, such as those that only compute, get the colours after those of the tools.
    for (const StationView& other : figures.room->stations) {
      if (other.station == station) break;
      index += std::find(tools.begin(), tools.end(), other.station) == tools.end();
    }
    return station_color(index);
  }
  void box(float height) const {
    pen.list.AddRectFilled({left, y}, {right, y + at(height)}, packed(pen.theme.background_bottom, 0.72F), at(7));
    pen.list.AddRect({left, y}, {right, y + at(height)}, packed(pen.theme.ink_soft, 0.18F), at(7), 0, at(1));
  }
};

struct Field {
  const char *head, *unit;
  float right;  ///< edge of the text, from the column's left
};
constexpr std::size_t kFieldCount = 7;
constexpr std::array<Field, kFieldCount> kFields{{{"RTT", "ms", 140},
                                                  {"jitter", "ms", 184},
                                                  {"loss", "%", 224},
                                                  {"age", "ms", 262},
                                                  {"scheme", "", 314},
                                                  {"states", "", 356},
                                                  {"late", "ticks", 390}}};

std::array<std::string, kFieldCount> values(const StationView& s, const PanelFigures& figures) {
  if (!figures.holds) return {"-", "-", "-", "-", "-", "-", "-"};
  const double loss_pct = s.judged > 0 ? 100.0 * s.lost / s.judged : 0;
  const auto ms = [](Micros t) {
    const double value = 1e3 * seconds(t);
    return t.count() <= 0 ? std::string("-") : value < 9.95 ? fmt::format("{:.1f}", value) : fmt::format("{:.0f}", value);
  };
  return {ms(s.rtt),
          ms(s.jitter),
          s.judged > 0 ? fmt::format("{:.1f}", loss_pct) : "-",
          ms(s.patch_age),
          std::string(name_of(s.in_use.scheme)),
          s.states > 0 ? fmt::format("{}", s.states) : "-",
          figures.late_known ? fmt::format("{}", s.ticks_late) : "-"};
}

/// Returns the reason where the server chose the scheme, in the lines that it takes under the station's.
std::vector<std::string> choice_lines(const StationView& s, const Column& c) {
  std::vector<std::string> lines;
  if (!c.figures.holds || s.in_use.reason <= SchemeReason::asked) return lines;
  const float widest = c.right - c.left - c.at(2 * kPad + 14);
  std::istringstream words(describe(s.in_use));
  for (std::string word; words >> word;) {
    if (lines.empty() || c.pen.measure(12, lines.back() + " " + word) > widest)
      lines.push_back(word);
    else
      lines.back() += " " + word;
  }
  return lines;
}

void draw_stations(Column& c) {
  const auto& stations = c.figures.room->stations;
  const std::size_t rows = std::min(stations.size(), kMostRows);
  std::size_t lines = 1 + std::max<std::size_t>(rows, 1);
  std::vector<std::vector<std::string>> choices;
  for (std::size_t i = 0; i < rows; ++i) lines += choices.emplace_back(choice_lines(stations[i], c)).size();
  const float height = kPad + kUnits + kRow * static_cast<float>(lines) + 6;
  c.box(height);
  float y = c.y + c.at(9);
  c.pen.text(c.left + c.at(kPad), y, 12, c.pen.theme.ink_soft, "station");
  for (const Field& field : kFields) {
    c.pen.text_left_of(c.left + c.at(field.right), y, 12, c.pen.theme.ink_soft, field.head);
    c.pen.text_left_of(c.left + c.at(field.right), y + c.at(kUnits), 11, c.pen.theme.ink_soft, field.unit);
  }
  y += c.at(kRow + kUnits);
  if (rows == 0) c.pen.text(c.left + c.at(kPad), y, 13, c.pen.theme.ink_soft, "nobody touches the body");
  for (std::size_t i = 0; i < rows; ++i, y += c.at(kRow)) {
    const StationView& s = stations[i];
    c.pen.list.AddCircleFilled({c.left + c.at(kPad + 4), y + c.at(8)}, c.at(4), packed(c.color(s.station)), 20);
    std::string name = s.station;
    while (name.size() > 3 && c.pen.measure(13, name) > c.at(84)) name = name.substr(0, name.size() - 2) + ".";
    c.pen.text(c.left + c.at(kPad + 14), y, 13, c.pen.theme.ink, name);
    const auto words = values(s, c.figures);
    for (std::size_t k = 0; k < kFields.size(); ++k)
      c.pen.text_left_of(c.left + c.at(kFields[k].right), y, 13, c.pen.theme.ink, words[k]);
    for (const std::string& line : choices[i]) {
      y += c.at(kRow);
      c.pen.text(c.left + c.at(kPad + 14), y, 12, c.pen.theme.ink_soft, line);
    }
  }
  c.y += c.at(height + 10);
}

void draw_plot(Column& c, const History& history, const char* title, float least, const char* unit) {
  const float height = kPlot + 34;
  c.box(height);
  const float most = round_up_125(history.largest(least) * 1.02F);
  const float x0 = c.left + c.at(kPad), x1 = c.right - c.at(kPad), y0 = c.y + c.at(27), y1 = y0 + c.at(kPlot - 4);
  c.pen.text(x0, c.y + c.at(7), 12, c.pen.theme.ink, title);
  c.pen.text_left_of(x1, c.y + c.at(7), 12, c.pen.theme.ink_soft,
                     fmt::format("{:g} {}, {} s", most, unit, History::kSpan / Micros{1'000'000}));
  for (int k = 0; k <= 2; ++k) {
    const float y = y1 + (y0 - y1) * 0.5F * static_cast<float>(k);
    c.pen.list.AddLine({x0, y}, {x1, y}, packed(c.pen.theme.ink_soft, k == 0 ? 0.5F : 0.16F), c.at(1));
  }
  for (const History::Series& series : history.series()) {
    std::vector<ImVec2> line;
    for (const History::Point& p : series.points) {
      const double age = seconds(c.figures.now - p.at) / seconds(History::kSpan);
      line.push_back({x1 - static_cast<float>(age) * (x1 - x0), y1 + (y0 - y1) * std::clamp(p.value / most, 0.0F, 1.0F)});
    }
    c.pen.list.AddPolyline(line.data(), static_cast<int>(line.size()), packed(c.color(series.station)), 0, c.at(1.7F));
  }
  c.y += c.at(height + 10);
}

struct Fact {
  const char* head;
  std::string value;
  float left;
};

void draw_facts(Column& c, const std::array<Fact, 4>& facts) {
  c.box(50);
  for (const Fact& fact : facts) {
    c.pen.text(c.left + c.at(fact.left), c.y + c.at(8), 12, c.pen.theme.ink_soft, fact.head);
    c.pen.text(c.left + c.at(fact.left), c.y + c.at(25), 14, c.pen.theme.ink, fact.value);
  }
  c.y += c.at(60);
}

void draw_body(Column& c) {
  const RoomView& room = *c.figures.room;
  const bool known = c.figures.holds && room.rate_hz > 0;
  const auto figure = [known](const std::string& words) { return known ? words : std::string("-"); };
  const bool asleep = c.figures.holds && room.asleep;
  draw_facts(c, {{{"nodes", fmt::format("{}", room.nodes), kPad},
                  {"frames, last second", asleep ? "asleep" : figure(fmt::format("{:.0f}", room.rate_hz)), 70},
                  {"each took", figure(fmt::format("{:.1f} ms", 1e3 * seconds(room.frame_time))), 206},
                  {"real-time factor", figure(fmt::format("{:.1f}", room.real_time_factor)), 290}}});
}

/// Draws the names of the bodies, where there are several, and of the rigid parts, in rows.
void draw_names(Column& c) {
  std::vector<BodyName> names = c.figures.room->bodies;
  for (const PartMesh& part : c.figures.parts) names.push_back({part.name, part.colour});
  if (names.empty()) return;
  std::vector<ImVec2> places;
  float x = c.left + c.at(kPad), y = c.y + c.at(9);
  for (const BodyName& one : names) {
    const float width = c.at(28) + c.pen.measure(13, one.name);
    if (x > c.left + c.at(kPad) && x + width > c.right) x = c.left + c.at(kPad), y += c.at(kRow);
    places.push_back({x, y});
    x += width;
  }
  const float height = (y - c.y) / c.pen.scale + kRow + 4;
  c.box(height);
  for (std::size_t i = 0; i < places.size(); ++i) {
    const BodyName& one = names[i];
    c.pen.list.AddCircleFilled({places[i].x + c.at(4), places[i].y + c.at(8)}, c.at(4), packed(srgb_of(one.colour)), 20);
    c.pen.text(places[i].x + c.at(14), places[i].y, 13, c.pen.theme.ink, one.name);
  }
  c.y += c.at(height + 10);
}

/// Draws the prediction of the next frame by the patch of the viewer's own hand.
void draw_foresight(Column& c) {
  const Foresight& f = *c.figures.foresight;
  const bool surface = f.compared > 0;
  const auto mm = [surface](double m) { return surface ? fmt::format("{:.3f} mm", 1e3 * m) : std::string("-"); };
  draw_facts(c, {{{"patch after", fmt::format("{:.0f} ms", 1e3 * seconds(f.at - f.stamp)), kPad},
                  {surface ? "surface off, rms" : "no surface", mm(f.miss_rms_m), 100},
                  {"at most", mm(f.miss_max_m), 212},
                  {"force off", fmt::format("{:.3f} N", (f.force - f.force_found).norm()), 300}}});
}

}  // namespace

float panels_cover(float width, float scale) { return width < kLeastPicture * scale ? 0 : (kWidth + kMargin) * scale / width; }

void draw_panels(const Pen& pen, const PanelFigures& figures) {
  if (figures.room == nullptr || figures.room->nodes == 0 || panels_cover(pen.width, pen.scale) == 0) return;
  const float right = pen.width - kMargin * pen.scale;
  Column column{pen, figures, right - kWidth * pen.scale, right, kMargin * pen.scale};
  draw_stations(column);
  draw_plot(column, *figures.forces, "force", 0.5F, "N");
  draw_plot(column, *figures.patch_ages, "patch age", 20, "ms");
  draw_body(column);
  draw_names(column);
  if (figures.foresight != nullptr) draw_foresight(column);
}

}  // namespace palpate
