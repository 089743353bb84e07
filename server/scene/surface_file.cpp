#include "server/scene/surface_file.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <optional>
#include <span>

#include "common/base/error.hpp"
#include "common/base/in_quotes.hpp"
#include "server/scene/words.hpp"

namespace palpate {
namespace {

constexpr std::size_t kStlHead = 84, kStlTriangle = 50, kStlNormal = 12;
constexpr double kMaxUnits = 1e12;  // largest coordinate
const std::string kTooMany = "at most " + std::to_string(kMaxTriangles);

/// Rounds a coordinate to the precision of binary STL files, so that a surface gives the same body from any file format.
double coordinate(const Words& in, double value) {
  if (std::abs(value) > kMaxUnits) in.fail("a coordinate of " + std::to_string(value), "at most 1e12");
  return static_cast<double>(static_cast<float>(value));
}

class ObjReader {
 public:
  ObjReader(std::string_view text, const std::string& where) : in_(text, where) {}

  TriangleMesh read() {
    for (std::string_view word; in_.next(word); in_.skip_line()) {
      if (word == "v") read_vertex();
      if (word == "f") read_face();
    }
    if (missing_ > static_cast<std::int64_t>(mesh_.vertices.size()))
      missing_at_->fail("a face names vertex " + std::to_string(missing_) + " of " + std::to_string(mesh_.vertices.size()),
                        "one that the file has");
    std::size_t begin = 0;
    for (const std::size_t end : ends_) {
      cut_polygon(std::span(corners_).subspan(begin, end - begin), mesh_.vertices, mesh_.triangles);
      begin = end;
    }
    return std::move(mesh_);
  }

 private:
  void read_vertex() {
    if (mesh_.vertices.size() == kMaxSurfaceVertices)
      in_.fail("too many vertices", "at most " + std::to_string(kMaxSurfaceVertices));
    Vec3 x;
    for (double& value : x) value = coordinate(in_, in_.number_in(word_of("a vertex of three numbers")));
    mesh_.vertices.push_back(x);
  }
  void read_face() {
    const std::size_t begin = corners_.size();
    for (std::string_view word; in_.next_on_line(word) && !word.starts_with('#');) {
      if (corners_.size() - begin == kMaxCorners)
        in_.fail("a face has too many corners", "at most " + std::to_string(kMaxCorners));
      corners_.push_back(vertex_named(word));
    }
    ends_.push_back(corners_.size());
    if (corners_.size() - begin < 3) in_.fail("a face of " + std::to_string(corners_.size() - begin) + " corners", "3 or more");
    if (corners_.size() - 2 * ends_.size() > kMaxTriangles) in_.fail("too many triangles", kTooMany);
  }
  /// A vertex counted from the first one may follow its face.
  std::uint32_t vertex_named(std::string_view word) {
    const std::string_view number = word.substr(0, word.find('/'));
    std::int64_t named = 0;
    const auto [end, fault] = std::from_chars(number.data(), number.data() + number.size(), named);
    if (fault != std::errc{} || end != number.data() + number.size()) in_.fail(in_quotes(word), "the number of a vertex");
    const auto there = static_cast<std::int64_t>(mesh_.vertices.size());
    const std::int64_t index = named < 0 ? there + named : named - 1;
    if (index < 0 || index >= static_cast<std::int64_t>(kMaxSurfaceVertices))
      in_.fail("a face names vertex " + std::to_string(named) + " of " + std::to_string(there), "one that the file has");
    if (index >= there && named > missing_) missing_ = named, missing_at_ = in_;
    return static_cast<std::uint32_t>(index);
  }
  std::string_view word_of(const char* expected) {
    std::string_view word;
    if (!in_.next_on_line(word)) in_.fail("the line ends too early", expected);
    return word;
  }

