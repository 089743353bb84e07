// The patch player with nonlinear terms, against fine integrations and energy balances.
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <numbers>

#include "common/base/random.hpp"
#include "common/patch/terms_pieces.hpp"
#include "common/player/player.hpp"
#include "tests/support/floor_patch.hpp"

using namespace palpate;
using test::floor_patch, test::kStamp, test::pressed_floor;

namespace {

constexpr double kTickS = 1e-3;

/// A tick of q'' = acceleration(part, q, q'), with `part` from 0 to 1, in `count` steps of fourth-order Runge-Kutta.
template <typename Acceleration>
void fine_tick(const Acceleration& acceleration, int count, ModeVector& q, ModeVector& v) {
  const double step = 1.0 / count, h = kTickS * step;
  for (int k = 0; k < count; ++k) {
    const double begin = k * step, half = (k + 0.5) * step, end = (k + 1) * step;
    const ModeVector v1 = v, a1 = acceleration(begin, q, v1);
    const ModeVector v2 = v + h / 2 * a1, a2 = acceleration(half, q + h / 2 * v1, v2);
    const ModeVector v3 = v + h / 2 * a2, a3 = acceleration(half, q + h / 2 * v2, v3);
    const ModeVector v4 = v + h * a3, a4 = acceleration(end, q + h * v3, v4);
    q += h / 6 * (v1 + 2 * v2 + 2 * v3 + v4);
    v += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
  }
}

struct GraspErrors {
  double nonlinear_n = 0, linear_n = 0;  // errors of the player with terms, and without
  double viscous = 0;  // largest ratio of the push of dampers due to their rotation to that of the patch's own dampers
};

/// Errors against a fine integration of patch, elastic terms and the dampers of tetrahedra, for a hand that comes and goes.
GraspErrors grasp_errors(const Patch& patch, const NonlinearTerms& terms) {
  constexpr int kFine = 200;
  const auto r = patch.modes();
  NonlinearForce bend(terms, patch);
  SampledSolidForce solid;
  if (terms.elements.is_solid()) solid = SampledSolidForce(terms.elements, 3, kTickS, true);
  PatchPlayer player(patch, terms), linear(patch);
  const auto tool = [](double t) { return Vec3(Vec3(0.004, -0.003, -0.006) * std::pow(std::sin(12 * t), 2)); };
  ModeVector q = ModeVector::Zero(r), v = q;
  GraspErrors found;
  for (int ms = 1; ms <= 400; ++ms) {
    const Vec3 from = tool(kTickS * (ms - 1)), to = tool(kTickS * ms), rate = (to - from) / kTickS;
    NonlinearForce::Variables u(r + 3), u_rate(r + 3), residual(r + 3);
    const auto push = [&](const Vec3& d, const ModeVector& at, const ModeVector& speed) {
      u << d, at;
      bend.move_to(u);
      bend.elastic(residual);
      if (!terms.elements.is_solid()) return;
      u_rate << rate, speed;
      SampledSolidForce::Values viscous, at_stamp;
      solid.move_to(u.cast<float>());
      solid.damping(u_rate.cast<float>(), viscous, at_stamp);
      residual -= viscous.cast<double>();
      found.viscous = std::max(found.viscous, viscous.tail(r).cast<double>().norm() / (patch.damping * speed).norm());
    };
    const auto acceleration = [&](double part, const ModeVector& at, const ModeVector& speed) {
      const Vec3 d = from + part * (to - from);
      push(d, at, speed);
      return ModeVector(patch.b_k * d + patch.b_d * rate - patch.stiffness.cwiseProduct(at) - patch.damping * speed +
                        residual.tail(r));
    };
    fine_tick(acceleration, kFine, q, v);
    push(to, q, v);
    const Vec3 exact = -patch.k_port * to - patch.d_port * rate + patch.b_k.transpose() * q + patch.b_d.transpose() * v +
                       Vec3(residual.head<3>()) + patch.force;
    const ToolSample sample{kStamp + ms * kTick, patch.tool + to};
    found.nonlinear_n = std::max(found.nonlinear_n, (player.advance(sample).force - exact).norm());
    found.linear_n = std::max(found.linear_n, (linear.advance(sample).force - exact).norm());
  }
  return found;
}

struct TouchErrors {
  double nonlinear_n = 0, linear_n = 0, most_n = 0;  // errors of the player with terms, and without; the force itself
  double viscous = 0;                                // as for a grasp
};

/// Errors against a fine integration, in `fine` steps per tick, of patch, contact, elastic terms and the dampers of tetrahedra,
/// for a tapping hand; q'' + D q' + K q = f(q, q') - R^T lambda, lambda = k_c (R q - h) where R q > h.
TouchErrors touch_errors(const Patch& patch, const NonlinearTerms& terms, int fine) {
  const auto r = patch.modes();
  const Eigen::RowVectorXd row = patch.surface.vertices[0].rows.row(2);
  NonlinearForce bend(terms, patch);
  SampledSolidForce solid;
  if (terms.elements.is_solid()) solid = SampledSolidForce(terms.elements, 0, kTickS / kTouchSteps, true);
  PatchPlayer player(patch, terms), linear(patch);
  const auto way = [](double t) { return -0.015 * std::pow(std::sin(15 * t), 2); };
  const auto push = [&](const ModeVector& q, double z) { return std::max(0.0, patch.contact_stiffness_n_m * (row.dot(q) - z)); };
  ModeVector q = ModeVector::Zero(r), v = q;
  TouchErrors found;
  for (int ms = 1; ms <= 400; ++ms) {
    const double from = way(kTickS * (ms - 1)), to = way(kTickS * ms);
    const auto acceleration = [&](double part, const ModeVector& at, const ModeVector& speed) {
      NonlinearForce::Variables residual(r);
      bend.move_to(at);
      bend.elastic(residual);
      if (terms.elements.is_solid()) {
        SampledSolidForce::Values viscous, at_stamp;
        solid.move_to(at.cast<float>());
        solid.damping(speed.cast<float>(), viscous, at_stamp);
        residual -= viscous.cast<double>();
        if (speed.norm() > 0)
          found.viscous = std::max(found.viscous, viscous.cast<double>().norm() / (patch.damping * speed).norm());
      }
      return ModeVector(residual - patch.stiffness.cwiseProduct(at) - patch.damping * speed -
                        row.transpose() * push(at, from + part * (to - from)));
    };
    fine_tick(acceleration, fine, q, v);
    const double exact = push(q, to);
    const ToolSample sample{kStamp + ms * kTick, {0, 0, to}};
    found.nonlinear_n = std::max(found.nonlinear_n, std::abs(player.advance(sample).force.z() - exact));
    found.linear_n = std::max(found.linear_n, std::abs(linear.advance(sample).force.z() - exact));
    found.most_n = std::max(found.most_n, exact);
  }
  return found;
}

/// A patch on which a tool presses along its normal alone, every vertex alike, its rows times `part`.
Patch pressed_patch(int r, double part) { return pressed_floor(part * floor_patch(r).surface.vertices[0].rows.row(2)); }

}  // namespace

