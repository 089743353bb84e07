// The mechanics of a cut body: what its copies add up to, and what a cut lets part.
#include <catch2/catch.hpp>
#include <string>

#include "common/base/random.hpp"
#include "server/body/dynamics.hpp"
#include "server/body/settle.hpp"
#include "server/body/skin.hpp"
#include "server/body/spectrum.hpp"
#include "tests/support/bodies.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

std::string block(const std::string& element, const std::string& rest) {
  return R"({"body": {"lattice": {"nodes": [7, 5, 6], "size_m": [0.06, 0.04, 0.05], "fixed_faces": ["z-"],
    "solid": {"element": ")" +
         element + R"(", "young_pa": 5000, "poisson": 0.4, "damping_s": 0.01}})" + rest + "}}";
}

const std::string kSlanted = R"(, "cuts": [
  {"path": [{"at_m": [0.031, -0.01, 0.06]}, {"at_m": [0.036, 0.02, 0.06]}, {"at_m": [0.028, 0.05, 0.06]}],
   "direction": [0.2, 0.1, -1], "depth_m": 0.041},
  {"path": [{"at_m": [0.01, 0.01, 0.06]}, {"at_m": [0.05, 0.03, 0.06]}], "direction": [0, 0, -1], "depth_m": 0.024}])";

/// A state of the cut body in which new nodes move with those they were copied from: a smooth function of the rest position.
BodyState smooth_state(const Dynamics& dynamics) {
  BodyState state = dynamics.rest_state();
  for (std::uint32_t i = 0; i < dynamics.nodes(); ++i) {
    const Vec3 x = dynamics.body().nodes[i];
    at_node(state.x, i) += Vec3(0.05 * x.z() * x.z() / 0.05, 0.1 * x.x() * x.z() / 0.05, -0.2 * x.z() + 0.5 * x.x() * x.y());
    at_node(state.v, i) = Vec3(x.z(), -x.x() * x.z() * 20, x.y());
  }
  return state;
}

}  // namespace

TEST_CASE("A cut that has not opened changes neither energy nor momentum, and its highest frequency is bounded", "[cuts]") {
  for (const char* const element : {"hexahedron", "tetrahedron"}) {
    INFO(element);
    const Scene uncut = read_scene(block(element, ""), "block.json"), cut = read_scene(block(element, kSlanted), "block.json");
    const Dynamics before(uncut.body), after(cut.body);
    const BodyState a = smooth_state(before), b = smooth_state(after);
    CHECK(after.energy(b) == Approx(before.energy(a)).epsilon(1e-12));
    const Vector p = before.masses().cwiseProduct(a.v), q = after.masses().cwiseProduct(b.v);
    for (int axis = 0; axis < 3; ++axis) {
      const auto along = [axis](const Vector& y) {
        double sum = 0;
        for (Eigen::Index i = axis; i < y.size(); i += 3) sum += y[i];
        return sum;
      };
      CHECK(along(q) == Approx(along(p)).epsilon(1e-12));
    }
    CHECK(spectrum_of(after).w2 <= 2.1 * spectrum_of(before).w2);
  }
}

TEST_CASE("The forces of a cut body are the gradient of its energy", "[cuts]") {
  const Scene cut = read_scene(block("hexahedron", kSlanted), "block.json");
  const Dynamics dynamics(cut.body);
  BodyState state = random_state(dynamics, 5, 0.001, 0);
  Vector forces, way = Vector::Random(state.x.size());
  mask(cut.body.fixed, way);
  dynamics.forces(state.x, state.v, forces);
  constexpr double kStep = 1e-6;
  BodyState ahead = state, behind = state;
  ahead.x += kStep * way;
  behind.x -= kStep * way;
  const double slope = (dynamics.energy(ahead) - dynamics.energy(behind)) / (2 * kStep);
  CHECK(-forces.dot(way) == Approx(slope).epsilon(1e-5));
}

