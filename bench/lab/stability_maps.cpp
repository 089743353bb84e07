#include "bench/lab/stability_maps.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <iterator>

#include "bench/lab/link_flags.hpp"
#include "bench/output/output.hpp"
#include "bench/output/plot.hpp"

namespace palpate {
namespace {

using StabilityMapsCells = std::vector<StabilityCell>;
using Place = std::function<std::string(const StabilityPoint&)>;  ///< name on the y axis, empty: not in this map

struct Map {
  std::string name, title;
  std::vector<std::string> rows;  ///< from the bottom
  Place place;
};

/// Returns true if `p` equals the map's base once the round trip and the map's own axis are reset.
bool through_base(StabilityPoint p, ContactKind contact, const std::function<void(StabilityPoint&)>& set_back) {
  set_back(p);
  StabilityPoint base = map_base(contact, cube_stiffness_n_m());
  base.scheme = p.scheme;
  base.seed = p.seed;
  base.rtt_ms = p.rtt_ms;
  return p == base;
}

Map number_map(ContactKind contact, const std::string& name, const std::string& title, double StabilityPoint::*axis,
               const std::vector<double>& values) {
  Map map{name, title, {}, {}};
  for (const double v : values) map.rows.push_back(fmt::format("{:g}", v));
  map.place = [contact, axis](const StabilityPoint& p) {
    const bool here =
        through_base(p, contact, [&](StabilityPoint& q) { q.*axis = map_base(contact, cube_stiffness_n_m()).*axis; });
    return here ? fmt::format("{:g}", p.*axis) : std::string();
  };
  return map;
}

Map loss_map(ContactKind contact) {
  Map map{
      "loss", "datagrams lost each way [%], singly or in runs of 4", {"0", "5", "15", "30", "5 runs", "15 runs", "30 runs"}, {}};
  map.place = [contact](const StabilityPoint& p) {
    const bool here = through_base(p, contact, [](StabilityPoint& q) { q.loss_pct = q.burst = 0; });
    return here ? fmt::format("{:g}{}", p.loss_pct, p.burst > 0 ? " runs" : "") : std::string();
  };
  return map;
}

Map hand_map(ContactKind contact) {
  Map map{"hand", "hand and gesture", {}, {}};
  for (const char* hand : {"free", "light", "firm"})
    for (const std::string_view gesture : kGestureNames) {
      StabilityPoint p;
      p.contact = contact;
      p.hand = hand;
      p.gesture = *gesture_from_name(gesture);
      if (is_possible(p)) map.rows.push_back(fmt::format("{} {}", hand, gesture));
    }
  map.place = [contact](const StabilityPoint& p) {
    const bool here = p.contact == contact && through_base(p, contact, [&](StabilityPoint& q) {
                        q.hand = map_base(contact, cube_stiffness_n_m()).hand;
                        q.gesture = map_base(contact, cube_stiffness_n_m()).gesture;
                      });
    return here ? fmt::format("{} {}", p.hand, name_of(p.gesture)) : std::string();
  };
  return map;
}

template <class Value>
std::size_t index_in(const std::vector<Value>& list, const Value& value) {
  return static_cast<std::size_t>(std::find(list.begin(), list.end(), value) - list.begin());
}

std::string tics(const std::vector<std::string>& names) {
  std::string s;
  for (std::size_t k = 0; k < names.size(); ++k) s += fmt::format("{}{} {}", k > 0 ? ", " : "", quoted(names[k]), k);
  return s;
}

struct Table {
  std::vector<Scheme> schemes;
  std::vector<std::vector<const StabilityCell*>> cells;  ///< by scheme, the map's alone
};

Table table_of(const StabilityMapsCells& cells, const Map& map) {
  Table table;
  for (const Scheme scheme : available_schemes()) {
    std::vector<const StabilityCell*> mine;
    for (const StabilityCell& c : cells)
      if (c.point.scheme == scheme && index_in(map.rows, map.place(c.point)) < map.rows.size()) mine.push_back(&c);
    if (mine.empty()) continue;
    table.schemes.push_back(scheme);
    table.cells.push_back(std::move(mine));
  }
  return table;
}

std::string mark_of(LoopFault fault) { return fault == LoopFault::none ? "" : fault == LoopFault::shakes ? "s" : "x"; }
int colour_of(LoopFault fault) {
  constexpr int kStable = 0xbfe3d6, kShakes = 0xf0b040, kUnrest = 0xd55e00, kLost = 0x8a1c00;
  return std::array{kStable, kLost, kUnrest, kShakes}[static_cast<std::size_t>(fault)];
}

/// Explains colours and marks, next to the curves of the first panel.
std::string map_legend() {
  std::string s;
  for (const auto& [fault, meaning] : {std::pair{LoopFault::none, "stable"},
                                       {LoopFault::shakes, "s: shakes while driven"},
                                       {LoopFault::unrest, "x: keeps moving when left alone"},
                                       {LoopFault::lost, "x, dark: runs away"}})
    s += fmt::format(", keyentry with boxes fs solid noborder fc rgb '#{:06x}' title {}", colour_of(fault), quoted(meaning));
  return s + ", keyentry with boxes fs solid border rgb '#888888' fc rgb '#ffffff' title 'blank: not run'";
}

void draw(const std::filesystem::path& out, const StabilityMapsCells& cells, const Map& map, ContactKind contact) {
  constexpr int kColumnsLeast = 2, kColumnsMost = 5, kPanelWidth = 225, kLetterWidth = 9, kRowHeight = 17, kAround = 130,
                kTitle = 60, kLegendLine = 18, kLegendAt = 34;
  const Table table = table_of(cells, map);
  const auto by_length = [](const std::string& a, const std::string& b) { return a.size() < b.size(); };
  const int longest = static_cast<int>(std::max_element(map.rows.begin(), map.rows.end(), by_length)->size());
  const int schemes = static_cast<int>(table.schemes.size()), columns = std::clamp(schemes, kColumnsLeast, kColumnsMost);
  std::vector<std::string> round_trips;
  for (const double rtt_ms : kStabilityRttMs) round_trips.push_back(fmt::format("{:g}", rtt_ms));
  std::string csv = "scheme,rtt_ms,row,rtt_no,row_no,fault,tail_mm,colour,mark\n", panels;
  const auto file = out / fmt::format("map-{}-{}.csv", map.name, contact == ContactKind::attach ? "grasp" : "touch");
  std::size_t rows = 0;
  for (std::size_t k = 0; k < table.schemes.size(); ++k) {
    panels += fmt::format(
        "set title {} offset 0,-0.6\nset ylabel {}\nplot {} using ($4):($5):(0.47):(0.46):8 every ::{}::{} skip 1 "
        "with boxxyerror fs solid noborder fc rgb variable notitle, {} using 4:5:9 every ::{}::{} skip 1 with labels "
        "font ',11' tc rgb '#101010' notitle{}\nunset key\n",
        quoted(std::string(name_of(table.schemes[k]))), quoted(k % kColumnsMost == 0 ? map.title : ""), quoted(file.string()),
        rows, rows + table.cells[k].size() - 1, quoted(file.string()), rows, rows + table.cells[k].size() - 1,
        k == 0 ? map_legend() : "");
    rows += table.cells[k].size();
    for (const StabilityCell* c : table.cells[k]) {
      const std::string row = map.place(c->point);
      fmt::format_to(std::back_inserter(csv), "{},{:g},{},{},{},{},{:.4g},{},{}\n", name_of(c->point.scheme), c->point.rtt_ms,
                     row, index_in(round_trips, fmt::format("{:g}", c->point.rtt_ms)), index_in(map.rows, row), name_of(c->fault),
                     c->tail_mm, colour_of(c->fault), mark_of(c->fault));
    }
  }
  if (table.schemes.empty()) return;
  write_text(file, csv);
  const int lines = (schemes + kColumnsMost - 1) / kColumnsMost;
  const int legend_lines = columns < kColumnsMost ? 3 : 2;  // as far as the width allows
  const int height = kTitle + legend_lines * kLegendLine + lines * (kAround + kRowHeight * static_cast<int>(map.rows.size()));
  std::string s = fmt::format("set multiplot layout {},{} title \"{}{}\" noenhanced font ',12'\n", lines, columns,
                              contact == ContactKind::attach ? "Grasp" : "Touch",
                              std::string(legend_lines == 2 ? "\\n \\n " : "\\n \\n \\n "));
  s += fmt::format("set key at screen 0.5, screen {:.4f} center top vertical reverse Left maxrows {} font ',11' samplen 1.5\n",
                   1 - static_cast<double>(kLegendAt) / height, legend_lines);
  s += fmt::format("unset grid\nset border 0\nset tics scale 0\nset xtics ({})\nset ytics ({})\n", tics(round_trips),
                   tics(map.rows));
  s += fmt::format("set xrange [-0.5:{}]\nset yrange [-0.5:{}]\nset xlabel 'round trip [ms]'\nset tics font ',10'\n",
                   static_cast<double>(round_trips.size()) - 0.5, static_cast<double>(map.rows.size()) - 0.5);
  plot_script(std::filesystem::path(file).replace_extension("svg"), columns * (kPanelWidth + kLetterWidth * longest), height,
              s + panels + "unset multiplot\n");
}

}  // namespace

void draw_stability_maps(const std::filesystem::path& out, const StabilityMapsCells& cells) {
  for (const ContactKind contact : {ContactKind::attach, ContactKind::touch}) {
    draw(out, cells, number_map(contact, "rate", "frames a second", &StabilityPoint::rate_hz, {10, 20, 30, 60}), contact);
    draw(out, cells,
         number_map(contact, "stiffness", "stiffness [N/m]", &StabilityPoint::stiffness_n_m,
                    stability_stiffnesses(cube_stiffness_n_m())),
         contact);
    draw(out, cells, number_map(contact, "jitter", "jitter, each way +- [ms]", &StabilityPoint::jitter_ms, {0, 10, 25, 50}),
         contact);
    draw(out, cells, loss_map(contact), contact);
    draw(out, cells, hand_map(contact), contact);
  }
}

}  // namespace palpate
