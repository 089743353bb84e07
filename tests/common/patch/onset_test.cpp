// Onset of a touch: the side of a thin body that a tool meets, whichever passes the other and however the body is folded.
#include "common/patch/onset.hpp"

#include <Eigen/Geometry>
#include <catch2/catch.hpp>
#include <cmath>

#include "common/base/random.hpp"
#include "common/patch/contact_law.hpp"

using namespace palpate;

namespace {

constexpr int kPlateCells = 8;
constexpr double kPlateCellM = 0.01;

/// A closed plate of kPlateCells x kPlateCells cells, its upper side at z = 0, its lower side `thick_m` below.
struct Plate {
  std::vector<double> x;
  Surface surface;

  explicit Plate(double thick_m) {
    constexpr int n = kPlateCells + 1;
    for (const double z : {-thick_m, 0.0})
      for (int j = 0; j < n; ++j)
        for (int i = 0; i < n; ++i) x.insert(x.end(), {kPlateCellM * i, kPlateCellM * j, z});
    const auto id = [](int i, int j, int up) { return static_cast<std::uint32_t>(i + n * (j + n * up)); };
    std::vector<Triangle> triangles;
    const auto quad = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
      triangles.push_back({a, b, c});
      triangles.push_back({a, c, d});
    };
    for (int j = 0; j < kPlateCells; ++j)
      for (int i = 0; i < kPlateCells; ++i) {
        quad(id(i, j, 1), id(i + 1, j, 1), id(i + 1, j + 1, 1), id(i, j + 1, 1));
        quad(id(i, j, 0), id(i, j + 1, 0), id(i + 1, j + 1, 0), id(i + 1, j, 0));
      }
    for (int k = 0; k < kPlateCells; ++k) {
      quad(id(k, 0, 0), id(k + 1, 0, 0), id(k + 1, 0, 1), id(k, 0, 1));
      quad(id(kPlateCells, k, 0), id(kPlateCells, k + 1, 0), id(kPlateCells, k + 1, 1), id(kPlateCells, k, 1));
      quad(id(k + 1, kPlateCells, 0), id(k, kPlateCells, 0), id(k, kPlateCells, 1), id(k + 1, kPlateCells, 1));
      quad(id(0, k + 1, 0), id(0, k, 0), id(0, k, 1), id(0, k + 1, 1));
    }
    surface = Surface(std::move(triangles), x.size() / 3);
  }
  /// Moves the inner vertices of the upper or of the lower side to height z.
  void put(bool upper, double z) {
    constexpr int n = kPlateCells + 1;
    for (int j = 2; j + 2 < n; ++j)
      for (int i = 2; i + 2 < n; ++i) x[3 * static_cast<std::size_t>(i + n * (j + n * (upper ? 1 : 0))) + 2] = z;
  }
  Onset look(const Vec3& tool, Clearance& clearance) const { return look_for_contact(surface.view(), x, tool, 0, clearance); }
};

const Vec3 kOverVertex(0.04, 0.04, 0), kOverTriangle(0.0417, 0.0438, 0);

}  // namespace

TEST_CASE("A tool that comes deep into a thin plate within a step touches the side that it came through") {
  const Plate plate(0.004);
  const Vec3 over = GENERATE(kOverVertex, kOverTriangle);
  const double deep_m = GENERATE(0.001, 0.003, 0.006);  // near the upper side, near the lower one, out below it
  Clearance clearance;
  REQUIRE_FALSE(plate.look(over + Vec3(0, 0, 0.001), clearance).touches);
  const Onset onset = plate.look(over - Vec3(0, 0, deep_m), clearance);
  CAPTURE(over.x(), deep_m);
  REQUIRE(onset.touches);
  CHECK(onset.nearest.normal.z() == Approx(1));
  CHECK((onset.nearest.position - over).norm() < 1e-12);
  CHECK(onset.nearest.height_m == Approx(-deep_m));
}

TEST_CASE("A side that comes over a tool from behind touches it, though the body is inside out there") {
  Plate plate(0.004);
  const Vec3 over = GENERATE(kOverVertex, kOverTriangle);
  plate.put(true, -0.020);  // the upper side is pressed through the lower one
  Clearance clearance;
  const Vec3 tool = over - Vec3(0, 0, 0.0195);
  REQUIRE_FALSE(plate.look(tool, clearance).touches);
  plate.put(true, -0.0194);
  const Onset onset = plate.look(tool, clearance);
  REQUIRE(onset.touches);
  CHECK(onset.nearest.normal.z() == Approx(1));
  CHECK(onset.nearest.position.z() == Approx(-0.0194));
}

TEST_CASE("A tool that leaves a body that is inside out goes out through the other side untouched") {
  Plate plate(0.004);
  const Vec3 over = GENERATE(kOverVertex, kOverTriangle);
  plate.put(true, -0.020);
  Clearance clearance;
  // From just above the upper side, which is the lower one here, to above both.
  for (int step = 0; step <= 60; ++step) {
    CAPTURE(over.x(), step);
    CHECK_FALSE(plate.look(over + Vec3(0, 0, -0.0195 + 0.0005 * step), clearance).touches);
  }
  // No trace is left: the body has returned, and the tool comes down on it.
  plate.put(true, 0);
  const Onset onset = plate.look(over - Vec3(0, 0, 0.0001), clearance = {});
  CHECK(onset.touches);
  CHECK(onset.nearest.normal.z() == Approx(1));
}

