// Surfaces: nearest points against sampling, normals and sliding on a sphere, open borders.
#include "common/patch/surface.hpp"

#include <Eigen/Geometry>
#include <catch2/catch.hpp>
#include <cmath>
#include <map>
#include <numbers>

#include "common/base/random.hpp"

using namespace palpate;

namespace {

struct Mesh {
  std::vector<double> x;
  std::vector<Triangle> triangles;
  Surface surface;

  std::uint32_t add(const Vec3& p) {
    x.insert(x.end(), p.data(), p.data() + 3);
    return static_cast<std::uint32_t>(x.size() / 3 - 1);
  }
  void connect() { surface = Surface(triangles, x.size() / 3); }
  SurfaceView view() const { return surface.view(); }
};

/// An octahedron whose triangles are split in four `levels` times and projected to the sphere.
Mesh sphere(double radius, int levels) {
  Mesh mesh;
  for (int axis = 0; axis < 3; ++axis)
    for (const double sign : {1.0, -1.0}) mesh.add(sign * radius * Vec3::Unit(axis));
  for (std::uint32_t k = 0; k < 8; ++k) {
    const std::uint32_t a = k & 1, b = 2 + (k >> 1 & 1), c = 4 + (k >> 2 & 1);
    const bool even = (a + b + c) % 2 == 0;
    mesh.triangles.push_back(even ? Triangle{a, b, c} : Triangle{a, c, b});
  }
  for (int level = 0; level < levels; ++level) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const auto [entry, fresh] = middles.try_emplace(std::minmax(a, b), 0);
      if (fresh) entry->second = mesh.add(radius * (vertex(mesh.x, a) + vertex(mesh.x, b)).normalized());
      return entry->second;
    };
    std::vector<Triangle> finer;
    for (const auto& [a, b, c] : mesh.triangles) {
      const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      for (const Triangle& t : {Triangle{a, ab, ca}, Triangle{ab, b, bc}, Triangle{ca, bc, c}, Triangle{ab, bc, ca}})
        finer.push_back(t);
    }
    mesh.triangles = std::move(finer);
  }
  mesh.connect();
  return mesh;
}

/// n x n cells of size `cell` in the plane z = 0, outside up.
Mesh plane(int n, double cell) {
  Mesh mesh;
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i <= n; ++i) mesh.add({cell * i, cell * j, 0});
  const auto id = [n](int i, int j) { return static_cast<std::uint32_t>(i + (n + 1) * j); };
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      mesh.triangles.push_back({id(i, j), id(i + 1, j), id(i + 1, j + 1)});
      mesh.triangles.push_back({id(i, j), id(i + 1, j + 1), id(i, j + 1)});
    }
  mesh.connect();
  return mesh;
}

Eigen::Map<Vec3> vertex_of(Mesh& mesh, std::uint32_t i) { return Eigen::Map<Vec3>(mesh.x.data() + 3 * std::size_t{i}); }

Vec3 random_offset(Random& random, double size) {
  const double x = random.uniform(-size, size), y = random.uniform(-size, size), z = random.uniform(-size, size);
  return {x, y, z};
}

}  // namespace

TEST_CASE("The nearest point is at least as near as any sampled one, and no nearer than the sampling allows") {
  Mesh mesh = sphere(0.05, 1);
  Random random(1);
  for (double& value : mesh.x) value += random.uniform(-0.005, 0.005);
  constexpr int kSamples = 40;
  for (int trial = 0; trial < 100; ++trial) {
    const Vec3 query = random_offset(random, 0.1);
    const NearestPoint nearest = nearest_point(mesh.view(), mesh.x, query);
    double best = 1e300;
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
      for (int i = 0; i <= kSamples; ++i)
        for (int j = 0; i + j <= kSamples; ++j) {
          const Vec3 w(1.0 * i / kSamples, 1.0 * j / kSamples, 1.0 * (kSamples - i - j) / kSamples);
          best = std::min(best, (position_at(mesh.view(), mesh.x, {t, w}) - query).norm());
        }
    const double distance = (nearest.position - query).norm();
    CHECK(distance <= best + 1e-12);
    CHECK(distance > best - 0.06 / kSamples);
    CHECK(std::abs(nearest.height_m) == Approx(distance));
    CHECK(nearest.point.weight.minCoeff() >= 0);
    CHECK(nearest.point.weight.sum() == Approx(1));
    CHECK((position_at(mesh.view(), mesh.x, nearest.point) - nearest.position).norm() == 0);
    CHECK_FALSE(nearest.at_border);
  }
}

