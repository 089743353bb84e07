// A touched patch of scheme hyper against the body: pressed, slid on, squeezed.
#include "server/reduction/fit_nonlinear_terms.hpp"

#include <Eigen/LU>
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <initializer_list>
#include <optional>

#include "common/patch/terms_pieces.hpp"
#include "common/player/player.hpp"
#include "server/body/tangents.hpp"
#include "server/dynamics/integrator.hpp"
#include "server/reduction/patch_build.hpp"
#include "server/solve/linear_solver.hpp"
#include "tests/support/bodies.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

/// Further path of a tool that has pressed, u from 0 to 1: deeper and sideways; along the surface.
Vec3 deeper(double u) { return u * u * Vec3(0.003, -0.002, -0.008); }
Vec3 along(double u) { return u * Vec3(0.008, 0, 0); }

/// A tool presses 4 mm into the top of a block in 0.1 s; then a patch is made and the tool moves on.
struct Touch {
  static constexpr double kPressS = 0.1, kOnS = 0.15;
  Micros horizon{200'000};
  int order = 30;  ///< fewer modes than there are snapshots: both schemes have as many

  LumpedBody body = box_body(6, 6, 4);
  Dynamics dynamics;
  Skin skin{body};
  Integrator integrator{dynamics, skin, {0.001, 1e-10}};
  BodyState state = dynamics.rest_state();
  std::vector<ToolPort> ports{1};
  Vec3 (*on)(double);

  Touch(double friction, Vec3 (*go_on)(double), SpringLaw law = SpringLaw::linear, double more_damping = 1)
      : dynamics((body.law = law, body.stiffening = 30, damp(body, more_damping))), on(go_on) {
    ports[0].parameters = {1000, friction};
    to(kPressS);
  }
  Vec3 tool(double t) const {
    const double in = std::min(t / kPressS, 1.0);
    return Vec3(0.048, 0.053, 0.0605 - 0.0045 * in * in * (3 - 2 * in)) + on(std::clamp((t - kPressS) / kOnS, 0.0, 1.0));
  }
  ToolAt tool_at(double t) const {
    constexpr double kSmallS = 1e-4;
    return {tool(t), (tool(t + kSmallS) - tool(t)) / kSmallS};
  }
  void to(double t) {
    REQUIRE(integrator.advance(state, ports, t, [&](std::size_t, double at) { return tool_at(at); }).converged);
  }
  static const LumpedBody& damp(LumpedBody& body, double more) {
    for (Element& e : body.elements) e.damping_n_s_m *= more;
    return body;
  }
  PatchPlayer player(Scheme scheme) {
    const BuiltPatch made = patch(scheme);
    return PatchPlayer(made.patch, made.terms);
  }
  BuiltPatch patch(Scheme scheme, bool whole_surface = true) {
    PatchRequest request;
    request.scheme = scheme;
    request.order = order;
    request.horizon = horizon;
    const ToolAt at = tool_at(kPressS);
    FrameModel frame(dynamics, skin, 0);
    frame.begin(state, ports, std::span(&at, 1), request.horizon);
    auto built = build_patch(frame, 0, request);
    REQUIRE(built);
    const Patch& made = built->patch;
    CHECK(made.scheme == scheme);
    CHECK(check(made) == PatchFault::none);
    CHECK(made.surface.vertex_count <= request.vertices_max(made.modes(), false, 0, 0));
    const Patch joined = extended(made, built->terms);
    CHECK(check(joined) == PatchFault::none);
    CHECK(made.has_terms);
    CHECK((built->terms.elements.count() == 0) == (scheme == Scheme::port));
    if (whole_surface) CHECK(joined.surface.vertex_count == kMaxPortVertices);
    return *built;
  }
  /// Energy of the force's error over that of the force in the 150 ms after the patch: linear, and with its terms.
  std::array<double, 2> errors() {
    REQUIRE(ports[0].touching);
    PatchPlayer linear = player(Scheme::port), nonlinear = player(Scheme::hyper);
    CHECK(linear.patch().states() == nonlinear.patch().states());
    double linear_error = 0, nonlinear_error = 0, force = 0;
    for (int ms = 1; ms <= 150; ++ms) {
      const ToolSample sample{ms * kTick, tool(kPressS + 1e-3 * ms)};
      to(kPressS + 1e-3 * ms);
      const Vec3 truth = -ports[0].lambda;
      linear_error += (linear.advance(sample).force - truth).squaredNorm();
      nonlinear_error += (nonlinear.advance(sample).force - truth).squaredNorm();
      force += truth.squaredNorm();
    }
    UNSCOPED_INFO("of the force: linear " << std::sqrt(linear_error / force) << ", with terms "
                                          << std::sqrt(nonlinear_error / force));
    return {linear_error / force, nonlinear_error / force};
  }
};

}  // namespace

