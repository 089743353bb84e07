// The skin: the surface as felt by a tip of finite width.
#include "server/body/skin.hpp"

#include <catch2/catch.hpp>

#include "server/dynamics/integrator.hpp"
#include "tests/support/bodies.hpp"

using namespace palpate;
using namespace palpate::test;

TEST_CASE("The skin of a point is the surface itself", "[skin]") {
  const LumpedBody body = box_body(4, 4, 4);
  const Dynamics dynamics(body);
  const Skin skin(body);
  const BodyState state = random_state(dynamics, 3, 0.004, 0);
  const auto x = skin.place(state.x);
  for (const Triangle& t : body.triangles)
    for (const std::uint32_t i : t) CHECK((vertex(x, i) - state.x.segment<3>(3 * static_cast<Eigen::Index>(i))).norm() < 1e-15);
  const auto b = skin.weights({0, Vec3(0.2, 0.3, 0.5)});
  REQUIRE(b.size() == 3);
}

TEST_CASE("A body without a surface is seen where its nodes are", "[skin]") {
  const Scene sheet = load_scene(std::string(PALPATE_SOURCE_DIR) + "/scenes/sheet13.json");
  const Dynamics dynamics(sheet.body);
  const Skin skin(sheet.body);
  REQUIRE(skin.empty());
  const BodyState state = random_state(dynamics, 7, 0.004, 0);
  CHECK(Eigen::Map<const Vector>(skin.place(state.x).data(), state.x.size()) == state.x);
}

TEST_CASE("The skin moves rigidly with the body, rests where the surface rests, and smooths what a single node does", "[skin]") {
  const LumpedBody body = box_body(5, 5, 5);
  const Dynamics dynamics(body);
  const Skin skin(body, 2.5 * kSpacingM);
  BodyState state = dynamics.rest_state();
  const std::uint32_t top = 2 + 5 * (2 + 5 * 4);
  CHECK((vertex(skin.place(state.x), top) - body.nodes[top]).norm() < 1e-15);

  const Vec3 shift(0.01, -0.02, 0.03);
  for (std::uint32_t i = 0; i < dynamics.nodes(); ++i) state.x.segment<3>(3 * static_cast<Eigen::Index>(i)) += shift;
  CHECK((vertex(skin.place(state.x), top) - body.nodes[top] - shift).norm() < 1e-15);

  state = dynamics.rest_state();
  state.x[3 * top + 2] -= 0.010;
  const auto x = skin.place(state.x);
  CHECK(x[3 * top + 2] < body.nodes[top].z());
  CHECK(x[3 * top + 2] > body.nodes[top].z() - 0.005);
  CHECK(x[3 * (top + 1) + 2] < body.nodes[top + 1].z());
}

TEST_CASE("A force on the skin does the work on the nodes that it does on its point, and none is lost", "[skin]") {
  const LumpedBody body = box_body(5, 4, 4);
  const Dynamics dynamics(body);
  const Skin skin(body, 2 * kSpacingM);
  Random random(8);
  for (int trial = 0; trial < 50; ++trial) {
    const auto triangle = static_cast<std::uint32_t>(random.uniform(0, static_cast<double>(body.triangles.size())));
    const double u = random.uniform(), v = random.uniform(0, 1 - u);
    const SurfacePoint point{triangle, Vec3(u, v, 1 - u - v)};
    const auto b = skin.weights(point);
    const BodyState state = random_state(dynamics, static_cast<std::uint64_t>(trial), 0.003, 0.2);
    const Vec3 force = random_vector(random, 2);
    Vector f = Vector::Zero(state.x.size());
    scatter(b, force, f);
    Vec3 sum = Vec3::Zero();
    for (Eigen::Index i = 0; i < f.size(); i += 3) sum += f.segment<3>(i);
    CHECK((sum - force).norm() < 1e-12);
    CHECK(f.dot(state.v) == Approx(force.dot(gather(b, state.v))).margin(1e-12));
    CHECK((skin.position(point, b, state.x) - position_at(skin.view(), skin.place(state.x), point)).norm() < 1e-14);
  }
}