TEST_CASE("On a sphere the normal is radial, the height is the distance, and its sign says inside or outside") {
  const Mesh mesh = sphere(0.05, 4);
  Random random(2);
  for (int trial = 0; trial < 300; ++trial) {
    const Vec3 away = random_offset(random, 1).normalized();
    const double height = random.uniform(-0.01, 0.03);
    const NearestPoint nearest = nearest_point(mesh.view(), mesh.x, (0.05 + height) * away);
    CHECK(nearest.normal.dot(away) > std::cos(0.04));
    CHECK(nearest.normal.norm() == Approx(1));
    CHECK(nearest.height_m == Approx(height).margin(2e-4));
  }
}

TEST_CASE("A surface goes around what is inside of it once, and around nothing else, with a part of it turned inside out too") {
  Mesh mesh = sphere(0.05, 2);
  Random random(4);
  for (int trial = 0; trial < 50; ++trial) {
    const Vec3 away = random_offset(random, 1).normalized();
    CHECK(winding_number(mesh.view(), mesh.x, random.uniform(0, 0.045) * away) == Approx(1));
    CHECK(winding_number(mesh.view(), mesh.x, random.uniform(0.051, 2) * away) == Approx(0).margin(1e-9));
  }
  // A vertex is pushed through the body and out on the other side, where it faces the back of the triangles.
  vertex_of(mesh, 0) = Vec3(-0.08, 0.001, 0.002);
  for (const double distance_m : {0.081, 0.1, 0.3, 1.0}) {
    const Vec3 query(-distance_m, 0.001, 0.002);
    CHECK(winding_number(mesh.view(), mesh.x, query) == Approx(0).margin(1e-9));
    const NearestPoint nearest = nearest_point(mesh.view(), mesh.x, query);
    CHECK(nearest.normal.x() > 0.5);
    CHECK(nearest.height_m == Approx(distance_m - 0.08));
  }
}

TEST_CASE("Next to an open surface half of all directions are behind it, a quarter at its rim, an eighth at its corner") {
  const Mesh mesh = plane(8, 0.01);
  constexpr double kNearM = 1e-7;
  CHECK(winding_number(mesh.view(), mesh.x, Vec3(0.04, 0.04, -kNearM)) == Approx(1. / 2).epsilon(1e-4));
  CHECK(winding_number(mesh.view(), mesh.x, Vec3(0.04, 0.04, kNearM)) == Approx(-1. / 2).epsilon(1e-4));
  CHECK(winding_number(mesh.view(), mesh.x, Vec3(0.04, 0, -kNearM)) == Approx(1. / 4).epsilon(1e-4));
  CHECK(winding_number(mesh.view(), mesh.x, Vec3(0, 0.08, -kNearM)) == Approx(1. / 8).epsilon(1e-4));
  CHECK(winding_number(mesh.view(), mesh.x, Vec3(0.04, 0.04, -1)) == Approx(0.0064 / (4 * std::numbers::pi)).epsilon(0.01));
}

TEST_CASE("Normals do not jump where a point crosses from one triangle to the next") {
  const Mesh mesh = sphere(0.05, 2);
  Vec3 last = Vec3::Zero();
  double largest = 0;
  for (int k = 0; k <= 20000; ++k) {
    const double angle = 2 * std::numbers::pi * k / 20000;
    const Vec3 query = 0.051 * Vec3(std::cos(angle), 0.8 * std::sin(angle), 0.6 * std::sin(angle));
    const Vec3 normal = nearest_point(mesh.view(), mesh.x, query).normal;
    if (k > 0) largest = std::max(largest, (normal - last).norm());
    last = normal;
  }
  // 20000 steps around: 0.0003 each on the sphere; the normals of the coarse mesh turn up to a few times faster in places.
  CHECK(largest < 0.003);
}