TEST_CASE("A push on a body that bends is felt as a fine integration of body and contact has it") {
  Patch p = pressed_patch(4, 1);
  p.contact_stiffness_n_m = 500;
  NonlinearTerms terms = test::spring_terms(p);
  terms.elements.damping.setZero();
  const TouchErrors found = touch_errors(p, terms, 100);
  CAPTURE(found.nonlinear_n, found.linear_n, found.most_n);
  CHECK(found.linear_n > 0.5 * found.most_n);
  CHECK(found.nonlinear_n < 0.1 * found.linear_n);
}

TEST_CASE("A touched body that bends gives back no more than the hand has given it") {
  const Patch patch = test::touch_patch(8, 1, kStamp);
  PatchPlayer nonlinear(patch, test::slack_spring_terms(patch)), linear(patch);
  Vec3 from = patch.tool, force = Vec3::Zero();
  double given_j = 0, most_j = 0, apart_n = 0;
  for (int ms = 1; ms <= 3000; ++ms) {
    const double t = 1e-3 * ms;
    const Vec3 tool(0.004 * std::sin(7 * t), 0.003 * std::sin(5 * t), 0.002 - 0.02 * std::pow(std::sin(9 * t), 2));
    const Vec3 next = nonlinear.advance({kStamp + ms * kTick, tool}).force;
    apart_n = std::max(apart_n, (next - linear.advance({kStamp + ms * kTick, tool}).force).norm());
    given_j -= 0.5 * (force + next).dot(tool - from);
    most_j = std::max(most_j, given_j);
    CHECK(given_j >= -1e-3 * most_j);
    from = tool;
    force = next;
  }
  CHECK(most_j > 1e-3);
  CHECK(apart_n > 0.05);
}

