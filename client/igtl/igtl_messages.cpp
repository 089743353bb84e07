#include "client/igtl/igtl_messages.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>

#include "common/base/error.hpp"

namespace palpate {

namespace {

constexpr std::size_t kTypeBytes = 12, kNameBytes = 20, kHeaderBytes = 58;
constexpr std::uint16_t kVersion = 1,
                        kVersionMost = 3;  // of the header: 1 in the protocol's version 2, 3 with an extended header
constexpr std::uint64_t kPolynomial = 0x42f0e1eba9ea3693;
// Unit of SENSOR: prefix (4 bits), then pairs of unit (6 bits) and exponent (4 bits), from the top. Newton is 11.
constexpr std::uint64_t kNewton = std::uint64_t{11} << 54 | std::uint64_t{1} << 50;
constexpr std::size_t kCounts = 10;
constexpr std::uint8_t kPointScalar = 0;
constexpr std::size_t kTrianglesMost = 2'000'000;
constexpr const char* kWhat = "OpenIGTLink";

std::array<std::uint64_t, 256> make_crc_table() {
  std::array<std::uint64_t, 256> table{};
  for (std::uint64_t byte = 0; byte < table.size(); ++byte) {
    std::uint64_t rest = byte << 56;
    for (int bit = 0; bit < 8; ++bit) rest = rest >> 63 ? rest << 1 ^ kPolynomial : rest << 1;
    table[byte] = rest;
  }
  return table;
}

template <class Number>
void append_number(std::string& out, Number number) {
  for (int shift = 8 * static_cast<int>(sizeof number) - 8; shift >= 0; shift -= 8)
    out += static_cast<char>(static_cast<std::uint64_t>(number) >> shift & 0xff);
}
void append_float(std::string& out, double number) {
  append_number(out, std::bit_cast<std::uint32_t>(static_cast<float>(number)));
}

void append_text(std::string& out, std::string_view text, std::size_t bytes) {
  const std::size_t size = std::min(text.size(), bytes);
  out += text.substr(0, size);
  out.append(bytes - size, '\0');
}

std::string message(std::string_view type, std::string_view name, std::uint64_t stamp, const std::string& body) {
  std::string out;
  out.reserve(kHeaderBytes + body.size());
  append_number(out, kVersion);
  append_text(out, type, kTypeBytes);
  append_text(out, name, kNameBytes);
  append_number(out, stamp);
  append_number(out, std::uint64_t{body.size()});
  append_number(out, igtl_crc(body));
  return out + body;
}

/// Reads numbers from the front of bytes.
class Reading {
 public:
  explicit Reading(std::string_view bytes) : rest_(bytes) {}
  template <class Number>
  Number number() {
    std::uint64_t value = 0;
    for (const char byte : text(sizeof(Number))) value = value << 8 | static_cast<unsigned char>(byte);
    return static_cast<Number>(value);
  }
  float single() { return std::bit_cast<float>(number<std::uint32_t>()); }
  std::string_view text(std::size_t bytes) {
    if (bytes > rest_.size()) throw InputError(kWhat, "a POLYDATA is cut off", "as many bytes as its counts say");
    const std::string_view front = rest_.substr(0, bytes);
    rest_.remove_prefix(bytes);
    return front;
  }
  std::size_t left() const { return rest_.size(); }