TEST_CASE("A bar cut along its middle bends as two bars of half its height", "[cuts]") {
  // The end x = 0 is held; a load on the other end bends it. The cut runs from the free end to the held one.
  const auto sag = [](const std::string& nodes, double high_m, const std::string& cuts, double load_n) {
    Scene scene =
        read_scene(R"({"body": {"lattice": {"nodes": )" + nodes + R"(, "size_m": [0.12, 0.02, )" + std::to_string(high_m) +
                       R"(], "fixed_faces": ["x-"], "solid": {"young_pa": 100000, "poisson": 0.3}})" + cuts + "}}",
                   "bar.json");
    scene.body.gravity_m_s2 = Vec3(0, 0, -load_n);  // a small uniform acceleration
    const Dynamics dynamics(scene.body);
    const Equilibrium still = find_equilibrium(dynamics);
    REQUIRE(still.found);
    double lowest = 0;
    for (std::uint32_t i = 0; i < dynamics.nodes(); ++i)
      lowest = std::min(lowest, at_node(still.state.x, i).z() - scene.body.nodes[i].z());
    return -lowest;
  };
  const std::string along = R"(, "cuts": [{"path": [{"at_m": [-0.01, -0.01, 0.02]}, {"at_m": [0.13, -0.01, 0.02]}],
    "direction": [0, 1, 0], "depth_m": 0.05}])";
  const double whole = sag("[13, 3, 5]", 0.04, "", 0.02), halves = sag("[13, 3, 5]", 0.04, along, 0.02),
               half = sag("[13, 3, 3]", 0.02, "", 0.02);
  CHECK(half > 3 * whole);
  CHECK(halves == Approx(half).epsilon(0.04));
}

TEST_CASE("Pushing one lip of a cut does not move the other's skin", "[cuts][skin]") {
  const Scene cut = read_scene(block("hexahedron", R"(, "cuts": [{"path": [{"at_m": [0.0347, -0.01, 0.06]},
    {"at_m": [0.0347, 0.05, 0.06]}], "direction": [0, 0, -1], "depth_m": 0.033}])"),
                               "block.json");
  const LumpedBody& body = cut.body;
  const Skin skin(body, 0.012);
  const std::vector<Vec3> rest = vertices_at_rest(body);
  const BodyState still = Dynamics(body).rest_state();
  const std::vector<double> at_rest = skin.place(still.x);
  for (std::uint32_t v = 0; v < rest.size(); ++v) CHECK((vertex(at_rest, v) - rest[v]).norm() < 1e-15);

  int lips = 0;
  for (std::uint32_t t = 0; t < body.triangles.size(); ++t) {
    const Triangle& corners = body.triangles[t];
    const bool top = std::ranges::all_of(corners, [&](std::uint32_t v) { return rest[v].z() > 0.0499; });
    const bool lip = std::ranges::any_of(corners, [&](std::uint32_t v) { return std::abs(rest[v].x() - 0.0347) < 1e-9; });
    if (!top || !lip) continue;
    ++lips;
    const Vec3 middle = (rest[corners[0]] + rest[corners[1]] + rest[corners[2]]) / 3;
    double sum = 0;
    for (const auto& [node, weight] : skin.weights({t, Vec3::Constant(1.0 / 3)})) sum += weight;
    CHECK(sum == Approx(1));
    // Of the nodes that there were before the cut, those of the other side have no part in it.
    constexpr std::uint32_t kBefore = 7 * 5 * 6;
    for (const auto& [node, weight] : skin.weights({t, Vec3::Constant(1.0 / 3)}))
      if (node < kBefore) CHECK((body.nodes[node].x() < 0.0347) == (middle.x() < 0.0347));
  }
  CHECK(lips > 0);
}

TEST_CASE("A cut body at rest holds the points of the uncut one, also beside its walls, where the nearest surface may face away",
          "[cuts][skin]") {
  const Scene cut = read_scene(block("hexahedron", kSlanted), "block.json");
  const Skin skin(cut.body, 0.012);
  Random random(5);
  const Vec3 size(0.06, 0.04, 0.05);
  int ahead_of_a_wall = 0;
  for (int k = 0; k < 2000; ++k) {
    const Vec3 at(random.uniform(-0.1, 1.1) * size.x(), random.uniform(-0.1, 1.1) * size.y(),
                  random.uniform(-0.1, 1.1) * size.z());
    const bool inside = (at.array() > 1e-6).all() && (at.array() < size.array() - 1e-6).all();
    CHECK(skin.holds(at) == inside);
    ahead_of_a_wall += inside && skin.nearest(0, skin.rest(), at).height_m > 0;
  }
  CHECK(ahead_of_a_wall > 10);
}
