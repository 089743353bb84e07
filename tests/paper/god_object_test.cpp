#include "bench/paper/god_object.hpp"

#include <catch2/catch.hpp>

#include "common/base/random.hpp"

using namespace palpate;

namespace {

constexpr double kClose = 10 * GodObject::kClearanceM;

/// A box seen from inside: its triangles are reversed.
RigidBody room(const Vec3& low, const Vec3& high) {
  RigidBody body = box(low, high);
  std::vector<Triangle> turned;
  for (const Triangle& t : body.surface.view().triangles) turned.push_back({t[0], t[2], t[1]});
  body.surface = Surface(turned, 8);
  return body;
}

}  // namespace

TEST_CASE("on a face the proxy is the tool's projection", "[paper]") {
  const RigidBody body = box({-0.1, -0.1, -0.1}, {0.1, 0.1, 0});
  GodObject proxy(body, {0, 0, 0.01});
  Random random(3);
  for (int k = 0; k < 200; ++k) {
    const Vec3 tool(random.uniform(-0.09, 0.09), random.uniform(-0.09, 0.09), random.uniform(-0.05, 0));
    CHECK((proxy.follow(tool) - Vec3(tool.x(), tool.y(), 0)).norm() < kClose);
    CHECK((proxy.force(tool, 500) - Vec3(0, 0, -500 * tool.z())).norm() < 500 * kClose);
  }
  const Vec3 away(0.01, 0.02, 0.03);
  CHECK(proxy.follow(away) == away);
  CHECK(proxy.force(away, 500).norm() == 0);
}

TEST_CASE("inside a room the proxy is the nearest point of the room, in edges and corners too", "[paper]") {
  const Vec3 low(-0.03, -0.02, -0.01), high(0.03, 0.02, 0.01);
  const RigidBody body = room(low, high);
  GodObject proxy(body, Vec3::Zero());
  Random random(5);
  for (int k = 0; k < 500; ++k) {
    const Vec3 tool(random.uniform(-0.06, 0.06), random.uniform(-0.06, 0.06), random.uniform(-0.06, 0.06));
    CHECK((proxy.follow(tool) - tool.cwiseMax(low).cwiseMin(high)).norm() < kClose);
    CHECK(proxy.constraints() <= 3);
  }
}

TEST_CASE("a tool pressed through a plate is pushed back out on the side where it came in", "[paper]") {
  const RigidBody plate = box({-0.02, -0.02, -0.002}, {0.02, 0.02, 0});
  GodObject proxy(plate, {0, 0.001, 0.001});
  const Vec3 through(0, 0.001, -0.0015), beyond(0, 0.001, -0.01);
  proxy.follow(through);
  CHECK(proxy.force(through, 1000).z() == Approx(1.5).margin(1e-3));
  CHECK(penalty_force(plate, through, 1000).z() == Approx(-0.5).margin(1e-9));
  proxy.follow(beyond);
  CHECK(proxy.force(beyond, 1000).z() == Approx(10).margin(1e-3));
  CHECK(penalty_force(plate, beyond, 1000).norm() == 0);
}

TEST_CASE("a proxy never enters the body, whatever the tool does", "[paper]") {
  const Vec3 low(-0.02, -0.02, -0.02), high(0.02, 0.02, 0.02);
  const RigidBody body = box(low, high);
  GodObject proxy(body, {0, 0, 0.05});
  Random random(9);
  for (int k = 0; k < 2000; ++k) {
    const Vec3 tool(random.uniform(-0.04, 0.04), random.uniform(-0.04, 0.04), random.uniform(-0.04, 0.04));
    const Vec3 g = proxy.follow(tool);
    const double inside = (g - low).cwiseMin(high - g).minCoeff();
    CHECK(inside <= 0);
  }
}