TEST_CASE("Surface that came with the terms is felt as if it had come with the patch") {
  const Patch whole = test::touch_patch(8, 1, kStamp);
  const NonlinearTerms terms = test::spring_terms(whole);
  Patch part = whole;
  NonlinearTerms rest = terms;
  PortSurface& surface = part.surface;
  surface.vertex_count = 6;  // two of three rows
  surface.triangle_count = 4;
  rest.vertices.assign(whole.surface.vertices.begin() + 6, whole.surface.vertices.begin() + whole.surface.vertex_count);
  rest.triangles.assign(whole.surface.triangles.begin() + 4, whole.surface.triangles.begin() + whole.surface.triangle_count);
  PatchPlayer at_once(whole, terms), joined(part, rest), alone(part, terms);
  double missed_n = 0;
  for (int ms = 1; ms <= 600; ++ms) {
    const ToolSample sample{kStamp + ms * kTick, {0.002, 0.012 * std::sin(0.01 * ms), -0.004}};
    const Vec3 force = at_once.advance(sample).force;
    CHECK(joined.advance(sample).force == force);
    missed_n = std::max(missed_n, (alone.advance(sample).force - force).norm());
  }
  CHECK(missed_n > 0.1);
}

TEST_CASE("Dampers that turn with their elements are not felt by a bent body at rest") {
  Patch patch = GENERATE(true, false) ? test::touch_patch(8, 1, kStamp) : test::attach_patch(8, 1, kStamp);
  patch.friction = 10;  // a tool that slid would keep a trace of its path
  NonlinearTerms damped = test::slack_spring_terms(patch), bare = damped;
  damped.elements.damping *= 10;
  bare.elements.damping.setZero();
  PatchPlayer with(patch, damped), without(patch, bare);
  const Vec3 there(0.002, -0.001, -0.012);
  for (int ms = 1; ms <= 8000; ++ms) {
    const ToolSample sample{kStamp + ms * kTick, patch.tool + std::min(1.0, ms / 500.0) * there};
    with.advance(sample);
    without.advance(sample);
  }
  const Vec3 force = without.output().force;
  CHECK(force.norm() > 0.1);
  CHECK((with.output().force - force).norm() < 1e-6 * force.norm());
}

TEST_CASE("Dampers that turn never push more than those of the patch brake, however far they turn") {
  const Patch patch = test::attach_patch(8, 1, kStamp);
  NonlinearForce force(test::spring_terms(patch), patch);
  const Eigen::MatrixXd damping = joint_damping(patch);
  const auto n = damping.rows();
  Random random(5);
  const auto draw = [&](double size) {
    NonlinearForce::Variables v(n);
    for (double& number : v) number = size * random.uniform(-1, 1);
    return v;
  };
  int pushed = 0;
  for (int k = 0; k < 200; ++k)
    for (const double far : {0.001, 0.01, 0.1, 1.0}) {
      const NonlinearForce::Variables rate = draw(1);
      NonlinearForce::Variables push(n);
      force.move_to(draw(far));
      force.damping(rate, ModeMatrix::Zero(8, 8), NonlinearForce::Variables::Zero(n), push);
      const double power = push.dot(rate), braked = rate.dot(damping * rate);
      CHECK(power <= 1.0001 * double{kDamperShareMax} * braked);
      pushed += power > 0.25 * braked;
    }
  CHECK(pushed > 10);  // otherwise nothing was tested
}