TEST_CASE("A side that passes a tool from its back leaves it alone") {
  Plate plate(0.004);
  plate.put(true, -0.020);
  Clearance clearance;
  const Vec3 tool = kOverTriangle - Vec3(0, 0, 0.022);  // below all of it
  REQUIRE_FALSE(plate.look(tool, clearance).touches);
  for (int step = 1; step <= 8; ++step) {
    plate.put(true, -0.020 - 0.0005 * step);
    CHECK_FALSE(plate.look(tool, clearance).touches);
  }
}

TEST_CASE("A tool that has let go of a side is met by it again as soon as it comes back") {
  Plate plate(0.004);
  plate.put(true, -0.020);
  // It ends on the surface itself, as exactly as a step ends.
  const Vec3 tool = kOverTriangle - Vec3(0, 0, 0.020);
  const NearestPoint at = nearest_point(plate.surface.view(), plate.x, tool);
  const double off_m = GENERATE(-2e-7, 0.0, 2e-7);
  Clearance clearance = clearance_of(at.point, Vec3(0, 0, off_m), at.normal);
  plate.put(true, -0.0199);
  const Onset onset = plate.look(tool + Vec3(0, 0, off_m), clearance);
  REQUIRE(onset.touches);
  CHECK(onset.nearest.normal.z() == Approx(1));
  CHECK_FALSE(clearance_of(at.point, Vec3(0, 0, -0.001), at.normal).known);
}

TEST_CASE("Around edges and corners a tool touches where it is inside, and nowhere else") {
  const Plate plate(0.012);
  Random random(7);
  const auto inside = [](const Vec3& p) {
    constexpr double kSide = kPlateCells * kPlateCellM;
    return p.x() > 0 && p.y() > 0 && p.x() < kSide && p.y() < kSide && p.z() < 0 && p.z() > -0.012;
  };
  int onsets = 0;
  Clearance clearance;
  Vec3 tool(0.04, 0.04, 0.01);
  for (int step = 0; step < 20'000; ++step) {
    // Near the corner at (0.08, 0.08, 0), at speeds from zero to 8 mm per step.
    const double size = 0.005 * random.uniform(0, 1);
    const Vec3 way(random.uniform(-size, size), random.uniform(-size, size), random.uniform(-size, size));
    tool = Vec3(0.08, 0.08, 0) + 0.98 * (tool + way - Vec3(0.08, 0.08, 0));
    const bool touches = plate.look(tool, clearance).touches;
    if (touches != inside(tool)) FAIL("at " << tool.transpose());
    onsets += touches;
    if (touches) clearance = {}, tool += Vec3(0.02, 0.01, 0.02);
  }
  CHECK(onsets > 50);
}

TEST_CASE("A sphere that comes down on the facets of a smooth hill or hollow is met without a step of the force") {
  constexpr int kCells = 12;
  constexpr double kCellM = 0.0085, kRadiusM = 0.0055, kStepM = 1e-5, kStiffnessNM = 1000;
  const double bend_1_m = GENERATE(20.0, -20.0, 50.0);  // positive: a hill
  std::vector<double> x;
  std::vector<Triangle> triangles;
  for (int j = 0; j <= kCells; ++j)
    for (int i = 0; i <= kCells; ++i) {
      const double u = kCellM * (i - 0.5 * kCells), v = kCellM * (j - 0.5 * kCells);
      x.insert(x.end(), {u, v, -0.5 * bend_1_m * (u * u + v * v)});
    }
  for (int j = 0; j < kCells; ++j)
    for (int i = 0; i < kCells; ++i) {
      const auto a = static_cast<std::uint32_t>(i + (kCells + 1) * j), c = a + kCells + 2;
      triangles.push_back({a, a + 1, c});
      triangles.push_back({a, c, c - 1});
    }
  const Surface hill(std::move(triangles), x.size() / 3);
  Random random(7);
  for (int place = 0; place < 50; ++place) {
    const Vec3 over(random.uniform(-0.02, 0.02), random.uniform(-0.02, 0.02), 0);
    Clearance clearance;
    for (double z = 0.03;; z -= kStepM) {
      REQUIRE(z > -0.03);
      const Vec3 centre = over + Vec3(0, 0, z);
      const Onset onset = look_for_contact(hill.view(), x, centre, kRadiusM, clearance);
      if (!onset.touches) continue;
      const Vec3 n = onset.nearest.normal;
      const ContactClosure closed =
          close_contact(onset.nearest.position, Mat3::Zero(), n, centre - kRadiusM * n, {kStiffnessNM, 0.3});
      CAPTURE(bend_1_m, over.transpose());
      CHECK(closed.lambda.norm() <= 1.1 * kStiffnessNM * kStepM);
      break;
    }
  }
}