TEST_CASE("Small slips around a sphere add up to its girth") {
  const Mesh mesh = sphere(0.05, 4);
  constexpr double kStepM = 0.0005;
  SurfacePoint point = nearest_point(mesh.view(), mesh.x, Vec3(0.05, 0, 0)).point;
  const Vec3 axis = Vec3(0.2, 0.5, 1).normalized();
  const Vec3 begin = axis.cross(Vec3::UnitY()).normalized();
  point = nearest_point(mesh.view(), mesh.x, 0.05 * begin).point;
  double angle = 0;
  Vec3 last = position_at(mesh.view(), mesh.x, point);
  int steps = 0;
  while (angle < 2 * std::numbers::pi && steps < 2000) {
    const Vec3 along = axis.cross(normal_at(mesh.view(), mesh.x, point)).normalized();
    point = slide(mesh.view(), mesh.x, point, kStepM * along);
    const Vec3 now = position_at(mesh.view(), mesh.x, point);
    angle += std::atan2(axis.dot(last.cross(now)), last.dot(now) - axis.dot(last) * axis.dot(now));
    last = now;
    ++steps;
  }
  CHECK(steps * kStepM == Approx(2 * std::numbers::pi * 0.05).epsilon(0.01));
}

TEST_CASE("A slip in a plane goes exactly where it points, over many triangles, and ends at the border") {
  const Mesh mesh = plane(8, 0.01);
  SurfacePoint point = nearest_point(mesh.view(), mesh.x, Vec3(0.021, 0.032, 0)).point;
  for (int k = 0; k < 10; ++k) point = slide(mesh.view(), mesh.x, point, Vec3(0.0037, 0.0023, 0));
  CHECK((position_at(mesh.view(), mesh.x, point) - Vec3(0.058, 0.055, 0)).norm() < 1e-12);
  CHECK((normal_at(mesh.view(), mesh.x, point) - Vec3::UnitZ()).norm() < 1e-12);
  for (int k = 0; k < 20; ++k) point = slide(mesh.view(), mesh.x, point, Vec3(0.0037, 0, 0));
  CHECK((position_at(mesh.view(), mesh.x, point) - Vec3(0.08, 0.055, 0)).norm() < 1e-12);
}

TEST_CASE("Slips over the border of a plane add up, there and back") {
  const Mesh mesh = plane(8, 0.01);
  SurfacePoint point = nearest_point(mesh.view(), mesh.x, Vec3(0.061, 0.032, 0)).point;
  Vec3 beyond = Vec3::Zero(), expected(0.061, 0.032, 0);
  for (int k = 0; k < 40; ++k) {
    const Vec3 slip(k < 20 ? 0.0037 : -0.0035, 0.0031 * std::cos(0.3 * k), 0.0002);  // inside again at the end
    const Vec3 target = position_at(mesh.view(), mesh.x, point) + beyond + slip;
    point = slide(mesh.view(), mesh.x, point, beyond + slip);
    beyond = beyond_border(mesh.view(), mesh.x, point, target);
    expected += slip.cwiseProduct(Vec3(1, 1, 0));
    CHECK((position_at(mesh.view(), mesh.x, point) + beyond - expected).norm() < 1e-12);
    const bool inside = expected.head<2>().minCoeff() >= 0 && expected.head<2>().maxCoeff() <= 0.08;
    CHECK((beyond.norm() == 0) == inside);
  }
  CHECK(beyond.norm() == 0);
}

TEST_CASE("A query beside an open surface is at its border, one above or below it is not") {
  const Mesh mesh = plane(3, 0.01);
  CHECK(nearest_point(mesh.view(), mesh.x, Vec3(0.035, 0.015, -0.001)).at_border);
  CHECK(nearest_point(mesh.view(), mesh.x, Vec3(-0.001, -0.001, 0.001)).at_border);
  const NearestPoint below = nearest_point(mesh.view(), mesh.x, Vec3(0.012, 0.015, -0.001));
  CHECK_FALSE(below.at_border);
  CHECK(below.height_m == Approx(-0.001));
  CHECK(nearest_point(mesh.view(), mesh.x, Vec3(0.012, 0.015, 0.002)).height_m == Approx(0.002));
  // On an inner edge: one weight is zero there, yet it is no border.
  CHECK_FALSE(nearest_point(mesh.view(), mesh.x, Vec3(0.01, 0.015, 0.002)).at_border);
}

TEST_CASE("A corner at the rim is on an open edge, whichever triangle names it") {
  const Mesh mesh = plane(3, 0.01);
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
    for (int k = 0; k < 3; ++k) {
      const SurfacePoint corner{t, Vec3::Unit(k)};
      const Vec3 at = position_at(mesh.view(), mesh.x, corner);
      const bool at_rim = at.head<2>().minCoeff() < 1e-6 || at.head<2>().maxCoeff() > 0.03 - 1e-6;
      CAPTURE(t, k);
      CHECK(on_open_edge(mesh.view(), corner) == at_rim);
    }
}
