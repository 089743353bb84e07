// The contact law against its own equations: stick, slip and release.
#include "common/patch/contact_law.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <catch2/catch.hpp>

#include "common/base/random.hpp"

using namespace palpate;

namespace {

Vec3 random_vector(Random& random, double size) {
  const double x = random.uniform(-size, size), y = random.uniform(-size, size), z = random.uniform(-size, size);
  return {x, y, z};
}
/// Symmetric positive definite, anisotropic, about 1 mm/N.
Mat3 random_compliance(Random& random) {
  Mat3 a;
  for (int c = 0; c < 3; ++c) a.col(c) = random_vector(random, 0.03);
  return a * a.transpose() + 1e-5 * Mat3::Identity();
}

}  // namespace

TEST_CASE("With strong friction the point sticks: contact spring, compliance and gap agree") {
  Random random(1);
  for (int trial = 0; trial < 200; ++trial) {
    const Mat3 c = random_compliance(random);
    const Vec3 n = random_vector(random, 1).normalized(), p = random_vector(random, 0.1), tool = p + random_vector(random, 0.01);
    const double k = trial % 2 ? 700 : 0;
    const ContactClosure closure = close_contact(p, c, n, tool, {k, 1e6});
    const Mat3 w = c + (k > 0 ? 1 / k : 0.0) * Mat3::Identity();
    const Vec3 stick = w.inverse() * (tool - p);
    CHECK(closure.touching == (stick.dot(n) < 0 || (tool - p).dot(n) < 0));
    CHECK(closure.slipping == (closure.touching && stick.dot(n) >= 0));
    if (!closure.touching || closure.slipping) continue;
    CHECK(closure.slip.norm() == 0);
    CHECK((closure.lambda - stick).norm() < 1e-3 * stick.norm());  // the rigid floor of 1e-9 m/N
    if (k > 0) CHECK((tool - closure.lambda / k - p - c * closure.lambda).norm() < 1e-14);
  }
}

TEST_CASE("A slipping force lies on the cone, closes the gap along the normal, and the rest is slip along the surface") {
  Random random(2);
  int slipped = 0;
  for (int trial = 0; trial < 500; ++trial) {
    const Mat3 c = random_compliance(random);
    const Vec3 n = random_vector(random, 1).normalized(), p = random_vector(random, 0.1);
    const Vec3 tool = p - 0.005 * n + random_vector(random, 0.01);
    const double mu = random.uniform(0, 0.5), k = 800;
    const ContactClosure closure = close_contact(p, c, n, tool, {k, mu});
    if (!closure.touching) {
      CHECK(closure.lambda.norm() == 0);
      continue;
    }
    const double push = -closure.lambda.dot(n);
    const Vec3 across = closure.lambda + push * n;
    CHECK(push > 0);
    CHECK(across.norm() <= mu * push * (1 + 1e-9) + 1e-12);
    if (!closure.slipping) continue;
    ++slipped;
    const Mat3 w = c + Mat3::Identity() / k;
    CHECK(std::abs(closure.slip.dot(n)) < 1e-12);
    CHECK((p + closure.slip + w * closure.lambda - tool).norm() < 1e-12);
    // Friction pulls towards the direction of the stick force: the tool drags the point along.
    const Vec3 stick = w.inverse() * (tool - p);
    if (across.norm() > 1e-9) CHECK((stick + (-stick.dot(n)) * n).dot(across) > 0);
  }
  CHECK(slipped > 100);
}

TEST_CASE("Without friction the force is along the normal, whatever the compliance") {
  Random random(3);
  for (int trial = 0; trial < 100; ++trial) {
    const Mat3 c = random_compliance(random);
    const Vec3 n = random_vector(random, 1).normalized();
    const Vec3 tool = -0.004 * n + random_vector(random, 0.002);
    const ContactClosure closure = close_contact(Vec3::Zero(), c, n, tool, {500, 0});
    const double expected = std::max(0.0, -tool.dot(n) / (n.dot(c * n) + 1.0 / 500));
    CHECK(closure.touching == (expected > 0));
    CHECK((closure.lambda + expected * n).norm() < 1e-9);
  }
}

TEST_CASE(
    "A tool inside the surface pushes, also where it would pull if the point stuck to it, and its force has no step there") {
  Mat3 c = Mat3::Identity();
  c(0, 2) = c(2, 0) = 0.5;
  c *= 1e-3;
  const auto pressed = [&](double across_m) {
    return close_contact(Vec3::Zero(), c, Vec3::UnitZ(), Vec3(across_m, 0, -0.001), {0, 0.3});
  };
  // Stuck, lambda_z = (-1 mm - across / 2) / (0.75 mm/N): it would pull from -2 mm on.
  for (double across_m = -0.004; across_m < 0; across_m += 1e-5) {
    const ContactClosure closure = pressed(across_m), next = pressed(across_m + 1e-5);
    REQUIRE(closure.touching);
    CHECK(closure.lambda.z() < 0);
    CHECK((closure.lambda - next.lambda).norm() < 0.05);
    // Friction dissipates energy: the tool drags the point in its direction of motion.
    if (closure.slipping) CHECK(closure.slip.dot(closure.lambda) >= -1e-15);
  }
}

TEST_CASE("A tool outside the surface is let go") {
  const Mat3 c = Vec3(1e-3, 2e-3, 3e-3).asDiagonal();
  CHECK_FALSE(close_contact(Vec3::Zero(), c, Vec3::UnitZ(), Vec3(0, 0, 1e-9), {0, 0.5}).touching);
  CHECK_FALSE(close_contact(Vec3::Zero(), c, Vec3::UnitZ(), Vec3(0.01, 0, 0), {0, 0.5}).touching);
  const ContactClosure pressed = close_contact(Vec3::Zero(), c, Vec3::UnitZ(), Vec3(0, 0, -0.004), {1000, 0.5});
  CHECK(pressed.touching);
  CHECK(pressed.lambda.z() == Approx(-1));
}

TEST_CASE("A rigid tool on rigid ground has a large and finite force, and nothing finite comes of a gap that is not") {
  const ContactClosure closure = close_contact(Vec3::Zero(), Mat3::Zero(), Vec3::UnitZ(), Vec3(0, 0, -1e-3), {0, 0.5});
  CHECK(closure.touching);
  CHECK(closure.lambda.allFinite());
  CHECK_FALSE(close_contact(Vec3::Zero(), Mat3::Zero(), Vec3::UnitZ(), Vec3(0, 0, std::nan("")), {0, 0.5}).touching);
}