TEST_CASE("Pressed on deep, a touched patch with its terms stays with the body where the linear one leaves it") {
  Touch touch(2, deeper);
  const auto [linear, nonlinear] = touch.errors();
  CHECK(nonlinear < 0.1 * linear);
  CHECK(nonlinear < 1e-4);
}

TEST_CASE("Pressed on deep into springs that stiffen, the patch with some of them stays with the body") {
  Touch touch(2, deeper, SpringLaw::stiffening);
  const auto [linear, nonlinear] = touch.errors();
  CHECK(Touch(2, deeper, SpringLaw::stiffening).patch(Scheme::hyper).terms.elements.count() > 0);
  CHECK(nonlinear < 0.02 * linear);
  CHECK(nonlinear < 1e-3);
}

TEST_CASE("Slid on along the surface, a touched patch knows how the body yields where the tool gets to, with terms or without") {
  Touch touch(0.3, along);
  const auto [linear, nonlinear] = touch.errors();
  CHECK(linear < 1e-4);
  CHECK(nonlinear < 1e-4);
}

TEST_CASE("Among the directions of a touch is the way that the body begins to yield along the normal") {
  Touch touch(0.3, deeper);
  const Matrix v = touch.patch(Scheme::hyper).modes.of_nodes();
  std::vector<double> positions;
  touch.skin.place(touch.state.x, positions);
  Vector load = Vector::Zero(touch.state.x.size());
  scatter(touch.skin.weights(touch.ports[0].point), normal_at(touch.skin.view(), positions, touch.ports[0].point), load);
  mask(touch.body.fixed, load);
  const Vector& m = touch.dynamics.masses();
  const Vector x = load.cwiseQuotient(m), missing = x - v * (v.transpose() * m.cwiseProduct(x));
  CHECK(missing.dot(m.cwiseProduct(missing)) < 1e-16 * x.dot(m.cwiseProduct(x)));
}

TEST_CASE("A touched body of which one node moves has no modes but its own, and what is fixed has none") {
  Touch touch(0.3, deeper);
  const std::uint32_t node = touch.skin.view().triangles[touch.ports[0].point.triangle][0];
  touch.body.fixed.assign(touch.body.fixed.size(), 1);
  touch.body.fixed[node] = 0;
  for (const int order : {2, kMostOrder}) {
    touch.order = order;
    const BuiltPatch built = touch.patch(Scheme::hyper, false);
    CHECK(built.patch.modes() <= std::min(order / 2, 3));
    Matrix v = built.modes.of_nodes();
    v.middleRows<3>(3 * static_cast<Eigen::Index>(node)).setZero();
    CAPTURE(order, v.cwiseAbs().maxCoeff());
    CHECK(v.isZero(1e-12));
  }
}

