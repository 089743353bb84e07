// Where a body may be until the next patches, for a hand that is on its way to it.
#include "server/room/state_prediction.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "tests/support/bodies.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

constexpr Micros kDescentHorizon{200'000}, kDescentFrame{50'000}, kDescentSample{1'000};

/// A hand that comes down on a box, over the middle of its top.
struct Descent {
  Scene scene;
  double speed_m_s, gap_m;

  /// Returns how far each predicted state moves a node at most [m].
  std::vector<double> predicted_m() const {
    SteppedBody body(scene);
    StatePrediction prediction(body);
    const Micros begin{1'000'000};
    body.start(begin);
    FrameJob job;
    job.begin = begin;
    job.target = begin + kDescentFrame;
    job.frame = kDescentFrame;
    StationJob& hand = job.stations.emplace_back();
    hand.id = 1;
    hand.horizon = kDescentHorizon;
    const Vec3 top = middle_of_the_top();
    for (Micros t = begin; t <= job.target; t += kDescentSample)
      hand.samples.push_back({t, top + (gap_m + speed_m_s * seconds(job.target - t)) * Vec3::UnitZ()});
    body.step(job);
    std::vector<double> moved;
    for (const PredictedState& state : prediction.states(kDescentHorizon))
      moved.push_back((state.x - body.state().x).reshaped(3, state.x.size() / 3).colwise().norm().maxCoeff());
    return moved;
  }

 private:
  Vec3 middle_of_the_top() const {
    Vec3 low = scene.body.nodes.front(), high = low;
    for (const Vec3& x : scene.body.nodes) {
      low = low.cwiseMin(x);
      high = high.cwiseMax(x);
    }
    return {0.5 * (low.x() + high.x()), 0.5 * (low.y() + high.y()), high.z()};
  }
};

Scene soft_box(double young_pa) {
  Scene scene = box_scene(ContactKind::touch);
  scene.body = solid_box(4, 4, 4, {SolidLaw::neo_hookean, young_pa, 0.45, 0.01});
  scene.tool.radius_m = 0.01;
  return scene;
}

}  // namespace

TEST_CASE("A hand that presses is predicted to keep its speed, so it deforms a body that it would not reach by braking") {
  // From 12 mm away it goes 8 mm by pressing, and besides 20 mm at its speed; braking it would go 5 mm and stop at the surface.
  const std::vector<double> moved = Descent{soft_box(3e3), 0.1, 0.012}.predicted_m();
  REQUIRE_FALSE(moved.empty());
  CHECK(*std::ranges::max_element(moved) > 0.002);
}

TEST_CASE("A predicted motion that cannot be followed to its end counts as far as it was") {
  const std::size_t whole = Descent{soft_box(1e4), 0.1, 0.01}.predicted_m().size();
  const std::vector<double> part = Descent{soft_box(1e3), 1, 0.01}.predicted_m();  // the steps of the whole motion fail
  REQUIRE_FALSE(part.empty());
  CHECK(part.size() < whole);
  for (const double m : part) CHECK(std::isfinite(m));
  CHECK(*std::ranges::max_element(part) > 0.01);
}
