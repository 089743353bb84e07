#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <string_view>

#include "common/base/error.hpp"
#include "common/base/limits.hpp"
#include "common/motion/motion.hpp"

namespace palpate {

namespace {

constexpr std::string_view kHeader = "t_s,x_m,y_m,z_m";
using Row = std::array<double, 4>;
constexpr std::array<std::string_view, 4> kColumns{"t_s", "x_m", "y_m", "z_m"};

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

std::string quoted(std::string_view text) {
  constexpr std::size_t kShown = 40;
  return "'" + std::string(text.substr(0, kShown)) + (text.size() > kShown ? "...'" : "'");
}

double parse_number(std::string_view text, const std::string& where, std::string_view column) {
  const std::string_view cell = trimmed(text);
  double value = 0;
  const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  if (error != std::errc{} || end != cell.data() + cell.size() || !std::isfinite(value))
    throw InputError(where, std::string(column) + " is " + quoted(cell), "a finite number");
  return value;
}

Row parse_row(std::string_view line, const std::string& where) {
  Row row{};
  std::size_t column = 0;
  for (std::string_view rest = line;; ++column) {
    const auto comma = rest.find(',');
    if (column < row.size()) row[column] = parse_number(rest.substr(0, comma), where, kColumns[column]);
    if (comma == std::string_view::npos) break;
    rest.remove_prefix(comma + 1);
  }
  if (column + 1 != row.size())
    throw InputError(where, std::to_string(column + 1) + " columns", "4 columns, " + std::string(kHeader));
  return row;
}

MotionPoint check_row(const Row& row, const std::vector<MotionPoint>& before, const std::string& where) {
  if (!(row[0] >= 0 && row[0] <= kMaxMotionS)) throw InputError(where, "t_s is " + std::to_string(row[0]), "0 to 8000 s");
  if (!before.empty() && row[0] <= before.back().t_s)
    throw InputError(where, row[0] == before.back().t_s ? "t_s is repeated" : "t_s goes back", "ascending times");
  for (std::size_t k = 1; k < row.size(); ++k)
    if (std::abs(row[k]) > kWorldExtentM)
      throw InputError(where, std::string(kColumns[k]) + " is " + std::to_string(row[k]), "a position within 10 m of the origin");
  return {row[0], Vec3(row[1], row[2], row[3])};
}

void append(std::string& text, double value, char after) {
  std::array<char, 32> digits{};
  const auto [end, error] = std::to_chars(digits.data(), digits.data() + digits.size(), value);
  text.append(digits.data(), end);
  text += after;
}

}  // namespace

Motion read_motion(std::istream& in, const std::string& name) {
  std::string line;
  if (!std::getline(in, line)) throw InputError(name + ":1", "file is empty", "header " + std::string(kHeader));
  if (trimmed(line) != kHeader) throw InputError(name + ":1", "header is " + quoted(trimmed(line)), std::string(kHeader));
  std::vector<MotionPoint> points;
  std::size_t number = 1, blank = 0;
  while (std::getline(in, line)) {
    ++number;
    const std::string where = name + ":" + std::to_string(number);
    if (trimmed(line).empty()) {
      if (blank == 0) blank = number;
      continue;
    }
    if (blank != 0) throw InputError(name + ":" + std::to_string(blank), "line is empty", "a row " + std::string(kHeader));
    if (points.size() == kMaxMotionRows) throw InputError(where, "too many rows", "at most " + std::to_string(kMaxMotionRows));
    points.push_back(check_row(parse_row(line, where), points, where));
  }
  if (points.size() < 2)
    throw InputError(name, std::to_string(points.size()) + " rows", "at least 2 rows of " + std::string(kHeader));
  return Motion(std::move(points), name);
}

Motion read_motion(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in || std::filesystem::is_directory(file)) throw InputError(file.string(), "cannot be read", "a motion file (CSV)");
  return read_motion(in, file.string());
}

void write_motion(const std::filesystem::path& file, const Motion& motion) {
  std::string text(kHeader);
  text += '\n';
  for (const MotionPoint& point : motion.points()) {
    append(text, point.t_s, ',');
    append(text, point.position.x(), ',');
    append(text, point.position.y(), ',');
    append(text, point.position.z(), '\n');
  }
  std::ofstream out(file, std::ios::binary);
  out << text;
  out.flush();
  if (!out) throw InputError(file.string(), "cannot be written", "a path that can be written");
}

}  // namespace palpate