TEST_CASE("A nonlinear grasp whose modes are braked away within a tick feels what a fine integration of it does") {
  constexpr int r = 6;
  Patch patch = test::attach_patch(r, 1, kStamp);
  for (int i = 0; i < r; ++i) patch.damping(i, i) = 100.0 * (1 + 5 * i);  // D dt from 0.1 to 2.6
  patch.b_d = 0.02 * patch.b_k;
  NonlinearTerms terms = test::slack_spring_terms(patch);
  terms.elements.damping.setZero();
  const GraspErrors found = grasp_errors(patch, terms);
  CAPTURE(found.nonlinear_n, found.linear_n);
  CHECK(found.linear_n > 0.005);
  CHECK(found.nonlinear_n < 1e-3 * found.linear_n);
}

TEST_CASE("A grasp of a spring too stiff for a tick feels it turn as a fine integration has it") {
  // A mode rotates about the end of a nearly rigid spring, and in the resulting direction it is held by a soft one.
  constexpr double kStiff = 6.4e7, kSoft = 1e6, kLong = 0.02, kFar = 0.01 / 0.006;
  Patch patch = test::attach_patch(2, 1, kStamp);
  patch.stiffness << kStiff + kSoft, kSoft;
  patch.damping = (0.4 * patch.stiffness.cwiseSqrt()).asDiagonal();
  patch.b_k.setZero();
  patch.b_d.setZero();
  patch.b_k(1, 2) = kFar * kSoft;
  patch.k_port = patch.b_k.transpose() * patch.b_k / kSoft + 50 * Mat3::Identity();
  NonlinearTerms terms = test::sampled_terms(patch);
  SampledElements& springs = terms.elements;
  Eigen::MatrixXf moved = Eigen::MatrixXf::Zero(6, 2);
  moved.block<2, 2>(3, 0).setIdentity();
  springs.motion = rounded(moved, -1);
  springs.position.setZero(3, 2);
  springs.position(0, 1) = static_cast<float>(kLong);
  springs.nodes.resize(2, 1);
  springs.nodes << 0, 1;
  springs.rest_length.setConstant(1, static_cast<float>(kLong));
  springs.stiffness.setConstant(1, static_cast<float>(kStiff));
  springs.damping.setZero(1);
  REQUIRE(NonlinearForce(terms, patch).added_mass().size() > 0);
  const GraspErrors found = grasp_errors(patch, terms);
  CAPTURE(found.nonlinear_n, found.linear_n);
  CHECK(found.linear_n > 100);
  CHECK(found.nonlinear_n < 0.03 * found.linear_n);
}

TEST_CASE("A solid whose dampers grow to many times theirs as it stretches is felt as a fine integration has it") {
  // One edge of a tetrahedron grows with the mode: its damper grows with the square of the stretch, to nine times.
  constexpr double kStiffness = 1e5, kSizeM = 0.02, kStretch = 2 / 0.006, kOfTetra = 0.1;
  const double damping = GENERATE(60.0, 300.0, 2000.0);
  Patch patch = test::attach_patch(1, 1, kStamp);
  patch.stiffness << kStiffness;
  patch.damping << damping;
  patch.b_k << 0, 0, -kStiffness;
  patch.b_d.setZero();
  patch.k_port = patch.b_k.transpose() * patch.b_k / kStiffness + 50 * Mat3::Identity();
  NonlinearTerms terms = test::sampled_terms(patch);
  SampledElements& solid = terms.elements;
  Eigen::MatrixXf moved = Eigen::MatrixXf::Zero(12, 1);
  moved(11, 0) = static_cast<float>(kStretch * kSizeM);
  solid.motion = rounded(moved, -1);
  solid.rest = Eigen::Matrix3Xf::Zero(3, 4);
  solid.rest.rightCols<3>() = static_cast<float>(kSizeM) * Eigen::Matrix3f::Identity();
  solid.position = solid.rest;
  solid.nodes.resize(4, 1);
  solid.nodes << 0, 1, 2, 3;
  solid.stiffness.setConstant(1, static_cast<float>(kOfTetra * kStiffness / (2 * kStretch * kStretch)));
  solid.dilation.setZero(1);
  solid.damping.setConstant(1, static_cast<float>(damping / (kOfTetra * kStiffness)));
  const GraspErrors found = grasp_errors(patch, terms);
  CAPTURE(damping, found.nonlinear_n, found.linear_n, found.viscous);
  CHECK(found.viscous > 3);
  CHECK(found.nonlinear_n < 0.03 * found.linear_n);
}

