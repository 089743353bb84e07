// Rollouts of bodies whose own integrator is too costly: their accuracy, their cost limits, and their use by patches.
#include "server/room/rollout_integrator.hpp"

#include <Eigen/QR>
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <optional>
#include <utility>

#include "common/base/minimum_jerk.hpp"
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
  steps.allow(1);
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
  steps.allow(1e-3);
  CHECK_FALSE(steps.advance(p.state, p.ports, 0.01, p.tool(), 1000));
  CHECK(p.state.time_s == 0);
  const auto steps_taken = [&] {
    int taken = 0;
    while (taken < 1000 && steps.advance(p.state, p.ports, p.state.time_s + 1e-3, p.tool(), 1)) ++taken;
    return taken;
  };
  const int first = steps_taken();
  CHECK(first > 0);
  CHECK(first < 100);
  steps.begin();  // a frame that spent all leaves the next one all
  CHECK(steps_taken() > 0);
}

TEST_CASE("An integrator that may take few iterations gives up before its next step and says so") {
  Pulled p;
  Integrator integrator(p.dynamics, p.skin, {.step_s = 1e-3, .most_iterations = 20});
  const AdvanceReport report = integrator.advance(p.state, p.ports, kOverS, p.tool());
  CHECK_FALSE(report.converged);
  CHECK(report.steps > 0);
  CHECK(p.state.time_s == Approx(1e-3 * report.steps));
}

namespace {

constexpr Micros kRolloutFrame{50'000};

/// Returns the inputs of the patch of frame `at`, and then of frame `end`, of a hand on its way.
std::pair<Room::Origin, Room::Origin> patches_on_the_way(const Scene& scene, const std::function<Vec3(double)>& hand, int at,
                                                         int end, bool rollouts) {
  Room room(scene);
  const Micros begin{7'000'000};
  room.start(begin);
  std::optional<Room::Origin> then;
  for (int k = 0; k <= end; ++k) {
    FrameJob job;
    job.begin = begin + k * kRolloutFrame;
    job.target = job.begin + kRolloutFrame;
    job.rollouts = rollouts;
    StationJob station;
    station.id = kRoughHand;
    station.scheme = Scheme::hyper;
    station.horizon = Micros{200'000};
    for (Micros t = job.begin + Micros{1000}; t <= job.target + Micros{1000}; t += Micros{1000})
      station.samples.push_back({t, hand(seconds(t - begin))});
    job.stations.push_back(station);
    REQUIRE_FALSE(room.run(job).failed);
    if (k == at) then = room.origin(kRoughHand);
  }
  return {*then, *room.origin(kRoughHand)};
}

/// Share of the body's displacement that the modes of the earlier patch cannot represent; `held`: a node of a tool.
double missed(const std::pair<Room::Origin, Room::Origin>& on_the_way, std::optional<std::uint32_t> held) {
  const auto& [then, later] = on_the_way;
  Vector displacement = later.body.x - then.body.x;
  if (held) displacement.segment<3>(3 * static_cast<Eigen::Index>(*held)).setZero();  // not the modes' part
  const Eigen::ColPivHouseholderQR<Matrix> qr(then.modes);
  return (displacement - then.modes * qr.solve(displacement)).norm() / displacement.norm();
}

}  // namespace

TEST_CASE("The modes of a solid that a hand moves hold where it will be when the patch ends") {
  const Scene scene = soft_solid();
  const auto hand = [&](double t) { return Vec3(home_of(scene) + 0.12 * t * Vec3(0.8, 0, 0.6)); };
  const double left = missed(patches_on_the_way(scene, hand, 2, 6, true), scene.tool.node);  // 4e-3 for a patch without rollouts
  CAPTURE(left);
  CHECK(left < 1e-3);
}

TEST_CASE("The modes of a solid at rest hold where a hand that is about to press it will take it") {
  Scene scene = soft_solid();
  scene.tool.contact = ContactKind::touch;
  constexpr double kGapM = 0.001, kDeepM = 0.012, kRestS = 0.1, kInS = 0.2;
  const double above = home_of(scene).z() - 0.02 + kGapM;
  const auto hand = [&](double t) {
    const Vec3 home = home_of(scene);
    return Vec3(home.x() + 0.003, home.y() + 0.002, above - kDeepM * minimum_jerk((t - kRestS) / kInS));
  };
  const double with = missed(patches_on_the_way(scene, hand, 1, 5, true), std::nullopt);
  const double without = missed(patches_on_the_way(scene, hand, 1, 5, false), std::nullopt);
  CAPTURE(with, without);
  CHECK(with < 0.5 * without);
}
