// Static indentations against the port responses from which they start, against the equation that they solve, and against those
// of the whole body.
#include "server/reduction/static_indentation.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <catch2/catch.hpp>

#include "tests/support/bodies.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

constexpr double kIndentationShift = 20;

/// A body at rest, a port in the middle of its top, and the responses P^-1 B there.
struct Pressed {
  LumpedBody body;
  Dynamics dynamics{body};
  Skin skin{body};
  BodyState state = dynamics.rest_state();
  WholeBody whole{dynamics, state};
  Linearisation at{whole, body.fixed};
  SurfacePoint point;
  ShiftedSolver solver{dynamics};
  std::vector<Vector> responses;
  IndentationRequest request;

  Pressed(const Pressed&) = delete;
  explicit Pressed(LumpedBody b) : body(std::move(b)) {
    const std::vector<double> positions = skin.place(state.x);
    const Vec3 corner = body.nodes.back();
    point = nearest_point(skin.view(), positions, Vec3(0.5 * corner.x() + 0.002, 0.5 * corner.y() + 0.001, corner.z())).point;
    request.port = skin.weights(point);
    request.shift_1_s = kIndentationShift;
    REQUIRE(solver.prepare(at, kIndentationShift, false));
    request.diagonal = solver.diagonal();
    for (int axis = 0; axis < 3; ++axis) {
      Vector load = Vector::Zero(state.x.size());
      scatter(request.port, Vec3::Unit(axis), load);
      mask(body.fixed, load);
      responses.push_back(Vector::Zero(state.x.size()));
      REQUIRE(solver.solve(at, load, 1e-9, responses.back()));
    }
    request.responses = responses;
  }
  Mat3 compliance() const {
    Mat3 c;
    for (int axis = 0; axis < 3; ++axis) c.col(axis) = gather(request.port, responses[static_cast<std::size_t>(axis)]);
    return c;
  }
  double kappa() const { return 3 * StaticIndentations::kHandStiffnessRatio / compliance().trace(); }
  /// s^2 M w - [F(x* + w, s w) - F(x*, 0)] - B f, and B f.
  std::pair<Vector, Vector> left(const Vector& w, const Vec3& displacement) const {
    Vector there, here, load = Vector::Zero(w.size());
    dynamics.forces(state.x + w, kIndentationShift * w, there);
    dynamics.forces(state.x, Vector::Zero(w.size()), here);
    scatter(request.port, kappa() * (displacement - gather(request.port, w)), load);
    Vector left = kIndentationShift * kIndentationShift * dynamics.masses().cwiseProduct(w) - (there - here) - load;
    mask(body.fixed, left);
    mask(body.fixed, load);
    return {left, load};
  }
};

LumpedBody stiffening_box(int nx, int ny, int nz) {
  LumpedBody body = box_body(nx, ny, nz);
  body.law = SpringLaw::stiffening;
  body.stiffening = 30;
  return body;
}

}  // namespace

TEST_CASE("A shallow indentation is the linear response of the port") {
  const Vec3 displacement(2e-7, 1e-7, -1e-6);
  for (const int nodes : {5, 12}) {
    Pressed pressed(stiffening_box(nodes, nodes, 6));
    pressed.request.displacements = {displacement};
    const auto found = StaticIndentations(pressed.body).shapes(pressed.at, pressed.request);
    REQUIRE(found.size() == 1);
    const Vec3 f = (pressed.compliance() + Mat3::Identity() / pressed.kappa()).inverse() * displacement;
    Vector linear = Vector::Zero(found[0].size());
    for (int axis = 0; axis < 3; ++axis) linear += f[axis] * pressed.responses[static_cast<std::size_t>(axis)];
    CHECK((found[0] - linear).norm() < 0.01 * linear.norm());
  }
}