TEST_CASE("A grasped solid whose dampers turn in all its modes at once is felt as a fine integration has it") {
  const double damping = GENERATE(100.0, 300.0);
  Patch patch = test::attach_patch(8, 1, kStamp);
  patch.damping = damping * ModeMatrix::Identity(8, 8);
  NonlinearTerms terms = test::solid_terms(patch);
  terms.elements.damping.setConstant(static_cast<float>(0.1 * damping / patch.stiffness.mean()));
  const GraspErrors found = grasp_errors(patch, terms);
  CAPTURE(damping, found.nonlinear_n, found.linear_n, found.viscous);
  CHECK(found.viscous > 0.5);
  CHECK(found.nonlinear_n < 8e-5 * damping * found.linear_n);
}

TEST_CASE("A touched solid whose dampers turn, far faster than a step, is felt as a fine integration has it") {
  const double damping = GENERATE(2e4, 5e4);  // a mode decays within a tenth of a step
  Patch p = pressed_patch(8, 0.2);
  p.stiffness *= damping / (0.005 * p.stiffness.mean());
  p.contact_stiffness_n_m = p.stiffness.mean();
  p.damping = damping * ModeMatrix::Identity(8, 8);
  NonlinearTerms terms = test::solid_terms(p);
  terms.elements.damping.setConstant(static_cast<float>(0.1 * damping / p.stiffness.mean()));
  const TouchErrors found = touch_errors(p, terms, 400);
  CAPTURE(damping, found.nonlinear_n, found.linear_n, found.most_n, found.viscous);
  CHECK(found.viscous > 0.5);
  CHECK(found.linear_n > 0.03 * found.most_n);
  CHECK(found.nonlinear_n < 0.03 * found.linear_n);
}

TEST_CASE("Dampers that grow a hundredfold take from a motion, however fast they are, and give it nothing") {
  const bool touch = GENERATE(true, false);
  Patch patch = touch ? test::touch_patch(8, 1, kStamp) : test::attach_patch(8, 1, kStamp);
  patch.damping *= 0.1;
  patch.b_d *= 0.1;
  for (int i = 0; i < patch.modes(); ++i) patch.q_rate[i] = (i % 2 == 0 ? 3.0 : -2.0);
  NonlinearTerms terms = test::solid_terms(patch);
  terms.elements.damping.setConstant(static_cast<float>(GENERATE(0.1, 10.0, 1000.0)));
  PatchPlayer player(patch, terms), linear(patch);
  const double begin_j = player.energy();
  double most_j = 0, apart_j = 0;
  for (int ms = 1; ms <= 3000; ++ms) {
    const ToolSample still{kStamp + ms * kTick, touch ? Vec3(0, 0, 1) : patch.tool};
    player.advance(still);
    linear.advance(still);
    most_j = std::max(most_j, player.energy());
    apart_j = std::max(apart_j, linear.energy() - player.energy());
  }
  CAPTURE(touch, begin_j, most_j, apart_j, player.energy());
  CHECK(most_j <= 1.001 * begin_j);
  CHECK(apart_j > 0.1 * begin_j);
  CHECK(player.energy() <= linear.energy());
}