TEST_CASE("A wide tip is met by more of the body than a point", "[skin]") {
  const LumpedBody body = box_body(6, 6, 6);
  const Dynamics dynamics(body);
  const auto press = [&](double radius_m) {
    const Skin skin(body, radius_m);
    Integrator integrator(dynamics, skin, {0.005});
    BodyState state = dynamics.rest_state();
    std::vector<ToolPort> ports(1);
    ports[0].parameters = {1000, 0.3};
    const Vec3 top(0.05, 0.05, 0.1);
    const auto tool = [&](std::size_t, double t) {
      return ToolAt{top - Vec3(0, 0, 0.006 * std::min(1.0, t / 0.3)), Vec3::Zero()};
    };
    REQUIRE(integrator.advance(state, ports, 1.5, tool).converged);
    REQUIRE(ports[0].touching);
    return -ports[0].lambda.z();
  };
  CHECK(press(2.5 * kSpacingM) > 1.2 * press(0));
}

TEST_CASE("The bound of the distance to the skin is never above the distance, and near it far away from a body at rest",
          "[skin]") {
  const LumpedBody body = box_body(5, 4, 4);
  const Dynamics dynamics(body);
  Random random(11);
  for (const double radius_m : {0.0, 2 * kSpacingM}) {
    const Skin skin(body, radius_m);
    for (int trial = 0; trial < 200; ++trial) {
      const BodyState state = random_state(dynamics, static_cast<std::uint64_t>(trial), trial % 2 == 0 ? 0.004 : 0.03, 0);
      const Vec3 point = random_vector(random, 0.2);
      const auto x = skin.place(state.x);
      const NearestPoint nearest = nearest_point(skin.view(), x, point);
      const Vec3 on_skin = skin.position(nearest.point, skin.weights(nearest.point), state.x);
      CHECK(skin.distance_at_least(point, state.x) <= (point - on_skin).norm() + 1e-12);
    }
    const Vec3 above = body.nodes.back() + Vec3(0, 0, 0.3);
    CHECK(skin.distance_at_least(above, dynamics.rest_state().x) == Approx(0.3));
  }
}

TEST_CASE("Each copy of a skin is the skin of its radius alone, and a point that slides stays on its copy", "[skin]") {
  const LumpedBody body = box_body(5, 4, 4);
  const std::array radii{0.03, 0.0, 0.05};
  const Skin all(body, radii);
  Random random(5);
  Vector x(3 * static_cast<Eigen::Index>(body.nodes.size()));
  for (std::uint32_t i = 0; i < body.nodes.size(); ++i)
    at_node(x, i) =
        body.nodes[i] + Vec3(random.uniform(-0.004, 0.004), random.uniform(-0.004, 0.004), random.uniform(-0.004, 0.004));
  const std::vector<double> placed = all.place(x);
  REQUIRE(all.vertices() == body.nodes.size());
  REQUIRE(placed.size() == 3 * x.size() / 3 * radii.size());
  const auto triangles = static_cast<std::uint32_t>(body.triangles.size());
  for (std::uint32_t copy = 0; copy < radii.size(); ++copy) {
    const Skin one(body, radii[copy]);
    const std::vector<double> alone = one.place(x);
    CHECK(std::equal(alone.begin(), alone.end(), placed.begin() + static_cast<std::ptrdiff_t>(copy * alone.size())));
    for (int trial = 0; trial < 20; ++trial) {
      const Vec3 tool(random.uniform(0, 0.08), random.uniform(0, 0.06), random.uniform(0.05, 0.07));
      const NearestPoint a = all.nearest(copy, placed, tool), b = nearest_point(one.view(), alone, tool);
      CHECK(a.point.triangle == b.point.triangle + copy * triangles);
      CHECK(a.height_m == b.height_m);
      CHECK(all.weights(a.point) == one.weights(b.point));
      const SurfacePoint to = slide(all.view(), placed, a.point, Vec3(0.02, 0.01, 0)),
                         alone_to = slide(one.view(), alone, b.point, Vec3(0.02, 0.01, 0));
      CHECK(to.triangle == alone_to.triangle + copy * triangles);
      Clearance clear, alone_clear;
      for (const double down_m : {0.0, 0.004, 0.02}) {  // from outside in
        const Vec3 at = Vec3(tool.x(), tool.y(), 0.068 - down_m);
        const Onset found = all.look_for_contact(copy, placed, at, 0, clear);
        const Onset alone_found = look_for_contact(one.view(), alone, at, 0, alone_clear);
        CHECK(found.touches == alone_found.touches);
        CHECK(found.nearest.point.triangle == alone_found.nearest.point.triangle + copy * triangles);
      }
    }
  }
}
