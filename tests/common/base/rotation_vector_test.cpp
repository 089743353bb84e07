// Rotations against their defining properties.
#include "common/base/rotation_vector.hpp"

#include <catch2/catch.hpp>
#include <numbers>
#include <random>

using namespace palpate;

TEST_CASE("The shortest rotation takes one direction to the other about an axis across both, nearly opposite ones too") {
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  for (int k = 0; k < 1000; ++k) {
    const Vec3 from(normal(random), normal(random), normal(random)), way(normal(random), normal(random), normal(random));
    const Vec3 to = k % 3 == 0 ? way : k % 3 == 1 ? Vec3(from + 1e-6 * way) : Vec3(-2 * from + 1e-5 * way);
    const Rotation turn = shortest_rotation(from, to);
    CHECK(turn.norm() == Approx(1).epsilon(1e-14));
    const double rounding = 1e-14 / (from.normalized() + to.normalized()).norm();  // the axis is lost where they are opposite
    CHECK((turn * from.normalized() - to.normalized()).norm() < rounding);
    const Vec3 v = rotation_vector(turn);
    CHECK(v.norm() == Approx(std::atan2(from.cross(to).norm(), from.dot(to))).epsilon(1e-8).margin(1e-14));
    CHECK(std::abs(v.dot(from)) < rounding * from.norm());
  }
  const Rotation same = shortest_rotation(Vec3(0, 2, 0), Vec3(0, 3, 0)),
                 opposite = shortest_rotation(Vec3(0, 2, 0), Vec3(0, -1, 0));
  CHECK(rotation_vector(same).norm() == 0);
  CHECK(rotation_vector(opposite).norm() == Approx(std::numbers::pi));
  CHECK((opposite * Vec3::UnitY() + Vec3::UnitY()).norm() < 1e-15);
}
