#include "scene_files.hpp"

#include <unistd.h>

#include <Eigen/Geometry>
#include <catch2/catch.hpp>
#include <cstring>
#include <fstream>
#include <map>
#include <sstream>

#include "common/base/error.hpp"
#include "server/scene/tetra_mesh.hpp"

namespace palpate::test {

Folder::Folder() {
  std::string name = (std::filesystem::temp_directory_path() / "palpate-scene-XXXXXX").string();
  REQUIRE(mkdtemp(name.data()) != nullptr);
  path_ = name;
}

Folder::~Folder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

std::filesystem::path Folder::write(const std::string& name, const std::string& text) const {
  std::ofstream(path_ / name, std::ios::binary) << text;
  return path_ / name;
}

std::string error_of(const Folder& folder, const std::string& text) {
  try {
    load_scene(folder.write("scene.json", text));
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  REQUIRE(at != std::string::npos);
  return text.replace(at, from.size(), to);
}

TriangleMesh icosphere(int levels, double radius_m) {
  const double g = 0.5 * (1 + std::sqrt(5.0));
  TriangleMesh mesh;
  for (const double a : {-1.0, 1.0}) {
    for (const double b : {-g, g}) {
      mesh.vertices.push_back(Vec3(0, a, b).normalized());
      mesh.vertices.push_back(Vec3(a, b, 0).normalized());
      mesh.vertices.push_back(Vec3(b, 0, a).normalized());
    }
  }
  // Faces of the icosahedron: all triples of mutual neighbours (edge 2 before normalising, so the dot product is g / (1 + g^2)).
  const auto near = [&](std::uint32_t a, std::uint32_t b) { return mesh.vertices[a].dot(mesh.vertices[b]) > 0.4; };
  for (std::uint32_t a = 0; a < 12; ++a) {
    for (std::uint32_t b = a + 1; b < 12; ++b) {
      for (std::uint32_t c = b + 1; c < 12; ++c) {
        if (!near(a, b) || !near(b, c) || !near(a, c)) continue;
        const auto& v = mesh.vertices;
        const bool outward = (v[b] - v[a]).cross(v[c] - v[a]).dot(v[a]) > 0;
        mesh.triangles.push_back(outward ? Triangle{a, b, c} : Triangle{a, c, b});
      }
    }
  }
  for (int level = 0; level < levels; ++level) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const auto [entry, added] = middles.try_emplace({std::min(a, b), std::max(a, b)}, mesh.vertices.size());
      if (added) mesh.vertices.push_back((mesh.vertices[a] + mesh.vertices[b]).normalized());
      return entry->second;
    };
    std::vector<Triangle> finer;
    for (const auto& [a, b, c] : mesh.triangles) {
      const auto ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    }
    mesh.triangles = std::move(finer);
  }
  for (Vec3& v : mesh.vertices) v *= radius_m;
  return mesh;
}

std::string as_obj(const TriangleMesh& mesh, double scale) {
  std::ostringstream out;
  out.precision(9);
  for (const Vec3& v : mesh.vertices) out << "v " << scale * v[0] << ' ' << scale * v[1] << ' ' << scale * v[2] << '\n';
  for (const Triangle& t : mesh.triangles) out << "f " << t[0] + 1 << ' ' << t[1] + 1 << ' ' << t[2] + 1 << '\n';
  return out.str();
}

std::string as_ascii_stl(const TriangleMesh& mesh) {
  std::ostringstream out;
  out.precision(9);
  out << "solid sphere\n";
  for (const Triangle& t : mesh.triangles) {
    out << "facet normal 0 0 0\nouter loop\n";
    for (const auto i : t)
      out << "vertex " << mesh.vertices[i][0] << ' ' << mesh.vertices[i][1] << ' ' << mesh.vertices[i][2] << '\n';
    out << "endloop\nendfacet\n";
  }
  out << "endsolid sphere\n";
  return out.str();
}

const char* const kSoftCube = R"({
  "name": "cube6",
  "body": {
    "lattice": {
      "nodes": [6, 6, 6],
      "size_m": [0.1, 0.1, 0.1],
      "density_kg_m3": 1000,
      "stiffness_n_m": 60,
      "damping_n_s_m": 0.24,
      "fixed_faces": ["z-"],
      "layers": [ {"below_z_m": 0.06, "stiffness_n_m": 20, "damping_n_s_m": 0.08} ]
    }
  },
  "tool": { "contact": "attach", "node": [2, 2, 5] }
}
)";

double volume(const LumpedBody& body) {
  double sum = 0;
  for (const Tetrahedron& t : body.tetrahedra) sum += volume_of(t, body.nodes);
  return sum;
}

}  // namespace palpate::test