  Words in_;
  TriangleMesh mesh_;
  std::vector<std::uint32_t> corners_;  ///< of all faces
  std::vector<std::size_t> ends_;       ///< of each face in them
  std::int64_t missing_ = 0;            ///< largest vertex that a face before it names, and where
  std::optional<Words> missing_at_;
};

void add_triangle(TriangleMesh& mesh) {
  const auto n = static_cast<std::uint32_t>(mesh.vertices.size());
  mesh.triangles.push_back({n - 3, n - 2, n - 1});
}

TriangleMesh read_text_stl(std::string_view text, const std::string& where) {
  Words in(text, where);
  TriangleMesh mesh;
  std::size_t corners = 0;
  for (std::string_view given; in.next(given);) {
    std::string word(given.substr(0, 16));
    std::transform(word.begin(), word.end(), word.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    if (word == "vertex") {
      const double x = coordinate(in, in.number()), y = coordinate(in, in.number()), z = coordinate(in, in.number());
      mesh.vertices.emplace_back(x, y, z);
      ++corners;
    } else if (word == "endloop") {
      if (corners != 3) in.fail("a facet of " + std::to_string(corners) + " corners", "3");
      if (mesh.triangles.size() == kMaxTriangles) in.fail("too many triangles", kTooMany);
      add_triangle(mesh);
      corners = 0;
    } else if (word == "solid" || word == "endsolid" || word == "facet" || word == "outer") {
      in.skip_line();
    } else if (word != "endfacet") {
      in.fail(in_quotes(given), "facet, vertex or endsolid");
    }
    if (corners > 3) in.fail("a facet of more than 3 corners", "3");
  }
  if (corners > 0) in.fail("ends too early", "the rest of a facet");
  return mesh;
}

TriangleMesh read_binary_stl(std::string_view bytes, std::size_t triangles, const std::string& where) {
  TriangleMesh mesh;
  mesh.vertices.reserve(3 * triangles);
  mesh.triangles.reserve(triangles);
  for (std::size_t t = 0; t < triangles; ++t) {
    const char* at = bytes.data() + kStlHead + t * kStlTriangle + kStlNormal;
    for (int corner = 0; corner < 3; ++corner, at += 3 * sizeof(float)) {
      std::array<float, 3> x;
      std::memcpy(x.data(), at, sizeof x);
      mesh.vertices.emplace_back(static_cast<double>(x[0]), static_cast<double>(x[1]), static_cast<double>(x[2]));
      const Vec3& vertex = mesh.vertices.back();
      if (!vertex.allFinite() || vertex.cwiseAbs().maxCoeff() > kMaxUnits)
        throw InputError(where, "triangle " + std::to_string(t) + " has a corner that is nowhere", "coordinates up to 1e12");
    }
    add_triangle(mesh);
  }
  return mesh;
}

/// Returns true if the file begins like hand-written text: with "solid", in lower or upper case, after an optional byte order
/// mark or blanks.
bool begins_as_text(std::string_view bytes) {
  if (bytes.starts_with("\xEF\xBB\xBF")) bytes.remove_prefix(3);
  bytes.remove_prefix(std::min(bytes.find_first_not_of(" \t\r\n\v\f"), bytes.size()));
  return std::ranges::equal(bytes.substr(0, 5), std::string_view("solid"), {},
                            [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
}

}  // namespace

TriangleMesh read_obj(std::string_view text, const std::string& where) { return ObjReader(text, where).read(); }

TriangleMesh read_stl(std::string_view bytes, const std::string& where) {
  std::uint32_t triangles = 0;
  if (bytes.size() >= kStlHead) std::memcpy(&triangles, bytes.data() + kStlHead - sizeof triangles, sizeof triangles);
  const std::size_t whole = kStlHead + kStlTriangle * std::size_t{triangles};
  // Binary files may also begin with "solid"; a text has no zero where they have the high byte of the number of triangles.
  if (begins_as_text(bytes) && bytes.substr(0, kStlHead).find('\0') == std::string_view::npos)
    return read_text_stl(bytes.substr(bytes.starts_with("\xEF") ? 3 : 0), where);
  if (bytes.size() < kStlHead) throw InputError(where, "is no STL file", "a text that begins with \"solid\", or a binary file");
  if (bytes.size() < whole)
    throw InputError(
        where,
        "ends too early: it has " + std::to_string(bytes.size()) + " bytes for " + std::to_string(triangles) + " triangles",
        std::to_string(whole) + " bytes");
  if (triangles > kMaxTriangles) throw InputError(where, "holds " + std::to_string(triangles) + " triangles", kTooMany);
  return read_binary_stl(bytes, triangles, where);
}

std::string as_stl(const TriangleMesh& mesh) {
  std::string bytes(kStlHead - sizeof(std::uint32_t), ' ');
  const auto append = [&](const auto& value) { bytes.append(reinterpret_cast<const char*>(&value), sizeof value); };
  append(static_cast<std::uint32_t>(mesh.triangles.size()));
  for (const Triangle& t : mesh.triangles) {
    bytes.append(kStlNormal, '\0');
    for (const std::uint32_t corner : t)
      for (const double x : mesh.vertices[corner]) append(static_cast<float>(x));
    append(std::uint16_t{0});
  }
  return bytes;
}

}  // namespace palpate