TEST_CASE("What swings in a nonlinear patch that nothing brakes neither grows nor fades in a minute") {
  Patch patch = test::touch_patch(8, 1, kStamp);
  patch.damping.setZero();
  patch.stiffness *= 30;  // up to 0.5 per tick
  const double fastest = std::sqrt(patch.stiffness.maxCoeff()) * 1e-3;
  REQUIRE(fastest > 0.3);
  for (int i = 0; i < patch.modes(); ++i) patch.q_rate[i] = (i % 2 == 0 ? 0.03 : -0.02);
  NonlinearTerms terms = GENERATE(true, false) ? test::spring_terms(patch) : test::solid_terms(patch);
  terms.elements.damping.setZero();
  CAPTURE(terms.elements.count());
  PatchPlayer player(patch, terms), linear(patch);
  const double begin_j = player.energy();
  double first_j = 0, last_j = 0, nonlinear_j = 0;  // means
  constexpr int kTicks = 60'000, kLook = 5'000;
  for (int ms = 1; ms <= kTicks; ++ms) {
    const ToolSample far{kStamp + ms * kTick, Vec3(0, 0, 1)};
    player.advance(far);
    linear.advance(far);
    nonlinear_j = std::max(nonlinear_j, std::abs(player.energy() - linear.energy()));
    if (ms <= kLook) first_j += player.energy() / kLook;
    if (ms > kTicks - kLook) last_j += player.energy() / kLook;
  }
  CAPTURE(begin_j, first_j, last_j, nonlinear_j);
  CHECK(nonlinear_j > 0.01 * begin_j);
  CHECK(last_j == Approx(first_j).epsilon(0.005));
}

TEST_CASE("A mode that goes round in two and a half steps leaves the linear patch alone") {
  const auto bends = [](double turns_per_step) {
    Patch patch = test::touch_patch(8, 1, kStamp);
    NonlinearTerms terms = test::spring_terms(patch);
    patch.stiffness[7] = std::pow(2 * std::numbers::pi * turns_per_step * kTouchSteps / kTickS, 2);
    PatchPlayer player(patch, terms), linear(patch);
    double most_n = 0;
    for (int ms = 1; ms <= 100; ++ms) {
      const ToolSample sample{kStamp + ms * kTick, {0, 0, -0.01 * std::sin(0.03 * ms)}};
      most_n = std::max(most_n, (player.advance(sample).force - linear.advance(sample).force).norm());
    }
    return most_n;
  };
  CHECK(bends(0.30) > 0.01);
  CHECK(bends(0.40) == 0);
}

TEST_CASE("What PSD projection took is given back only where patch and springs hold the body in spite of it") {
  const Patch patch = test::touch_patch(8, 1, kStamp);
  NonlinearTerms terms = test::slack_spring_terms(patch);
  const NonlinearForce::Variables u = NonlinearForce::Variables::Constant(8, 0.002);
  const auto energy = [&](double share) {  // share of the patch's whole stiffness along its first mode
    terms.e2.setZero(pairs_of(8));
    terms.e2[pair_at(0, 0)] = static_cast<float>(-0.5 * share * patch.stiffness[0]);
    NonlinearForce force(terms, patch);
    REQUIRE_FALSE(force.empty());
    force.move_to(u);
    return force.energy();
  };
  const double without = energy(0);
  CHECK(energy(0.5) == Approx(without - 0.25 * patch.stiffness[0] * u[0] * u[0]).epsilon(1e-5));
  CHECK(energy(100) == Approx(without).epsilon(1e-6));
}

TEST_CASE("Terms whose forces are no numbers leave the linear patch as it is") {
  const bool touch = GENERATE(true, false);
  Patch patch = touch ? test::touch_patch(8, 1, kStamp) : test::attach_patch(8, 1, kStamp);
  NonlinearTerms terms = test::slack_spring_terms(patch);
  terms.elements.damping[3] = std::numeric_limits<float>::infinity();
  REQUIRE_FALSE(NonlinearForce(terms, patch).empty());
  PatchPlayer player(patch, terms), linear(patch);
  double most_n = 0;
  for (int ms = 1; ms <= 200; ++ms) {
    const ToolSample sample{kStamp + ms * kTick, patch.tool + Vec3(0.001, 0.002, -0.01 * std::sin(0.03 * ms))};
    const Vec3 force = player.advance(sample).force;
    REQUIRE(force.allFinite());
    if (!touch) CHECK((force - linear.advance(sample).force).norm() < 1e-9);  // in as many steps
    most_n = std::max(most_n, force.norm());
  }
  CHECK(most_n > 0.1);
}
