#include "server/room/nodal_fields.hpp"

#include <Eigen/Geometry>
#include <catch2/catch.hpp>

#include "server/room/room.hpp"
#include "tests/support/bodies.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

/// Three nodes in a row, springs of 100 N/m and 50 N/m.
LumpedBody row() {
  LumpedBody body;
  body.nodes = {Vec3(0, 0, 0), Vec3(0.1, 0, 0), Vec3(0.2, 0, 0)};
  body.elements = {{0, 1, 0.1, 100, 0.5}, {1, 2, 0.1, 50, 0.5}};
  return body;
}

}  // namespace

TEST_CASE("tension at a node is the largest force of its elements, pulled or pushed") {
  Vector x(9);
  x << 0, 0, 0, 0.11, 0, 0, 0.19, 0, 0;  // +10 mm, -20 mm
  const auto tension = element_tension(row(), x);
  REQUIRE(tension.size() == 3);
  CHECK(tension[0] == Approx(1.0));
  CHECK(tension[1] == Approx(1.0));
  CHECK(tension[2] == Approx(1.0));
  x[6] = 0.16;  // -50 mm
  const auto more = element_tension(row(), x);
  CHECK(more[0] == Approx(1.0));
  CHECK(more[1] == Approx(2.5));
  CHECK(more[2] == Approx(2.5));
}

TEST_CASE("a stretched block of finite elements has the stress, strain and pressure of its law at every node") {
  constexpr double kStretch = 1.3, kAcross = 0.9;
  const SolidMaterial material{SolidLaw::mooney_rivlin, 8e3, 0.45, 0, 0.3};
  for (LumpedBody body : {solid_box(3, 3, 3, material), hexa_box(3, 3, 3, material)}) {
    body.relaxation = {{0.4, 1.0}};
    const Dynamics dynamics(body);
    BodyState state = dynamics.rest_state();
    Vector& x = state.x;
    const Mat3 f = Eigen::Quaterniond(1, 0.2, 0.1, -0.3).normalized().toRotationMatrix() *
                   Mat3(Vec3(kStretch, kAcross, kAcross).asDiagonal());
    for (std::uint32_t i = 0; i < dynamics.nodes(); ++i) at_node(x, i) = f * body.nodes[i];
    // Mooney-Rivlin: sigma_1 - sigma_2 = 2 (l1^2 - l2^2)(W_1 + W_2 l3^2) / J, whose absolute value is von Mises' stress if two
    // stretches are equal.
    const double mu = 8e3 / 2.9, w1 = 0.35 * mu, w2 = 0.15 * mu, j = kStretch * kAcross * kAcross;
    const double mises = 2 * (kStretch * kStretch - kAcross * kAcross) * (w1 + w2 * kAcross * kAcross) / j;
    for (const float at_node : nodal_field(dynamics, state, ShapeChannel::stress))
      CHECK(static_cast<double>(at_node) == Approx(mises).epsilon(1e-6));
    for (const float at_node : nodal_field(dynamics, state, ShapeChannel::strain))
      CHECK(static_cast<double>(at_node) == Approx(kStretch - 1).epsilon(1e-6));
    dynamics.relaxation().relax_fully(state);
    for (const float at_node : nodal_field(dynamics, state, ShapeChannel::stress))
      CHECK(static_cast<double>(at_node) == Approx(0.6 * mises).epsilon(1e-6));
    state.history.reset();
    // Equal everywhere; under a pure change of volume only the volumetric response contributes.
    for (std::uint32_t i = 0; i < dynamics.nodes(); ++i) at_node(x, i) = 0.98 * body.nodes[i];
    for (const float at_node : nodal_field(dynamics, state, ShapeChannel::pressure))
      CHECK(static_cast<double>(at_node) == Approx(8e3 / (3 * (1 - 2 * 0.45)) * (1 - std::pow(0.98, 3))).epsilon(0.05));
  }
  CHECK(nodal_field(Dynamics(box_body(3, 3, 3)), Dynamics(box_body(3, 3, 3)).rest_state(), ShapeChannel::stress) ==
        std::vector<float>(27, 0.0F));
}

TEST_CASE("a room says tension and support only when asked, and support where its patch has vertices") {
  const Scene scene = load_scene(std::string(PALPATE_SOURCE_DIR) + "/scenes/touch-cube.json");
  Room room(scene);
  room.start(Micros{0});
  const Vec3 home = home_of(scene);
  FrameJob job;
  job.shapes = true;
  StationJob station;
  station.id = 1;
  station.horizon = Micros{100'000};
  FrameResult result;
  const std::vector<float>&tension = result.fields[index_of(ShapeChannel::tension)],
        &support = result.fields[index_of(ShapeChannel::support)];
  for (int frame = 1; frame <= 10; ++frame) {
    job.target = Micros{50'000 * frame};
    station.samples.clear();
    for (Micros t = job.target - Micros{49'000}; t <= job.target; t += Micros{1'000})
      station.samples.push_back({t, home - Vec3(0, 0, 0.05 * seconds(t))});
    job.stations = {station};
    job.fields = frame > 5 ? bit_of(ShapeChannel::tension) | bit_of(ShapeChannel::support) : 0;
    result = room.run(job);
    if (frame <= 5) CHECK((tension.empty() && support.empty()));
  }
  REQUIRE(tension.size() == scene.body.nodes.size());
  REQUIRE(support.size() == scene.body.nodes.size());
  REQUIRE(result.stations[0].patch);
  const auto& patch = *result.stations[0].patch;
  const auto carried = std::count_if(support.begin(), support.end(), [](float s) { return s > 0; });
  CHECK(carried == patch.surface.vertex_count);
  CHECK(*std::max_element(support.begin(), support.end()) == 1);
  if (result.stations[0].contact) CHECK(*std::max_element(tension.begin(), tension.end()) > 0);
}
