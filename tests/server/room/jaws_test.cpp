// Jaws on a strip: what their friction holds, and where they slip.
#include <catch2/catch.hpp>
#include <cmath>

#include "server/dynamics/integrator.hpp"
#include "server/room/tool_coupling.hpp"
#include "tests/support/bodies.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

constexpr double kJawsMu = 0.5, kJawsStiffness_n_m = 1000, kStripTopM = 0.06, kStripMiddleM = 0.04;

/// A jaw on either side of a strip, 20 mm thick along x, 80 mm along y and 60 mm high. Closed, their faces are upright and 12 mm
/// apart; the hinge is so far that they remain so when they open.
class Pinched {
 public:
  explicit Pinched(double closed) : closed_(closed) {
    ToolSpec jaws;
    for (const double side : {1.0, -1.0})
      for (const double z : {0.004, 0.016}) jaws.shape.push_back({Vec3(side * 0.01, 0, z), 0.004, 0.2, side * 0.1});
    ToolPort port;
    port.parameters = {kJawsStiffness_n_m, kJawsMu};
    ports_ = parts_of(jaws, nullptr, port);
  }
  /// Advances to `until_s`, with the tool raised at 5 mm/s from 0.6 s on.
  void advance(double until_s) {
    const auto tool = [&](std::size_t k, double t) {
      TurningTool at;
      at.at.position = Vec3(0.01, kStripMiddleM, kStripTopM - 0.035 + 0.005 * std::max(0.0, t - 0.6));
      at.opening = std::max(closed_, 0.4 - (0.4 - closed_) * t / 0.4);
      return at.centre_of(ports_[k].sphere);
    };
    REQUIRE(integrator_.advance(state_, ports_, until_s, tool).converged);
  }
  /// Force with which a jaw presses along the normals of the strip [N]; `side`: of its swing.
  double pinch(int side) const {
    double sum = 0;
    for (const ToolPort& port : ports_)
      if (port.touching && port.sphere.swing_rad * side > 0) sum -= port.lambda.dot(normal(port));
    return sum;
  }
  double pull() const {
    double sum = 0;
    for (const ToolPort& port : ports_) sum += port.lambda.z();
    return sum;
  }
  /// Largest share of its friction that a contact uses, and the smallest.
  std::pair<double, double> used() const {
    double most = 0, least = 1;
    for (const ToolPort& port : ports_) {
      if (!port.touching) continue;
      const double along = -port.lambda.dot(normal(port)), across = (port.lambda + along * normal(port)).norm();
      most = std::max(most, across / (kJawsMu * along));
      least = std::min(least, across / (kJawsMu * along));
    }
    return {most, least};
  }
  const std::vector<ToolPort>& ports() const { return ports_; }

 private:
  Vec3 normal(const ToolPort& port) const { return normal_at(skin_.view(), skin_.place(state_.x), port.point); }

  LumpedBody body_ = box_body(2, 5, 4, 400);
  Dynamics dynamics_{body_};
  Skin skin_{body_};
  Integrator integrator_{dynamics_, skin_, {.step_s = 0.005, .tolerance_m = 1e-8}};
  BodyState state_ = dynamics_.rest_state();
  std::vector<ToolPort> ports_;
  double closed_;
};

}  // namespace

TEST_CASE("Jaws that close on a strip press from both sides alike, and hold it still while the pull is within their friction") {
  Pinched jaws(0);
  for (int k = 1; k <= 60; ++k) jaws.advance(0.01 * k);
  const double pinch_n = jaws.pinch(1);
  REQUIRE(pinch_n > 1);
  CHECK(jaws.pinch(-1) == Approx(pinch_n).epsilon(1e-3));
  const std::vector<ToolPort> held = jaws.ports();
  double most_n = 0;
  for (int k = 61; jaws.used().first < 0.8; ++k) {
    jaws.advance(0.01 * k);
    most_n = jaws.pull();
    REQUIRE(k < 1000);
  }
  CHECK(most_n > 0.5 * 2 * kJawsMu * pinch_n);
  for (std::size_t k = 0; k < held.size(); ++k) {
    CHECK(jaws.ports()[k].point.triangle == held[k].point.triangle);
    CHECK((jaws.ports()[k].point.weight - held[k].point.weight).norm() < 1e-3);
  }
}

TEST_CASE("Jaws slip where the pull is twice the friction of a face, however hard they pinch") {
  const double closed = GENERATE(0.0, 0.1);
  Pinched jaws(closed);
  for (int k = 1; k <= 60; ++k) jaws.advance(0.01 * k);
  double most_n = 0, friction_n = 0;
  for (int k = 61; k <= 360; ++k) {
    jaws.advance(0.01 * k);
    CHECK(jaws.used().first < 1 + 1e-4);
    if (jaws.pull() <= most_n) continue;
    most_n = jaws.pull();
    friction_n = kJawsMu * (jaws.pinch(1) + jaws.pinch(-1));
  }
  CAPTURE(jaws.pinch(1), jaws.pull());
  CHECK(most_n == Approx(friction_n).epsilon(0.05));
  CHECK(jaws.used().second > 0.99);  // all slide
}
