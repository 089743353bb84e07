#include "bench/tissue/specimens.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/base/random.hpp"

namespace palpate {
namespace {

using std::numbers::pi;
constexpr double kMerge = 1e-7;  // share of a specimen's size

Vec3 between(const Vec3& a, const Vec3& b, double share) { return a + share * (b - a); }

Vec3 on_circle(double radius, double degrees) {
  return radius * Vec3(std::cos(degrees * pi / 180), std::sin(degrees * pi / 180), 0);
}

/// Square core of a disc of radius 1: half of the way out along the axes, and its corner on the diagonal.
constexpr double kCoreAxis = 0.55, kCoreCorner = 0.45;

/// Side of the core that faces the sector from `degrees` to `degrees` + 45.
Vec3 core_side(double degrees, double share) {
  const bool first = std::fmod(degrees, 90) < 1;
  const Vec3 axis = on_circle(kCoreAxis, first ? degrees : degrees + 45);
  const Vec3 corner = on_circle(kCoreCorner * std::numbers::sqrt2, first ? degrees + 45 : degrees);
  return first ? between(axis, corner, share) : between(corner, axis, share);
}

/// Adds a quarter of a disc of radius 1 that begins at `degrees`: its core and the two sectors around it; `depth` cells and
/// `z_at` describe the third direction.
void add_quarter_disc(BlockMesh& mesh, int n, double radius, double degrees, int depth,
                      const std::function<double(double)>& z_at) {
  const int core = std::max(n / 2, 1), ring = n - core;
  const auto at = [&](const Vec3& flat, double w) { return Vec3(radius * flat.x(), radius * flat.y(), z_at(w)); };
  const Vec3 a = on_circle(kCoreAxis, degrees), b = on_circle(kCoreAxis, degrees + 90);
  const Vec3 corner = on_circle(kCoreCorner * std::numbers::sqrt2, degrees + 45);
  mesh.add({core, core, depth},
           [&](const Vec3& q) { return at(q.x() * (1 - q.y()) * a + q.x() * q.y() * corner + (1 - q.x()) * q.y() * b, q.z()); });
  for (const double from : {degrees, degrees + 45})
    mesh.add({ring, core, depth},
             [&](const Vec3& q) { return at(between(core_side(from, q.y()), on_circle(1, from + 45 * q.y()), q.x()), q.z()); });
}

/// Number of cells that begin with the size near / n and grow in proportion to near plus the distance.
int growing_cells(int n, double near, double far) {
  return std::max(1, static_cast<int>(std::lround(n * std::log1p(far / near))));
}
double growing(double near, double far, double share) { return near * (std::pow(1 + far / near, share) - 1); }

}  // namespace

BlockMesh box_mesh(const std::array<int, 3>& cells, const Vec3& size_m) {
  BlockMesh mesh(kMerge * size_m.minCoeff());
  mesh.add(cells, [&](const Vec3& q) { return Vec3(q.cwiseProduct(size_m)); });
  return mesh;
}

BlockMesh crooked_cube(int n, double size_m) {
  BlockMesh mesh = box_mesh({n, n, n}, Vec3::Constant(size_m));
  Random random(4);
  const double most = size_m / n / 6;
  mesh.move([&](std::uint32_t, const Vec3& x) {
    const bool inside = x.minCoeff() > size_m / n / 2 && x.maxCoeff() < size_m - size_m / n / 2;
    Vec3 moved = x;
    for (int a = 0; a < 3; ++a) moved[a] += inside ? most * (2 * random.uniform() - 1) : 0;
    return moved;
  });
  return mesh;
}

BlockMesh cylinder(int n, double radius_m, double length_m) {
  BlockMesh mesh(kMerge * radius_m);
  const int along = std::max(1, static_cast<int>(std::lround(n * length_m / radius_m)));
  for (const double degrees : {0.0, 90.0, 180.0, 270.0})
    add_quarter_disc(mesh, n, radius_m, degrees, along, [=](double w) { return w * length_m; });
  return mesh;
}

BlockMesh hollow_sphere_octant(int n, double inner_m, double outer_m) {
  BlockMesh mesh(kMerge * inner_m);
  const int around = std::max(1, 3 * n / 2);
  for (int axis = 0; axis < 3; ++axis)
    mesh.add({around, around, n}, [&](const Vec3& q) {
      Vec3 direction;
      direction[axis] = 1;
      direction[(axis + 1) % 3] = std::tan(q.x() * pi / 4);
      direction[(axis + 2) % 3] = std::tan(q.y() * pi / 4);
      return Vec3((inner_m + q.z() * (outer_m - inner_m)) * direction.normalized());
    });
  return mesh;
}

BlockMesh layer_quarter(int n, double near_m, double thickness_m, double outer_m) {
  BlockMesh mesh(kMerge * near_m);
  const int deep = growing_cells(n, near_m, thickness_m), out = growing_cells(n, near_m, outer_m - near_m);
  // From the bottom up.
  const auto z_at = [=](double w) { return -growing(near_m, thickness_m, 1 - w); };
  add_quarter_disc(mesh, n, near_m, 0, deep, z_at);
  for (const double from : {0.0, 45.0})
    mesh.add({out, std::max(n / 2, 1), deep}, [&](const Vec3& q) {
      Vec3 x = on_circle(near_m + growing(near_m, outer_m - near_m, q.x()), from + 45 * q.y());
      x.z() = z_at(q.z());
      return x;
    });
  return mesh;
}

BlockMesh cooks_membrane(int n, double thickness_m) {
  BlockMesh mesh(kMerge * thickness_m);
  mesh.add({n, n, 1}, [&](const Vec3& q) {
    const double low = 44 * q.x(), high = 44 + 16 * q.x();
    return Vec3(48e-3 * q.x(), 1e-3 * (low + q.y() * (high - low)), thickness_m * q.z());
  });
  return mesh;
}

std::vector<std::uint32_t> nodes_where(const std::vector<Vec3>& nodes, const std::function<bool(const Vec3&)>& test) {
  std::vector<std::uint32_t> found;
  for (std::uint32_t i = 0; i < nodes.size(); ++i)
    if (test(nodes[i])) found.push_back(i);
  return found;
}

}  // namespace palpate
