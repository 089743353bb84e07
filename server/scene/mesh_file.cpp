#include "server/scene/mesh_file.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>

#include "common/base/error.hpp"
#include "common/file/read_file.hpp"
#include "common/json/json.hpp"
#include "server/scene/signed_distance.hpp"
#include "server/scene/surface.hpp"
#include "server/scene/surface_repair.hpp"

namespace palpate {

namespace {

constexpr double kMinExtentM = 0.005, kMaxExtentM = 2;
constexpr double kWeldFraction = 1e-6;  // share of the diagonal
constexpr double kCellWidth = 4;        // cell of the welder, in welding distances
constexpr double kMinFilling = 1e-4;    // least volume, as a share of a cube around the mesh
constexpr std::size_t kMaxFileBytes = std::size_t{1} << 30;

std::string extension(const std::filesystem::path& file) {
  std::string ext = file.extension().string();
  std::transform(ext.begin(), ext.end(), ext.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return ext;
}

/// Merges vertices by the cells of a grid, some welding distances wide, from the lowest corner of the mesh on. Cells are ordered
/// instead of hashed, as a file could be made whose cells all share a hash.
class Welder {
 public:
  Welder(const Vec3& low, double distance) : low_(low), distance_(distance) {}

  std::uint32_t add(const Vec3& p, std::vector<Vec3>& out) {
    const Cell first = cell_of(p - Vec3::Constant(distance_)), last = cell_of(p + Vec3::Constant(distance_));
    Cell c = first;
    for (c[0] = first[0]; c[0] <= last[0]; ++c[0])
      for (c[1] = first[1]; c[1] <= last[1]; ++c[1])
        for (c[2] = first[2]; c[2] <= last[2]; ++c[2])
          if (const std::uint32_t v = found_in(c, p, out); v != kNone) return v;
    const auto added = static_cast<std::uint32_t>(out.size());
    out.push_back(p);
    const auto [newest, fresh] = newest_.try_emplace(cell_of(p), added);
    before_.push_back(fresh ? kNone : newest->second);
    newest->second = added;
    return added;
  }

 private:
  using Cell = std::array<std::int64_t, 3>;
  static constexpr std::uint32_t kNone = UINT32_MAX;

  Cell cell_of(const Vec3& p) const {
    Cell cell{};
    for (std::size_t a = 0; a < 3; ++a) {
      const auto axis = static_cast<Eigen::Index>(a);
      cell[a] = static_cast<std::int64_t>(std::floor((p[axis] - low_[axis]) / (kCellWidth * distance_)));
    }
    return cell;
  }
  std::uint32_t found_in(const Cell& cell, const Vec3& p, const std::vector<Vec3>& x) const {
    const auto newest = newest_.find(cell);
    for (std::uint32_t v = newest == newest_.end() ? kNone : newest->second; v != kNone; v = before_[v])
      if ((x[v] - p).norm() <= distance_) return v;
    return kNone;
  }

  Vec3 low_;
  double distance_;
  std::map<Cell, std::uint32_t> newest_;  ///< newest vertex of a cell
  std::vector<std::uint32_t> before_;     ///< for each vertex, the next older one of its cell
};

Eigen::AlignedBox3d box_of(std::span<const Vec3> points) {
  Eigen::AlignedBox3d box;
  for (const Vec3& x : points) box.extend(x);
  return box;
}

TriangleMesh welded(const TriangleMesh& mesh) {
  TriangleMesh out;
  const Eigen::AlignedBox3d box = box_of(mesh.vertices);
  Welder welder(box.min(), std::max(kWeldFraction * box.diagonal().norm(), 1e-300));
  std::vector<std::uint32_t> number;
  number.reserve(mesh.vertices.size());
  for (const Vec3& v : mesh.vertices) number.push_back(welder.add(v, out.vertices));
  for (const Triangle& t : mesh.triangles) {
    const Triangle w{number[t[0]], number[t[1]], number[t[2]]};
    if (w[0] != w[1] && w[1] != w[2] && w[2] != w[0]) out.triangles.push_back(w);
  }
  return out;
}

std::string length_in_words(double metres) {
  const auto [unit, factor] = metres >= 1e3    ? std::pair{"km", 1e-3}
                              : metres >= 1    ? std::pair{"m", 1.0}
                              : metres >= 1e-3 ? std::pair{"mm", 1e3}
                                               : std::pair{"um", 1e6};
  char text[32];
  std::snprintf(text, sizeof text, "%.3g %s", factor * metres, unit);
  return text;
}

void check_size(const Vec3& extent, double scale, const std::string& where) {
  const double size = extent.maxCoeff();
  if (size >= kMinExtentM && size <= kMaxExtentM) return;
  std::string hint;
  if (size > 0) hint = ", for example with scale " + Json::number(scale * std::pow(10, std::round(std::log10(0.15 / size)))).text;
  throw InputError(where, "is " + length_in_words(size) + " across with scale " + Json::number(scale).text,
                   "0.005 to 2 m" + hint);
}

void check_closed(const TriangleMesh& mesh, const std::string& where) {
  const EdgeReport edges = check_edges(mesh.triangles);
  if (edges.bounds()) return;
  const std::string place = ", one at " + in_words(0.5 * (mesh.vertices[edges.example[0]] + mesh.vertices[edges.example[1]]));
  const auto fail = [&](std::size_t n, const char* what, const char* expected) {
    throw InputError(where, "has " + std::to_string(n) + (n == 1 ? " edge " : " edges ") + what + place, expected);
  };
  if (edges.open) fail(edges.open, "with a triangle on one side only (a hole)", "a closed surface");
  if (edges.crowded)
    fail(edges.crowded, "with more triangles one way than the other", "a surface with two triangles at every edge");
  fail(edges.flipped, "whose two triangles face opposite ways", "triangles that all face outwards");
}

}  // namespace

std::string in_words(const Vec3& p) {
  char text[96];
  std::snprintf(text, sizeof text, "(%.4g, %.4g, %.4g) m", p[0], p[1], p[2]);
  return text;
}

void check_place(std::span<const Vec3> vertices, const std::string& where) {
  for (const Vec3& x : vertices)
    if (!x.allFinite() || x.cwiseAbs().maxCoeff() > kMaxCoordinateM)
      throw InputError(where, "has a vertex at " + in_words(x),
                       "one within " + Json::number(kMaxCoordinateM).text + " m of the origin");
}

Vec3 extent_of(std::span<const Vec3> points) {
  const Eigen::AlignedBox3d box = box_of(points);
  return box.isEmpty() ? Vec3::Zero() : Vec3(box.sizes());
}

TriangleMesh read_surface(const std::filesystem::path& file, const std::string& where) {
  const std::string ext = extension(file);
  if (ext == ".msh" || ext == ".vtk")
    throw InputError(where, "holds tetrahedra by its name",
                     "a closed surface, FILE.obj or FILE.stl; tetrahedra belong in body.mesh of a scene");
  if (ext != ".obj" && ext != ".stl") throw InputError(where, "is not a surface by its name", "FILE.obj or FILE.stl");
  std::string bytes = read_plain_file(file, where, "an OBJ or STL file", kMaxFileBytes);
  return ext == ".obj" ? read_obj(without_mark(std::move(bytes)), where) : read_stl(bytes, where);
}

TriangleMesh read_closed_mesh(const MeshSettings& settings, const std::string& where) {
  return closed_mesh(read_surface(settings.path, where), settings, where);
}

TriangleMesh closed_mesh(const TriangleMesh& given, const MeshSettings& settings, const std::string& where) {
  if (given.triangles.empty()) throw InputError(where, "holds no triangles", "a closed surface");
  TriangleMesh mesh = welded(given);
  if (mesh.triangles.empty()) throw InputError(where, "has only triangles without area", "a closed surface");
  const Mat3 turn = settings.scale * rotation_xyz(settings.rotation_deg);
  for (Vec3& v : mesh.vertices) v = turn * v + settings.offset_m;
  const Vec3 extent = extent_of(mesh.vertices);
  check_size(extent, settings.scale, where);
  check_place(mesh.vertices, where);
  const SurfaceRepairs repairs = repair_surface(mesh);
  check_closed(mesh, where);
  if (repairs.shells > kMostShells)
    throw InputError(where, "falls into " + std::to_string(repairs.shells) + " shells", "at most " + std::to_string(kMostShells));
  const double volume = signed_volume(mesh.triangles, mesh.vertices);
  if (!(volume >= kMinFilling * std::pow(extent.maxCoeff(), 3))) throw InputError(where, "encloses no volume", "a solid");
  if (const std::string mended = repairs.in_words(); !mended.empty())
    std::fprintf(stderr, "%s: %s\n", where.c_str(), mended.c_str());
  return mesh;
}

}  // namespace palpate
