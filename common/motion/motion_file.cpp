#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <limits>
#include <sstream>
#include <string_view>

#include "common/base/counted.hpp"
#include "common/base/error.hpp"
#include "common/base/in_quotes.hpp"
#include "common/base/limits.hpp"
#include "common/file/read_file.hpp"
#include "common/motion/motion.hpp"

namespace palpate {

namespace {

constexpr std::string_view kHeader = "t_s,x_m,y_m,z_m", kTurnHeader = ",qx,qy,qz,qw", kButtonsHeader = ",buttons",
                           kOpeningHeader = ",opening";
constexpr std::array<std::string_view, 10> kColumns{"t_s", "x_m", "y_m", "z_m", "qx", "qy", "qz", "qw", "buttons", "opening"};
using Row = std::array<double, kColumns.size()>;
constexpr std::size_t kPlaceColumns = 4, kTurnColumns = 4, kButtonsColumn = 8, kOpeningColumn = 9;

/// The columns of a file.
struct Layout {
  bool turns = false, buttons = false, openings = false;

  std::size_t columns() const { return kPlaceColumns + (turns ? kTurnColumns : 0) + (buttons ? 1 : 0) + (openings ? 1 : 0); }
  /// Index of the k-th column in a Row.
  std::size_t place(std::size_t k) const {
    if (k >= kPlaceColumns && !turns) k += kTurnColumns;
    return k >= kButtonsColumn && !buttons ? k + 1 : k;
  }
  std::string header() const {
    return std::string(kHeader) + std::string(turns ? kTurnHeader : "") + std::string(buttons ? kButtonsHeader : "") +
           std::string(openings ? kOpeningHeader : "");
  }
};

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

double parse_number(std::string_view text, const std::string& where, std::string_view column) {
  const std::string_view cell = trimmed(text);
  double value = 0;
  const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  if (error != std::errc{} || end != cell.data() + cell.size() || !std::isfinite(value))
    throw InputError(where, std::string(column) + " is " + in_quotes(cell, '\''), "a finite number");
  return value;
}

Row parse_row(std::string_view line, const Layout& layout, const std::string& where) {
  Row row{};
  std::size_t column = 0;
  for (std::string_view rest = line;; ++column) {
    const auto comma = rest.find(',');
    if (column < layout.columns()) {
      const std::size_t place = layout.place(column);
      row[place] = parse_number(rest.substr(0, comma), where, kColumns[place]);
    }
    if (comma == std::string_view::npos) break;
    rest.remove_prefix(comma + 1);
  }
  if (column + 1 != layout.columns())
    throw InputError(where, std::to_string(column + 1) + " columns",
                     std::to_string(layout.columns()) + " columns, " + layout.header());
  return row;
}

MotionPoint check_row(const Row& row, const std::vector<MotionPoint>& before, const std::string& where) {
  if (!(row[0] >= 0 && row[0] <= kMaxMotionS)) throw InputError(where, "t_s is " + std::to_string(row[0]), "0 to 8000 s");
  if (!before.empty() && row[0] <= before.back().t_s)
    throw InputError(where, row[0] == before.back().t_s ? "t_s is repeated" : "t_s goes back", "ascending times");
  for (std::size_t k = 1; k < kPlaceColumns; ++k)
    if (std::abs(row[k]) > kWorldExtentM)
      throw InputError(where, std::string(kColumns[k]) + " is " + std::to_string(row[k]), "a position within 10 m of the origin");
  return {row[0], Vec3(row[1], row[2], row[3])};
}

void add_hold(const Row& row, const Layout& layout, MotionHolds& holds, const std::string& where) {
  if (layout.turns) {
    const Eigen::Quaterniond turn(row[7], row[4], row[5], row[6]);
    if (!is_unit(turn))
      throw InputError(where, "qx,qy,qz,qw have the length " + std::to_string(turn.norm()), "a quaternion of length 1");
    holds.orientations.push_back(turn);
  }
  if (layout.openings) {
    const double opening = row[kOpeningColumn];
    if (!(opening >= 0 && opening <= 1)) throw InputError(where, "opening is " + std::to_string(opening), "0 to 1");
    holds.openings.push_back(opening);
  }
  if (!layout.buttons) return;
  const double pressed = row[kButtonsColumn];
  if (!(pressed >= 0 && pressed <= std::numeric_limits<std::uint32_t>::max()) || pressed != std::floor(pressed))
    throw InputError(where, "buttons is " + std::to_string(pressed), "a whole number, bit n for button n");
  holds.buttons.push_back(static_cast<std::uint32_t>(pressed));
}

Layout layout_of(std::string_view header, const std::string& where) {
  for (unsigned which = 0; which < 8; ++which)
    if (const Layout layout{(which & 1) != 0, (which & 2) != 0, (which & 4) != 0}; header == layout.header()) return layout;
  throw InputError(where, "header is " + in_quotes(header, '\''), std::string(kHeader) + "[,qx,qy,qz,qw][,buttons][,opening]");
}

void append(std::string& text, double value) {
  std::array<char, 32> digits{};
  const auto [end, error] = std::to_chars(digits.data(), digits.data() + digits.size(), value);
  text.append(digits.data(), end);
}

}  // namespace

Motion read_motion(std::istream& in, const std::string& name) {
  std::string line;
  if (!std::getline(in, line)) throw InputError(name + ":1", "file is empty", "header " + std::string(kHeader));
  const Layout layout = layout_of(trimmed(line), name + ":1");
  std::vector<MotionPoint> points;
  MotionHolds holds;
  std::size_t number = 1, blank = 0;
  while (std::getline(in, line)) {
    ++number;
    const std::string where = name + ":" + std::to_string(number);
    if (trimmed(line).empty()) {
      if (blank == 0) blank = number;
      continue;
    }
    if (blank != 0) throw InputError(name + ":" + std::to_string(blank), "line is empty", "a row " + layout.header());
    if (points.size() == kMaxMotionRows) throw InputError(where, "too many rows", "at most " + std::to_string(kMaxMotionRows));
    const Row row = parse_row(line, layout, where);
    points.push_back(check_row(row, points, where));
    add_hold(row, layout, holds, where);
  }
  if (points.size() < 2) throw InputError(name, counted(points.size(), "row"), "at least 2 rows of " + layout.header());
  return Motion(std::move(points), std::move(holds), name);
}

Motion read_motion(const std::filesystem::path& file) {
  constexpr std::size_t kMaxMotionBytes = std::size_t{2} << 30;  // kMaxMotionRows of more digits than doubles have
  std::istringstream in(without_mark(read_file(file, file.string(), "a motion file (CSV)", kMaxMotionBytes)));
  return read_motion(in, file.string());
}

void write_motion(const std::filesystem::path& file, const Motion& motion) {
  const MotionHolds& holds = motion.holds();
  const Layout layout{!holds.orientations.empty(), !holds.buttons.empty(), !holds.openings.empty()};
  std::string text = layout.header();
  for (std::size_t i = 0; i < motion.points().size(); ++i) {
    const MotionPoint& point = motion.points()[i];
    text += '\n';
    append(text, point.t_s);
    for (const double x : point.position) append(text += ',', x);
    if (layout.turns)
      for (const double q : holds.orientations[i].coeffs()) append(text += ',', q);
    if (layout.buttons) text += ',' + std::to_string(holds.buttons[i]);
    if (layout.openings) append(text += ',', holds.openings[i]);
  }
  text += '\n';
  std::ofstream out(file, std::ios::binary);
  out << text;
  out.flush();
  if (!out) throw InputError(file.string(), "cannot be written", "a path that can be written");
}

}  // namespace palpate
