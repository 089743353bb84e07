#include "common/patch/needle.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "common/base/random.hpp"

namespace palpate {
namespace {

constexpr double kStiffnessNM = 1000, kCutN = 0.2, kFrictionNM = 5, kLengthM = 0.04;

NeedleLayers one_layer() {
  NeedleLayers layers;
  layers.count = 1;
  layers.length_m = kLengthM;
  layers.of[0] = {0, 0.6, kCutN, kFrictionNM};
  return layers;
}

NeedleLayers two_layers(double begins_m) {
  NeedleLayers layers = one_layer();
  layers.count = 2;
  layers.of[1] = {begins_m, 0.9, 3 * kCutN, kFrictionNM};
  return layers;
}

/// A needle in a body that does not move: material points x(s) = s down the path, the tip at `way`.
struct FixedBody {
  NeedleLayers layers;
  NeedleTip tip{true, 0, 0, 0};
  std::array<double, kNeedlePoints> bond{};
  std::array<bool, kNeedlePoints> reached{};
  double push_n = 0, drag_n = 0;

  /// Along the path, z of the tool opposite to it.
  void move_to(double way_m) {
    const Vec3 t = Vec3::UnitX(), axis = -t;
    push_n = drag_n = 0;
    for (int k = 0; k < 4 && tip.inside; ++k) {
      const PathClosure closure =
          close_on_path(Vec3((way_m - tip.depth_m) * t), Mat3::Zero(), t, tip_contact(layers, tip, kStiffnessNM));
      push_n = closure.lambda.dot(t);
      if (closure.slip_m == 0) break;
      move_tip(layers, tip, closure.slip_m);
    }
    for (int j = 0; j < kNeedlePoints; ++j) {
      const auto at = static_cast<std::size_t>(j);
      const double share_m = shaft_share(layers, tip, j).length_m, place_m = j * layers.spacing_m();
      if (share_m > 0 && !reached[at]) bond[at] = axis.dot(Vec3((place_m - way_m) * t));
      reached[at] = share_m > 0;
      if (!reached[at]) continue;
      const Vec3 gap = (way_m - place_m) * t + bond[at] * axis;
      const PathClosure closure =
          close_on_path(gap, Mat3::Zero(), axis, shaft_contact(layers, shaft_share(layers, tip, j), kStiffnessNM));
      bond[at] -= closure.slip_m;
      drag_n += closure.lambda.dot(t);
    }
  }
};

TEST_CASE("The lengths of shaft that the points of a path stand for are together the depth of the tip") {
  const NeedleLayers layers = one_layer();
  for (const double depth_m : {0.0, 0.001, 0.0173, 0.04}) {
    double sum_m = 0;
    for (int j = 0; j < kNeedlePoints; ++j) {
      const double share_m = shaft_share(layers, {true, depth_m, depth_m, 0}, j).length_m;
      CHECK(share_m >= 0);
      sum_m += share_m;
    }
    CHECK(sum_m == Approx(depth_m).margin(1e-15));
  }
}

TEST_CASE(
    "A needle that crosses a gap feels nothing there but its friction in tissue, punctures the far lip anew, and comes out of "
    "it") {
  NeedleLayers layers = one_layer();
  layers.count = 4;
  layers.of[1] = {0.01, 0, 0, 0};
  layers.of[2] = {0.018, 0.6, kCutN, 2 * kFrictionNM};
  layers.of[3] = {0.03, 0, 0, 0};
  FixedBody body{layers};
  double most_at_lip_n = 0;
  for (double way_m = 0; way_m < 0.038; way_m += 1e-5) {
    body.move_to(way_m);
    const double depth_m = body.tip.depth_m, first_m = std::min(depth_m, 0.01),
                 second_m = std::clamp(depth_m - 0.018, 0.0, 0.012);
    CAPTURE(way_m, depth_m);
    double held_m = 0, friction_n = 0;
    for (int j = 0; j < kNeedlePoints; ++j) {
      held_m += shaft_share(layers, body.tip, j).length_m;
      friction_n += shaft_share(layers, body.tip, j).friction_n;
    }
    CHECK(held_m == Approx(first_m + second_m).margin(1e-15));
    CHECK(friction_n == Approx(kFrictionNM * first_m + 2 * kFrictionNM * second_m).margin(1e-15));
    if (depth_m > 0.0102 && depth_m < 0.0178) CHECK(body.push_n == 0);
    if (depth_m > 0.0182 && depth_m < 0.0298) CHECK(body.push_n == Approx(kCutN).margin(1e-12));
    if (depth_m > 0.0302) CHECK(body.push_n == 0);
    if (std::abs(depth_m - 0.018) < 1e-9) most_at_lip_n = std::max(most_at_lip_n, body.push_n);
  }
  CHECK(body.tip.layer == 3);
  CHECK(most_at_lip_n == Approx(0.6).epsilon(0.02));
}

TEST_CASE("A tip that is inside but not pushed enough to cut stays inside, and leaves where it is pulled") {
  const NeedleLayers layers = one_layer();
  NeedleTip tip{true, 0, 0, 0};
  move_tip(layers, tip, 0);
  CHECK(tip.inside);
  CHECK(tip.depth_m == 0);
  move_tip(layers, tip, -1e-6);
  CHECK_FALSE(tip.inside);
}

TEST_CASE("A tip that is pushed steadily bears the toughness times its width, and its shaft the friction of its length") {
  FixedBody body{one_layer()};
  for (int k = 1; k <= 300; ++k) body.move_to(1e-4 * k);
  CHECK(body.push_n == Approx(kCutN));
  CHECK(body.tip.front_m == Approx(0.030 - kCutN / kStiffnessNM));
  CHECK(body.drag_n == Approx(kFrictionNM * body.tip.depth_m).epsilon(0.02));  // what was reached last still sticks
  for (int k = 299; k >= 100; --k) body.move_to(1e-4 * k);
  CHECK(body.push_n == Approx(0).margin(1e-12));
  CHECK(body.tip.front_m == Approx(0.030 - kCutN / kStiffnessNM));
  CHECK(body.tip.depth_m == Approx(0.010));
  CHECK(body.drag_n == Approx(-kFrictionNM * 0.010));
}

TEST_CASE("A tip slides in its own cut without resistance, and cuts on where it ended") {
  FixedBody body{one_layer()};
  for (int k = 1; k <= 200; ++k) body.move_to(1e-4 * k);
  for (int k = 199; k >= 50; --k) body.move_to(1e-4 * k);
  for (int k = 50; k <= 190; ++k) {
    body.move_to(1e-4 * k);
    CHECK(body.push_n == Approx(0).margin(1e-12));
  }
  for (int k = 190; k <= 250; ++k) body.move_to(1e-4 * k);
  CHECK(body.push_n == Approx(kCutN));
}

TEST_CASE("A tip opens a layer where it is pushed by more than that bears, and the push falls to what cutting takes") {
  constexpr double kBeginsM = 0.010;
  FixedBody body{two_layers(kBeginsM)};
  double most_n = 0;
  for (int k = 1; k <= 1300; ++k) {
    body.move_to(1e-5 * k);
    if (body.tip.layer == 0) {
      CHECK(body.tip.front_m <= kBeginsM);
      most_n = std::max(most_n, body.push_n);
    }
  }
  CHECK(most_n == Approx(0.9).epsilon(0.02));
  CHECK(body.tip.layer == 1);
  CHECK(body.push_n == Approx(3 * kCutN));
}

TEST_CASE("A tip that is pulled out of the body is outside") {
  FixedBody body{one_layer()};
  for (int k = 1; k <= 100; ++k) body.move_to(1e-4 * k);
  for (int k = 99; k >= -1 && body.tip.inside; --k) body.move_to(1e-4 * k);
  CHECK_FALSE(body.tip.inside);
}

TEST_CASE("The hub of a needle ends its way") {
  FixedBody body{one_layer()};
  for (int k = 1; k <= 450; ++k) body.move_to(1e-4 * k);
  CHECK(body.tip.front_m == kLengthM);
  CHECK(body.push_n == Approx(kStiffnessNM * 0.005));
}

TEST_CASE("What a hand does to a needle, less what its springs hold, only grows, and the front never goes back") {
  Random random(7);
  for (int trial = 0; trial < 20; ++trial) {
    FixedBody body{two_layers(random.uniform(0.002, 0.03))};
    double way_m = 0, spent_j = 0, front_m = 0, dissipated_j = 0;
    const auto stored_j = [&] {
      double sum = 0.5 * body.push_n * body.push_n / kStiffnessNM;
      for (int j = 0; j < kNeedlePoints; ++j) {
        const double share_m = shaft_share(body.layers, body.tip, j).length_m;
        const double most_n = kFrictionNM * share_m;
        if (!(most_n > 0)) continue;
        const double stretch_m = way_m - j * body.layers.spacing_m() - body.bond[static_cast<std::size_t>(j)];
        sum += 0.5 * most_n / kNeedleStickM * stretch_m * stretch_m;
      }
      return sum;
    };
    double goal_m = 0;
    for (int k = 0; k < 4000 && body.tip.inside; ++k) {
      if (k % 200 == 0) goal_m = random.uniform(0.001, 0.035);
      const double step_m = std::clamp(goal_m - way_m, -2e-5, 2e-5), before_n = body.push_n + body.drag_n;
      way_m += step_m;
      body.move_to(way_m);
      spent_j += 0.5 * (before_n + body.push_n + body.drag_n) * step_m;
      CHECK(body.tip.front_m >= front_m);
      front_m = body.tip.front_m;
      const double now_j = spent_j - stored_j();
      CHECK(now_j >= dissipated_j - 2e-6);  // what the shares of a growing length add to the springs is of second order in a step
      dissipated_j = std::max(dissipated_j, now_j);
    }
  }
}

TEST_CASE("A contact on a path between its bounds is a spring in series with the body's compliance") {
  Mat3 c;
  c << 3e-3, 1e-3, 0, 1e-3, 2e-3, 5e-4, 0, 5e-4, 4e-3;
  const Vec3 t = Vec3(1, 2, -1).normalized(), gap(1e-4, -2e-4, 5e-5);
  const PathContact loose{800, 300, -10, 10};
  const Vec3 lambda = close_on_path(gap, c, t, loose).lambda;
  const Mat3 k = 800 * (Mat3::Identity() - t * t.transpose()) + 300 * t * t.transpose();
  CHECK((lambda - k * (gap - c * lambda)).norm() < 1e-12);
  SECTION("beyond a bound its part along the path is the bound, the rest the spring's") {
    PathContact tight = loose;
    tight.least_n = t.dot(lambda) + 0.01;
    tight.most_n = 10;
    const PathClosure closure = close_on_path(gap, c, t, tight);
    CHECK(t.dot(closure.lambda) == Approx(tight.least_n));
    const Vec3 rest = gap - c * closure.lambda - closure.slip_m * t;
    CHECK((closure.lambda - k * rest).norm() < 1e-12);
  }
}

}  // namespace
}  // namespace palpate
