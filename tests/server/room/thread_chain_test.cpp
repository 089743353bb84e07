// A thread as it is seen: its free part, a catenary, its length, and a hand that pulls it straight; its spans.
#include <catch2/catch.hpp>
#include <cmath>

#include "server/body/skin.hpp"
#include "server/body/unload.hpp"
#include "server/room/drawn_threads.hpp"

using namespace palpate;

namespace {

constexpr double kLengthM = 0.15;
const Vec3 kGravity(0, 0, -9.81);

double longest_error(const ThreadChain& chain, double length_m) {
  const auto& x = chain.points();
  const double segment_m = length_m / static_cast<double>(x.size() - 1);
  double most = 0;
  for (std::size_t i = 0; i + 1 < x.size(); ++i) most = std::max(most, std::abs((x[i + 1] - x[i]).norm() / segment_m - 1));
  return most;
}

}  // namespace

TEST_CASE("A thread that hangs between two ends is a catenary, and as long as it is to 0.1 %") {
  const Vec3 from(0.01, 0.02, 0.1), to(0.1, 0.02, 0.1);
  ThreadChain chain(from, (to - from).normalized(), kLengthM);
  for (int frame = 0; frame < 100; ++frame) {
    chain.advance(0.05, from, to, kLengthM, kGravity);
    CHECK(longest_error(chain, kLengthM) < 1e-3);
  }
  // L = 2 a sinh(D / 2 a), sag a (cosh(D / 2 a) - 1)
  const double span = (to - from).norm();
  double low = 1e-3, high = 10;
  for (int k = 0; k < 200; ++k) {
    const double a = 0.5 * (low + high);
    (2 * a * std::sinh(span / (2 * a)) > kLengthM ? low : high) = a;
  }
  const double a = low, middle = 0.5 * (from.x() + to.x()), bottom = from.z() - a * (std::cosh(span / (2 * a)) - 1);
  for (const Vec3& x : chain.points()) CHECK(x.z() == Approx(bottom + a * (std::cosh((x.x() - middle) / a) - 1)).margin(3e-4));
}

TEST_CASE("A thread whose hand pulls it straight lies between bite and hand, and a free one hangs down") {
  const Vec3 bite(0, 0, 0.2), hand(0.02, 0.01, 0.36);
  ThreadChain chain(bite, Vec3::UnitX(), kLengthM);
  chain.advance(0.05, bite, hand, kLengthM, kGravity);
  for (const Vec3& x : chain.points()) CHECK((x - bite).cross(hand - bite).norm() < 1e-9);
  for (int frame = 0; frame < 200; ++frame) chain.advance(0.05, bite, std::nullopt, kLengthM, kGravity);
  CHECK((chain.points().back() - bite - Vec3(0, 0, -kLengthM)).norm() < 2e-3);
  CHECK(longest_error(chain, kLengthM) < 1e-3);
}

TEST_CASE("A thread that is paid out keeps its length, whatever a hand does") {
  const Vec3 bite(0, 0, 0);
  ThreadChain chain(bite, Vec3::UnitX(), 0.05);
  for (int frame = 0; frame < 200; ++frame) {
    const double t = 0.05 * frame, length_m = 0.05 + 0.0005 * frame;
    const Vec3 hand = 0.4 * length_m * Vec3(std::cos(7 * t), std::sin(7 * t), std::sin(5 * t));
    chain.advance(0.05, bite, hand, length_m, kGravity);
    CHECK(longest_error(chain, length_m) < 1e-3);
    CHECK((chain.points().back() - hand).norm() < 1e-12);
  }
}

TEST_CASE("Spans between bites in the body are drawn over its surface") {
  const Scene scene = open_scene(std::string(PALPATE_SOURCE_DIR) + "/scenes/cuts/stitches.json");
  const Dynamics dynamics(scene.body);
  const Skin skin(scene.body);
  DrawnThreads threads(scene.body);
  threads.advance(dynamics, dynamics.rest_state());
  std::vector<Vec3> rings;
  threads.append(rings);
  const std::size_t each = rings.size() / scene.body.sutures.size(), first_tail = 5, span = 4, sides = 4;
  for (std::size_t k = 0; k < scene.body.sutures.size(); ++k) {
    const Suture& suture = scene.body.sutures[k];
    for (const SutureBite& bite : suture.bites) CHECK(skin.nearest(0, skin.rest(), bite.rest).height_m < -suture.radius_m);
    for (std::size_t i = first_tail; i < first_tail + span; ++i) {
      Vec3 middle = Vec3::Zero();
      for (std::size_t s = 0; s < sides; ++s) middle += rings[k * each + sides * i + s] / sides;
      CHECK(skin.nearest(0, skin.rest(), middle).height_m > 0.5 * suture.radius_m);
    }
  }
}
