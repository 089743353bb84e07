// Rollouts of bodies whose own integrator is too costly: their accuracy, their cost limits, and their use by patches.
#include "server/room/rollout_integrator.hpp"

#include <Eigen/QR>
#include <catch2/catch.hpp>
#include <cmath>

#include "server/room/room.hpp"
#include "tests/support/bodies.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

constexpr double kOverS = 0.15, kFarM = 0.015;  // a node of a soft solid is pulled one and a half edges sideways and up
constexpr StationId kRoughHand = 3;

Scene soft_solid(double poisson = 0.3) {
  Scene scene = box_scene(ContactKind::attach);
  scene.body = solid_box(4, 4, 4, {SolidLaw::neo_hookean, 1e4, poisson, 0.01});
  return scene;
}

Vec3 way_at(double t) { return kFarM * std::min(t / kOverS, 1.0) * Vec3(0.8, 0, 0.6); }

struct Pulled {
  explicit Pulled(double poisson = 0.3) : scene(soft_solid(poisson)) {}

  Scene scene;
  Skin skin{scene.body, scene.tool.radius_m};
  Dynamics dynamics{scene.body};
  BodyState state = dynamics.rest_state();
  std::vector<ToolPort> ports = holding(scene.tool.node);

  static std::vector<ToolPort> holding(std::uint32_t node) {
    std::vector<ToolPort> ports(1);
    ports[0].kind = ContactKind::attach;
    ports[0].node = node;
    return ports;
  }

  ToolMotion tool() const {
    return [this](std::size_t, double t) { return ToolAt{scene.body.nodes[scene.tool.node] + way_at(t), way_at(1) / kOverS}; };
  }
};

}  // namespace

TEST_CASE("Rough steps take a solid within a tenth of the way to where steps of a millisecond take it") {
  Pulled rough, fine;
  RolloutIntegrator steps(rough.dynamics, rough.skin);
  constexpr int kSteps = 6;
  REQUIRE(steps.allow(1, kSteps));
  for (int k = 1; k <= kSteps; ++k)
    REQUIRE(steps.advance(rough.state, rough.ports, kOverS * k / kSteps, rough.tool(), kSteps + 1 - k));
  Integrator exact(fine.dynamics, fine.skin, {.step_s = 1e-3});
  REQUIRE(exact.advance(fine.state, fine.ports, kOverS, fine.tool()).converged);
  const Vector displacement = fine.state.x - fine.dynamics.rest_state().x;
  CHECK(rough.state.time_s == Approx(kOverS));
  CHECK((rough.state.x - fine.state.x).norm() < 0.1 * displacement.norm());
}

TEST_CASE("Rough steps end where what they may cost is spent, and none begins that would spend it") {
  Pulled p;
  RolloutIntegrator steps(p.dynamics, p.skin);
  CHECK_FALSE(steps.advance(p.state, p.ports, 0.01, p.tool(), 1));
  CHECK_FALSE(steps.allow(1e-3, 1000));
  CHECK_FALSE(steps.advance(p.state, p.ports, 0.01, p.tool(), 1000));
  CHECK(p.state.time_s == 0);
  int taken = 0;
  while (taken < 1000 && steps.advance(p.state, p.ports, p.state.time_s + 1e-3, p.tool(), 1)) ++taken;
  CHECK(taken > 0);
  CHECK(taken < 100);
}

TEST_CASE("Rough steps know from those before that they would not get to the end for what they may cost") {
  Pulled p(0.495);  // nearly incompressible: its solves take many iterations
  RolloutIntegrator steps(p.dynamics, p.skin);
  double usual_s = 1e-9;
  while (!steps.allow(usual_s, 1)) usual_s *= 1.1;
  CHECK(steps.allow(10 * usual_s, 10));
  CHECK_FALSE(steps.allow(10 * usual_s, 12));
  steps.allow(1, 1);
  for (int k = 1; k <= 3; ++k) REQUIRE(steps.advance(p.state, p.ports, 0.5 * kOverS * k, p.tool(), 1));  // long steps
  CHECK_FALSE(steps.allow(10 * usual_s, 10));
  CHECK(steps.allow(200 * usual_s, 10));
}

TEST_CASE("An integrator that may take few iterations gives up before its next step and says so") {
  Pulled p;
  Integrator integrator(p.dynamics, p.skin, {.step_s = 1e-3, .most_iterations = 20});
  const AdvanceReport report = integrator.advance(p.state, p.ports, kOverS, p.tool());
  CHECK_FALSE(report.converged);
  CHECK(report.steps > 0);
  CHECK(p.state.time_s == Approx(1e-3 * report.steps));
}

TEST_CASE("The modes of a solid that a hand moves hold where it will be when the patch ends") {
  Room room(soft_solid());
  Micros now{7'000'000};
  room.start(now);
  const Vec3 home = home_of(soft_solid());
  constexpr Micros kFrame{50'000}, kHorizon{200'000};
  const auto begin = now;
  std::optional<Room::Origin> then;
  for (int k = 0; k < 7; ++k) {
    FrameJob job;
    job.begin = now;
    job.target = now + kFrame;
    StationJob station;
    station.id = kRoughHand;
    station.scheme = Scheme::hyper;
    station.horizon = kHorizon;
    for (Micros t = now + Micros{1000}; t <= job.target + Micros{1000}; t += Micros{1000})
      station.samples.push_back({t, Vec3(home + 0.12 * seconds(t - begin) * Vec3(0.8, 0, 0.6))});
    job.stations.push_back(station);
    now = job.target;
    REQUIRE_FALSE(room.run(job).failed);
    if (k == 2) then = room.origin(kRoughHand);
  }
  const Vector x = room.origin(kRoughHand)->body.x;
  Vector displacement = x - then->body.x;
  displacement.segment<3>(3 * static_cast<Eigen::Index>(soft_solid().tool.node)).setZero();  // not the modes' part
  const Eigen::ColPivHouseholderQR<Matrix> qr(then->modes);
  const double left =
      (displacement - then->modes * qr.solve(displacement)).norm() / displacement.norm();  // 4e-3 for a patch without rollouts
  CAPTURE(left);
  CHECK(left < 1e-3);
}