 private:
  std::string_view rest_;
};

std::string without_zeros(std::string_view text) { return std::string(text.substr(0, text.find('\0'))); }

/// Cells of a POLYDATA: calls `use` with the indices of each.
template <class Use>
void read_cells(std::string_view bytes, std::uint32_t count, std::size_t points, Use use) {
  Reading cells(bytes);
  std::vector<std::uint32_t> cell;
  for (std::uint32_t k = 0; k < count; ++k) {
    const auto corners = cells.number<std::uint32_t>();
    if (corners > cells.left() / 4) throw InputError(kWhat, "a cell of a POLYDATA is cut off", "as many points as it says");
    cell.clear();
    for (std::uint32_t c = 0; c < corners; ++c) cell.push_back(cells.number<std::uint32_t>());
    if (std::any_of(cell.begin(), cell.end(), [&](std::uint32_t point) { return point >= points; }))
      throw InputError(kWhat, "a cell of a POLYDATA names a point that is not there", std::to_string(points) + " points");
    use(cell);
  }
}

/// Lets equal points be one, drops triangles without an area, and those of points that nothing uses.
IgtlSurface welded(const std::vector<Vec3f>& points, const std::vector<Triangle>& triangles) {
  IgtlSurface surface;
  std::map<std::array<float, 3>, std::uint32_t> known;
  const auto point_of = [&](std::uint32_t given) {
    const Vec3f& p = points[given];
    const auto [at, fresh] = known.try_emplace({p.x(), p.y(), p.z()}, static_cast<std::uint32_t>(surface.points_mm.size()));
    if (fresh) surface.points_mm.push_back(p);
    return at->second;
  };
  for (const Triangle& t : triangles) {
    const Triangle welded_one{point_of(t[0]), point_of(t[1]), point_of(t[2])};
    const auto& [a, b, c] = welded_one;
    if (a != b && b != c && c != a) surface.triangles.push_back(welded_one);
  }
  return surface;
}

}  // namespace

std::uint64_t igtl_crc(std::string_view bytes) {
  static const std::array<std::uint64_t, 256> table = make_crc_table();
  std::uint64_t crc = 0;
  for (const char byte : bytes) crc = crc << 8 ^ table[crc >> 56 ^ static_cast<unsigned char>(byte)];
  return crc;
}

std::string igtl_transform(std::string_view name, const Mat3& rotation, const Vec3& position_mm, std::uint64_t stamp) {
  std::string body;
  for (Eigen::Index column = 0; column < 3; ++column)
    for (Eigen::Index row = 0; row < 3; ++row) append_float(body, rotation(row, column));
  for (const double coordinate : position_mm) append_float(body, coordinate);
  return message("TRANSFORM", name, stamp, body);
}

std::string igtl_force(std::string_view name, const Vec3& force_n, std::uint64_t stamp) {
  std::string body;
  append_number(body, std::uint8_t{3});
  append_number(body, std::uint8_t{0});
  append_number(body, kNewton);
  for (const double component : force_n) append_number(body, std::bit_cast<std::uint64_t>(component));
  return message("SENSOR", name, stamp, body);
}

std::string igtl_polydata(std::string_view name, std::span<const Vec3f> points_mm, std::span<const Triangle> triangles,
                          std::string_view scalar_name, std::span<const float> scalars, std::uint64_t stamp) {
  std::string body;
  const auto count = [&](std::size_t number) { append_number(body, static_cast<std::uint32_t>(number)); };
  body.reserve(64 + 16 * points_mm.size() + 16 * triangles.size());
  count(points_mm.size());
  for (int none = 0; none < 4; ++none) count(0);  // vertices, lines
  count(triangles.size());
  count(16 * triangles.size());
  for (int none = 0; none < 2; ++none) count(0);  // strips
  count(1);
  for (const Vec3f& point : points_mm)
    for (const float coordinate : point) append_float(body, coordinate);
  for (const Triangle& triangle : triangles) {
    count(3);
    for (const std::uint32_t corner : triangle) count(corner);
  }
  append_number(body, kPointScalar);
  append_number(body, std::uint8_t{1});
  count(scalars.size());
  body += scalar_name;
  body.append(scalar_name.size() % 2 == 0 ? 2 : 1, '\0');  // its end, and to an even number of bytes
  for (const float scalar : scalars) append_float(body, scalar);
  return message("POLYDATA", name, stamp, body);
}

std::optional<IgtlMessage> IgtlReader::next() {
  if (bytes_.size() < kHeaderBytes) return std::nullopt;
  Reading header(std::string_view(bytes_).substr(0, kHeaderBytes));
  const auto version = header.number<std::uint16_t>();
  IgtlMessage found;
  found.type = without_zeros(header.text(kTypeBytes));
  found.name = without_zeros(header.text(kNameBytes));
  header.number<std::uint64_t>();
  const auto size = header.number<std::uint64_t>(), crc = header.number<std::uint64_t>();
  if (version == 0 || version > kVersionMost)
    throw InputError(kWhat, "a header of version " + std::to_string(version), "1 to " + std::to_string(kVersionMost));
  if (size > kBodyBytesMost) throw InputError(kWhat, "a message of " + std::to_string(size) + " bytes", "64 MB at most");
  if (bytes_.size() < kHeaderBytes + size) return std::nullopt;
  std::string_view body = std::string_view(bytes_).substr(kHeaderBytes, size);
  if (igtl_crc(body) != crc) throw InputError(kWhat, "a message with a wrong check sum", "the CRC-64 of its body");
  if (version == kVersionMost && found.type == "POLYDATA") {
    Reading extended(body);
    const auto extended_bytes = extended.number<std::uint16_t>(), table_bytes = extended.number<std::uint16_t>();
    const auto metadata_bytes = extended.number<std::uint32_t>();
    if (std::uint64_t{extended_bytes} + table_bytes + metadata_bytes > size)
      throw InputError(kWhat, "an extended header that is longer than its message", "one within it");
    body = body.substr(extended_bytes, size - extended_bytes - table_bytes - metadata_bytes);
  }
  if (found.type == "POLYDATA") found.content = body;
  bytes_.erase(0, kHeaderBytes + size);
  return found;
}

IgtlSurface read_igtl_surface(std::string_view content) {
  Reading reading(content);
  std::array<std::uint32_t, kCounts> counts{};
  for (std::uint32_t& count : counts) count = reading.number<std::uint32_t>();
  const auto [points, vertices, vertex_bytes, lines, line_bytes, polygons, polygon_bytes, strips, strip_bytes, attributes] =
      counts;
  if (points > reading.left() / 12) throw InputError(kWhat, "a POLYDATA is cut off", "as many bytes as its counts say");
  std::vector<Vec3f> places(points);
  for (Vec3f& place : places)
    for (float& coordinate : place) coordinate = reading.single();
  if (!std::all_of(places.begin(), places.end(), [](const Vec3f& p) { return p.allFinite(); }))
    throw InputError(kWhat, "a point of a POLYDATA is not a number", "finite coordinates");
  reading.text(vertex_bytes);
  reading.text(line_bytes);
  std::vector<Triangle> triangles;
  const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    if (triangles.size() == kTrianglesMost) throw InputError(kWhat, "a surface of too many triangles", "2,000,000 at most");
    triangles.push_back({a, b, c});
  };
  read_cells(reading.text(polygon_bytes), polygons, points, [&](const std::vector<std::uint32_t>& cell) {
    for (std::size_t k = 2; k < cell.size(); ++k) add(cell[0], cell[k - 1], cell[k]);
  });
  read_cells(reading.text(strip_bytes), strips, points, [&](const std::vector<std::uint32_t>& cell) {
    for (std::size_t k = 2; k < cell.size(); ++k)
      k % 2 == 0 ? add(cell[k - 2], cell[k - 1], cell[k]) : add(cell[k - 1], cell[k - 2], cell[k]);
  });
  IgtlSurface surface = welded(places, triangles);
  if (surface.triangles.empty()) throw InputError(kWhat, "a POLYDATA without triangles", "the closed surface of a segment");
  if (!is_closed(surface.triangles))
    throw InputError(kWhat, "the surface has holes or edges with more than two triangles", "the closed surface of a segment");
  return surface;
}

}  // namespace palpate