TEST_CASE(
    "An indentation as deep as elements are long solves its equation to a tenth of the load, where the linear response is off by "
    "half") {
  Pressed pressed(stiffening_box(6, 6, 5));
  REQUIRE(pressed.body.nodes.size() < StaticIndentations::kSubdomainNodes);
  pressed.request.displacements = {Vec3(0, 0, -0.004), Vec3(0.001, 0, -0.012)};
  const auto found = StaticIndentations(pressed.body).shapes(pressed.at, pressed.request);
  REQUIRE(found.size() == 2);
  for (std::size_t k = 0; k < 2; ++k) {
    const Vec3& displacement = pressed.request.displacements[k];
    const auto [left, load] = pressed.left(found[k], displacement);
    CHECK(left.norm() < 0.1 * load.norm());
    CHECK(-gather(pressed.request.port, found[k]).z() > 0.3 * displacement.norm());
  }
  const Vec3 f = (pressed.compliance() + Mat3::Identity() / pressed.kappa()).inverse() * pressed.request.displacements[1];
  Vector linear = Vector::Zero(found[1].size());
  for (int axis = 0; axis < 3; ++axis) linear += f[axis] * pressed.responses[static_cast<std::size_t>(axis)];
  const auto [left, load] = pressed.left(linear, pressed.request.displacements[1]);
  CHECK(left.norm() > 0.5 * load.norm());
}

TEST_CASE("An indentation of a solid of finite elements solves its equation to a tenth of the load") {
  const SolidMaterial soft{SolidLaw::neo_hookean, 8e3, 0.45, 0.01};
  Pressed pressed(GENERATE_COPY(solid_box(5, 5, 4, soft), hexa_box(5, 5, 4, soft)));
  REQUIRE(pressed.body.nodes.size() < StaticIndentations::kSolidSubdomainNodes);
  pressed.request.displacements = {Vec3(0, 0, -0.004), Vec3(0.001, 0, -0.012)};
  const auto found = StaticIndentations(pressed.body).shapes(pressed.at, pressed.request);
  REQUIRE(found.size() == 2);
  for (std::size_t k = 0; k < 2; ++k) {
    const auto [left, load] = pressed.left(found[k], pressed.request.displacements[k]);
    CHECK(left.norm() < 0.1 * load.norm());
  }
}

TEST_CASE("Of a body larger than its nonlinear subdomain the indentation is one of all of it, to a tenth") {
  Pressed pressed(stiffening_box(13, 13, 7));
  REQUIRE(pressed.body.nodes.size() > 3 * StaticIndentations::kSubdomainNodes);
  const Vec3 displacement(0, 0, -0.008);
  pressed.request.displacements = {0.25 * displacement, displacement};
  const auto found = StaticIndentations(pressed.body).shapes(pressed.at, pressed.request);
  REQUIRE(found.size() == 2);
  // All nodes, by steepest descent in the metric of P from there until the equation holds.
  ShiftedSolver solver(pressed.dynamics);
  Vector w = found[1];
  Vector first_guess = Vector::Zero(w.size());
  REQUIRE(solver.prepare(pressed.at, kIndentationShift, false));
  for (int k = 0; k < 400; ++k) {
    const Vector left = -pressed.left(w, displacement).first;
    if (left.norm() < 1e-4 * pressed.left(w, displacement).second.norm()) break;
    Vector step = first_guess;
    REQUIRE(solver.solve(pressed.at, left, 1e-6, step));
    const double pull = step.dot(left), there = -step.dot(pressed.left(w + 0.1 * step, displacement).first);
    w += 0.1 * std::clamp(pull / (pull - there), 0.1, 10.0) * step;
  }
  const auto [left, load] = pressed.left(w, displacement);
  REQUIRE(left.norm() < 1e-3 * load.norm());
  CHECK((found[1] - w).norm() < 0.1 * w.norm());
}

TEST_CASE("Where the body is fixed there is no indentation") {
  Pressed pressed(stiffening_box(5, 5, 4));
  pressed.point = nearest_point(pressed.skin.view(), pressed.skin.place(pressed.state.x), Vec3(0.03, 0.03, -0.001)).point;
  pressed.request.port = pressed.skin.weights(pressed.point);
  const std::vector<Vector> nothing(3, Vector::Zero(pressed.state.x.size()));
  pressed.request.responses = nothing;
  pressed.request.displacements = {Vec3(0, 0, 0.005)};
  CHECK(StaticIndentations(pressed.body).shapes(pressed.at, pressed.request).empty());
}

TEST_CASE("What a body cannot follow is left out, and no number that is none comes back") {
  Pressed pressed(stiffening_box(5, 5, 4));
  pressed.request.displacements = {Vec3(0, 0, -0.005), Vec3(0, 0, -1e200)};
  for (const Vector& w : StaticIndentations(pressed.body).shapes(pressed.at, pressed.request)) CHECK(w.allFinite());
}
