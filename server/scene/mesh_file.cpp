#include "server/scene/mesh_file.hpp"

#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <cmath>
#include <cstdio>
#include <unordered_map>

#include "common/base/error.hpp"
#include "common/json/json.hpp"
#include "server/scene/solid.hpp"
#include "server/scene/surface.hpp"

namespace palpate {

namespace {

constexpr double kMinExtentM = 0.005, kMaxExtentM = 2;
constexpr double kWeldFraction = 1e-6;  // of the diagonal
constexpr double kMinFilling = 1e-4;    // volume of a cube around the mesh
constexpr std::size_t kMaxTriangles = 2'000'000;

std::string extension(const std::filesystem::path& file) {
  std::string ext = file.extension().string();
  std::transform(ext.begin(), ext.end(), ext.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return ext;
}

/// All triangles of the file, vertices as the file has them.
TriangleMesh import(const MeshSettings& settings, const std::string& where) {
  const std::string ext = extension(settings.path);
  if (ext != ".obj" && ext != ".stl") throw InputError(where, "is not a mesh file by its name", "FILE.obj or FILE.stl");
  Assimp::Importer importer;
  const aiScene* scene = importer.ReadFile(settings.path.string(), aiProcess_Triangulate);
  if (!scene) throw InputError(where, std::string("cannot be read: ") + importer.GetErrorString(), "an OBJ or STL file");
  TriangleMesh mesh;
  for (unsigned m = 0; m < scene->mNumMeshes; ++m) {
    const aiMesh& part = *scene->mMeshes[m];
    const auto base = static_cast<std::uint32_t>(mesh.vertices.size());
    for (unsigned i = 0; i < part.mNumVertices; ++i) {
      const auto& v = part.mVertices[i];
      mesh.vertices.emplace_back(static_cast<double>(v.x), static_cast<double>(v.y), static_cast<double>(v.z));
      if (!mesh.vertices.back().allFinite()) throw InputError(where, "a vertex is not finite", "numbers");
    }
    for (unsigned i = 0; i < part.mNumFaces; ++i) {
      const aiFace& face = part.mFaces[i];
      if (face.mNumIndices != 3) continue;  // loose points and lines
      mesh.triangles.push_back({base + face.mIndices[0], base + face.mIndices[1], base + face.mIndices[2]});
    }
  }
  if (mesh.triangles.empty()) throw InputError(where, "holds no triangles", "a closed surface");
  if (mesh.triangles.size() > kMaxTriangles) throw InputError(where, "holds too many triangles", "at most 2000000");
  return mesh;
}

/// Vertex positions on a grid of the welding distance.
class Welder {
 public:
  explicit Welder(double distance) : distance_(distance) {}

  std::uint32_t add(const Vec3& p, std::vector<Vec3>& out) {
    const auto cell = [&](int a, int d) { return static_cast<std::int64_t>(std::floor(p[a] / distance_)) + d; };
    for (int i = 0; i < 27; ++i) {
      const auto found = cells_.find(hash(cell(0, i % 3 - 1), cell(1, i / 3 % 3 - 1), cell(2, i / 9 - 1)));
      if (found == cells_.end()) continue;
      for (const std::uint32_t v : found->second) {
        if ((out[v] - p).norm() <= distance_) return v;
      }
    }
    out.push_back(p);
    const auto added = static_cast<std::uint32_t>(out.size() - 1);
    cells_[hash(cell(0, 0), cell(1, 0), cell(2, 0))].push_back(added);
    return added;
  }

 private:
  static std::uint64_t hash(std::int64_t x, std::int64_t y, std::int64_t z) {
    return static_cast<std::uint64_t>(x) * 0x9E3779B97F4A7C15u ^ static_cast<std::uint64_t>(y) * 0xC2B2AE3D27D4EB4Fu ^
           static_cast<std::uint64_t>(z) * 0x165667B19E3779F9u;
  }
  double distance_;
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> cells_;
};

Eigen::AlignedBox3d box_of(const TriangleMesh& mesh) {
  Eigen::AlignedBox3d box;
  for (const Vec3& v : mesh.vertices) box.extend(v);
  return box;
}

TriangleMesh welded(const TriangleMesh& mesh) {
  TriangleMesh out;
  const double size = box_of(mesh).diagonal().norm();
  Welder welder(std::max(kWeldFraction * size, 1e-300));
  std::vector<std::uint32_t> number;
  number.reserve(mesh.vertices.size());
  for (const Vec3& v : mesh.vertices) number.push_back(welder.add(v, out.vertices));
  for (const Triangle& t : mesh.triangles) {
    const Triangle w{number[t[0]], number[t[1]], number[t[2]]};
    if (w[0] != w[1] && w[1] != w[2] && w[2] != w[0]) out.triangles.push_back(w);
  }
  return out;
}

void check_size(const Vec3& extent, double scale, const std::string& where) {
  const double size = extent.maxCoeff();
  if (size >= kMinExtentM && size <= kMaxExtentM) return;
  std::string hint;
  if (size > 0) hint = ", for example with scale " + Json::number(scale * std::pow(10, std::round(std::log10(0.15 / size)))).text;
  char text[64];
  std::snprintf(text, sizeof text, "is %.3g m across", size);
  throw InputError(where, text, "0.005 to 2 m" + hint);
}

void check_closed(const TriangleMesh& mesh, const std::string& where) {
  const EdgeReport edges = check_edges(mesh.triangles);
  if (edges.closed()) return;
  const std::string place = ", one at " + in_words(0.5 * (mesh.vertices[edges.example[0]] + mesh.vertices[edges.example[1]]));
  const auto fail = [&](std::size_t n, const char* what, const char* expected) {
    throw InputError(where, "has " + std::to_string(n) + (n == 1 ? " edge " : " edges ") + what + place, expected);
  };
  if (edges.open) fail(edges.open, "with a triangle on one side only (a hole)", "a closed surface");
  if (edges.crowded) fail(edges.crowded, "with more than two triangles", "a surface with two triangles at every edge");
  fail(edges.flipped, "whose two triangles face opposite ways", "triangles that all face outwards");
}

}  // namespace

std::string in_words(const Vec3& p) {
  char text[96];
  std::snprintf(text, sizeof text, "(%.4g, %.4g, %.4g) m", p[0], p[1], p[2]);
  return text;
}

TriangleMesh read_closed_mesh(const MeshSettings& settings, const std::string& where) {
  TriangleMesh mesh = welded(import(settings, where));
  if (mesh.triangles.empty()) throw InputError(where, "has only triangles without area", "a closed surface");
  const Mat3 turn = settings.scale * rotation_xyz(settings.rotation_deg);
  for (Vec3& v : mesh.vertices) v = turn * v + settings.offset_m;
  const Vec3 extent = box_of(mesh).sizes();
  check_size(extent, settings.scale, where);
  check_closed(mesh, where);
  const double volume = signed_volume(mesh.triangles, mesh.vertices);
  if (std::abs(volume) < kMinFilling * std::pow(extent.maxCoeff(), 3)) throw InputError(where, "encloses no volume", "a solid");
  if (volume < 0) {
    std::fprintf(stderr, "%s: is inside out; turned\n", where.c_str());
    for (Triangle& t : mesh.triangles) std::swap(t[1], t[2]);
  }
  return mesh;
}

}  // namespace palpate
