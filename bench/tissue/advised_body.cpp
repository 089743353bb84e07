#include "bench/tissue/advised_body.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>

#include "common/base/error.hpp"
#include "common/patch/triangle_tree.hpp"
#include "server/scene/disjoint_sets.hpp"
#include "server/scene/materials.hpp"
#include "server/scene/mesh_file.hpp"
#include "server/scene/mesh_solid.hpp"

namespace palpate {
namespace {

constexpr double kLowestVolume = 0.1, kLeastHeld = 0.15, kMostHeld = 0.5;
constexpr double kTipNodes = 800, kTipSpacings = 2;

const std::map<std::string, Vec3> kRotations = {{"z", {0, 0, 0}},    {"-z", {180, 0, 0}}, {"y", {90, 0, 0}},
                                                {"-y", {-90, 0, 0}}, {"x", {0, -90, 0}},  {"-x", {0, 90, 0}}};

double area_of(const TriangleMesh& mesh) {
  double area = 0;
  for (const auto& [a, b, c] : mesh.triangles)
    area += 0.5 * (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]).norm();
  return area;
}

/// Heights of points that fill the solid evenly, ascending.
std::vector<double> heights_inside(const SignedDistance& solid) {
  constexpr int kAcross = 24;
  const Eigen::AlignedBox3d box = solid.bounds();
  const Vec3 step = box.sizes() / kAcross;
  std::vector<double> heights;
  for (int k = 0; k < kAcross; ++k)
    for (int j = 0; j < kAcross; ++j)
      for (int i = 0; i < kAcross; ++i) {
        const Vec3 p = box.min() + step.cwiseProduct(Vec3(i + 0.5, j + 0.5, k + 0.5));
        if (solid.distance(p) < 0) heights.push_back(p.z());
      }
  return heights;
}

/// Shells: connected parts of the surface.
std::vector<TriangleMesh> shells_of(const TriangleMesh& mesh) {
  DisjointSets sets(mesh.vertices.size());
  for (const auto& [a, b, c] : mesh.triangles) sets.join(a, b), sets.join(a, c);
  std::map<std::uint32_t, TriangleMesh> shells;
  std::vector<std::uint32_t> number(mesh.vertices.size());
  for (std::uint32_t v = 0; v < mesh.vertices.size(); ++v) {
    std::vector<Vec3>& vertices = shells[sets.find(v)].vertices;
    number[v] = static_cast<std::uint32_t>(vertices.size());
    vertices.push_back(mesh.vertices[v]);
  }
  for (const auto& [a, b, c] : mesh.triangles) shells[sets.find(a)].triangles.push_back({number[a], number[b], number[c]});
  std::vector<TriangleMesh> list;
  for (auto& [first, shell] : shells)
    if (!shell.triangles.empty()) list.push_back(std::move(shell));
  return list;
}

/// Volumes of the bodies of a surface, the largest first: the unions of shells of which one has a corner in the other.
std::vector<double> bodies_of(const TriangleMesh& mesh) {
  const std::vector<TriangleMesh> shells = shells_of(mesh);
  std::vector<TriangleTree> trees;
  for (const TriangleMesh& shell : shells) trees.emplace_back(shell);
  const auto has_corner_in = [&](std::size_t shell, std::size_t other) {
    return trees[shell].bounds().intersects(trees[other].bounds()) &&
           std::ranges::any_of(shells[shell].vertices,
                               [&](const Vec3& x) { return std::abs(trees[other].winding_number(x)) > 0.5; });
  };
  DisjointSets meet(shells.size());
  for (std::uint32_t i = 0; i < shells.size(); ++i)
    for (std::uint32_t j = 0; j < shells.size(); ++j)
      if (i != j && has_corner_in(i, j)) meet.join(i, j);
  std::map<std::uint32_t, TriangleMesh> bodies;
  for (std::uint32_t i = 0; i < shells.size(); ++i) {
    TriangleMesh& body = bodies[meet.find(i)];
    const auto first = static_cast<std::uint32_t>(body.vertices.size());
    body.vertices.insert(body.vertices.end(), shells[i].vertices.begin(), shells[i].vertices.end());
    for (const auto& [a, b, c] : shells[i].triangles) body.triangles.push_back({first + a, first + b, first + c});
  }
  std::vector<double> volumes_m3;
  for (auto& [first, body] : bodies) volumes_m3.push_back(make_mesh_solid(std::move(body))->volume());
  std::ranges::sort(volumes_m3, std::greater<>());
  return volumes_m3;
}

void choose_support(const AdviceRequest& request, const SignedDistance& solid, AdvisedBody& body) {
  const std::vector<double> heights = heights_inside(solid);
  const double low = solid.bounds().min().z(), height = body.size_m.z();
  double share = request.held_share.value_or(kLeastHeld);
  if (!request.held_share && !heights.empty()) {
    const double tenth = heights[static_cast<std::size_t>(kLowestVolume * static_cast<double>(heights.size()))];
    share = std::clamp((tenth - low) / height, kLeastHeld, kMostHeld);
  }
  body.held_below_m = share * height;
  const auto held = std::ranges::count_if(heights, [&](double z) { return z - low < body.held_below_m; });
  body.held_volume_share = static_cast<double>(held) / static_cast<double>(std::max<std::size_t>(1, heights.size()));
}

}  // namespace

AdvisedBody advised_body(const AdviceRequest& request) {
  if (!find_material(request.material))
    throw InputError("--material", "'" + request.material + "' is not known", "one of palpate-server --list-materials");
  const auto rotation = kRotations.find(request.up);
  if (rotation == kRotations.end()) throw InputError("--up", "'" + request.up + "' is no axis", "x, -x, y, -y, z or -z");
  AdvisedBody body;
  body.rotation_deg = rotation->second;
  const MeshSettings settings{request.surface.string(), request.surface, request.scale, body.rotation_deg, Vec3::Zero()};
  const TriangleMesh mesh = read_closed_mesh(settings, "--surface " + request.surface.string());
  const auto solid = make_mesh_solid(mesh);
  const Eigen::AlignedBox3d box = solid->bounds();
  body.size_m = box.sizes();
  body.offset_m = -Vec3(box.center().x(), box.center().y(), box.min().z());
  body.area_m2 = area_of(mesh);
  body.volume_m3 = solid->volume();
  body.bodies_m3 = bodies_of(mesh);
  body.mass_kg = body.volume_m3 * find_material(request.material)->density_kg_m3;
  choose_support(request, *solid, body);
  body.radius_m = request.radius_m.value_or(1e-3 * std::max(1.0, std::round(1e3 * kTipSpacings * spacing_for(body, kTipNodes))));
  return body;
}

double spacing_for(const AdvisedBody& body, double nodes) {
  double low = 0, high = body.size_m.maxCoeff();
  for (int i = 0; i < 60; ++i) {
    const double h = (low + high) / 2;
    (body.volume_m3 / (h * h * h) + body.area_m2 / (2 * h * h) > nodes ? low : high) = h;
  }
  return std::min({high, 0.45 * body.size_m.minCoeff(), 2 * body.volume_m3 / body.area_m2});
}

}  // namespace palpate