/// B^T P^-1 B of a touch's port at a shift: of the modes, and of the whole body.
struct Compliances {
  Mat3 of_patch, whole;
  double apart() const { return (of_patch - whole).norm() / whole.norm(); }
};
/// Empty if P of the whole body is not definite there.
std::optional<Compliances> compliances(Touch& touch, const BuiltPatch& built, double s) {
  const Matrix v = built.modes.of_nodes();
  Matrix k_v, d_v;
  Tangents tangents(touch.dynamics);
  tangents.take(touch.state);
  tangents.multiply(v, k_v, d_v);
  const Matrix p_v = s * s * Matrix::Identity(v.cols(), v.cols()) + v.transpose() * (s * d_v + k_v);
  const NodeWeights b = touch.skin.weights(touch.ports[0].point);
  BlockMatrix p = touch.dynamics.make_matrix();
  touch.dynamics.assemble(touch.state, s * s, s, 1, touch.body.fixed, false, p);
  LinearSolver solver(touch.dynamics.nodes());
  if (!solver.factorise(p)) return std::nullopt;
  Mat3 whole;
  Matrix rows = Matrix::Zero(3, v.cols());
  for (const auto& [node, weight] : b) rows += weight * v.middleRows<3>(3 * static_cast<Eigen::Index>(node));
  for (int axis = 0; axis < 3; ++axis) {
    Vector load = Vector::Zero(v.rows()), response = load;
    scatter(b, Vec3::Unit(axis), load);
    mask(touch.body.fixed, load);
    if (!solver.solve(load, 1e-8, response).positive_definite) return std::nullopt;
    whole.col(axis) = gather(b, response);
  }
  return Compliances{rows * p_v.lu().solve(Matrix(rows.transpose())), whole};
}

void squeeze(Touch& touch, double part) {
  touch.horizon = Micros{40'000};
  touch.state = random_state(touch.dynamics, 1, 0.0005, 0);
  for (std::uint32_t i = 0; i < touch.dynamics.nodes(); ++i) at_node(touch.state.x, i).z() *= 1 - part;
}

/// Number of bodies, squeezed by these shares, for which `found` returns compliances; the patch must respond like the whole body
/// in all of them.
template <typename Found>
int matching_responses(std::initializer_list<double> parts, const Found& found) {
  int count = 0;
  for (const double squeezed : parts) {
    Touch touch(0.3, deeper);
    squeeze(touch, squeezed);
    const std::optional<Compliances> both = found(touch, touch.patch(Scheme::hyper), shift_for(touch.horizon));
    if (!both) continue;
    ++count;
    CAPTURE(squeezed);
    CHECK(both->apart() < 5e-3);
  }
  return count;
}

TEST_CASE("A body so squeezed that it gives way of itself has a patch as it is, for a hand eight times as fast") {
  const int softened = matching_responses({0.4, 0.45, 0.5}, [](Touch& touch, const BuiltPatch& patch, double s) {
    return compliances(touch, patch, s) ? std::nullopt : compliances(touch, patch, 8 * s);
  });
  CHECK(softened == 3);
}

TEST_CASE("Under a touch dampers turn with their springs unless they brake away what moves within a tick") {
  for (const bool stiff : {false, true}) {
    Touch touch(2, deeper, SpringLaw::stiffening, stiff ? 30 : 1);
    const SampledElements springs = touch.patch(Scheme::hyper).terms.elements;
    REQUIRE(springs.count() > 0);
    CHECK((springs.damping.maxCoeff() > 0) != stiff);
  }
}

TEST_CASE("Terms whose elements buckle are known by the force that they foretell on the way of the tool") {
  Touch touch(2, deeper);
  BuiltPatch made = touch.patch(Scheme::hyper);
  for (const double down_m_s : {0.0, 0.05, 0.1}) {
    made.patch.tool_velocity = Vec3(0, 0, -down_m_s);
    CHECK_FALSE(terms_depart(made.patch, made.terms, touch.horizon));
  }
  made.terms.elements.stiffness *= -100;  // their forces pull the other way
  CHECK(terms_depart(made.patch, made.terms, touch.horizon));
}
