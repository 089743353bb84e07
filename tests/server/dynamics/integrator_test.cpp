// The integrator: order, damping of modes that it cannot resolve, energy, equilibria, held nodes, failure and repeatability.
#include "server/dynamics/integrator.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "common/base/error.hpp"
#include "server/body/settle.hpp"
#include "tests/support/bodies.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

const Skin kNoSkin;

BodyState run(const LumpedBody& body, BodyState state, double step_s, double until_s, double tolerance_m = 1e-13) {
  const Dynamics dynamics(body);
  Integrator integrator(dynamics, kNoSkin, {step_s, tolerance_m});
  std::vector<ToolPort> none;
  REQUIRE(integrator.advance(state, none, until_s, {}).converged);
  return state;
}

/// A sideways motion that grows with height.
BodyState plucked(const LumpedBody& body, double speed_m_s) {
  const Dynamics dynamics(body);
  BodyState s = dynamics.rest_state();
  const double top = body.nodes.back().z();
  for (std::uint32_t i = 0; i < dynamics.nodes(); ++i) {
    const double share = body.nodes[i].z() / top;
    s.v[3 * static_cast<Eigen::Index>(i)] = speed_m_s * share * share;
  }
  return s;
}

std::vector<ToolPort> grasp(std::uint32_t node) {
  std::vector<ToolPort> ports(1);
  ports[0].kind = ContactKind::attach;
  ports[0].node = node;
  return ports;
}

/// Nodes 0 (fixed), 1, 2, ... in a row along x, 10 mm apart.
LumpedBody chain(int nodes, double stiffness_n_m, double damping_n_s_m, double mass_kg) {
  LumpedBody body;
  for (int i = 0; i < nodes; ++i) {
    body.nodes.push_back({0.01 * i, 0, 0});
    body.masses_kg.push_back(mass_kg);
    body.fixed.push_back(i == 0);
    const auto b = static_cast<std::uint32_t>(i);
    if (i > 0) body.elements.push_back({b - 1, b, 0.01, stiffness_n_m, damping_n_s_m});
  }
  return body;
}

}  // namespace

TEST_CASE("Half the step is a quarter of the error in a nonlinear free vibration") {
  LumpedBody body = box_body(3, 2, 3);
  body.law = SpringLaw::stiffening;
  body.stiffening = 3;
  const BodyState begin = plucked(body, 0.3);
  constexpr double kUntilS = 0.08;
  const BodyState exact = run(body, begin, 5e-5, kUntilS);
  const auto error = [&](double step_s) {
    const BodyState s = run(body, begin, step_s, kUntilS);
    return (s.x - exact.x).norm() + 0.01 * (s.v - exact.v).norm();
  };
  const double coarse = error(0.002), middle = error(0.001), fine = error(0.0005);
  CHECK((exact.x - begin.x).cwiseAbs().maxCoeff() > 0.002);
  CHECK(coarse / middle == Approx(4).epsilon(0.12));
  CHECK(middle / fine == Approx(4).epsilon(0.06));
}

TEST_CASE("A mode far too stiff for the step dies instead of ringing") {
  const double damping_n_s_m = GENERATE(0.0, 1e3);
  const LumpedBody body = chain(2, 1e9, damping_n_s_m, 1e-3);
  const Dynamics dynamics(body);
  BodyState s = dynamics.rest_state();
  s.x[3] += 1e-4;
  s = run(body, s, 1.0, 1.0);
  CHECK(std::abs(s.x[3] - 0.01) < 1e-9);
  s = run(body, s, 1.0, 2.0);
  CHECK(std::abs(s.x[3] - 0.01) < 1e-13);
}

TEST_CASE("Without damping and load the energy stays for 10 s at a small step, and never grows") {
  const LumpedBody body = box_body(2, 2, 4, 60, 0);
  const Dynamics dynamics(body);
  Integrator integrator(dynamics, kNoSkin, {0.0005, 1e-9});
  BodyState s = plucked(body, 0.05);
  std::vector<ToolPort> none;
  const double begin = dynamics.energy(s);
  double last = begin;
  for (int second = 1; second <= 10; ++second) {
    REQUIRE(integrator.advance(s, none, second, {}).converged);
    const double now = dynamics.energy(s);
    CHECK(now < last * (1 + 1e-4));
    last = now;
  }
  CHECK(last > 0.99 * begin);
}

TEST_CASE("A body with a held node comes to rest where a dense Newton iteration of its own finds equilibrium") {
  const LumpedBody body = box_body(3, 3, 3);
  const Dynamics dynamics(body);
  constexpr std::uint32_t kNode = 22;
  const Vec3 tool = body.nodes[kNode] + Vec3(0.003, -0.002, -0.008);
  Integrator integrator(dynamics, kNoSkin, {0.010, 1e-12});
  BodyState s = dynamics.rest_state();
  auto ports = grasp(kNode);
  const auto at_tool = [&](std::size_t, double t) {
    const double part = std::min(t / 0.2, 1.0);
    return ToolAt{body.nodes[kNode] + part * (tool - body.nodes[kNode]),
                  t < 0.2 ? Vec3((tool - body.nodes[kNode]) / 0.2) : Vec3(0, 0, 0)};
  };
  REQUIRE(integrator.advance(s, ports, 6, at_tool).converged);

  // Linear springs, coded independently: residual and Jacobian of every element, held nodes as identity rows.
  Vector x = dynamics.rest_state().x;
  x.segment<3>(3 * kNode) = tool;
  Vec3 push = Vec3::Zero();
  for (int iteration = 0; iteration < 30; ++iteration) {
    Vector f = Vector::Zero(x.size());
    Matrix k = Matrix::Zero(x.size(), x.size());
    for (const Element& e : body.elements) {
      const Eigen::Index a = 3 * static_cast<Eigen::Index>(e.a), b = 3 * static_cast<Eigen::Index>(e.b);
      const Vec3 d = x.segment<3>(b) - x.segment<3>(a);
      const double length = d.norm(), ratio = e.rest_length_m / length;
      const Vec3 pull = e.stiffness_n_m * (1 - ratio) * d;
      const Mat3 block = e.stiffness_n_m * ((1 - ratio) * Mat3::Identity() + ratio * d * d.transpose() / (length * length));
      f.segment<3>(a) += pull;
      f.segment<3>(b) -= pull;
      k.block<3, 3>(a, a) += block;
      k.block<3, 3>(b, b) += block;
      k.block<3, 3>(a, b) -= block;
      k.block<3, 3>(b, a) -= block;
    }
    push = -f.segment<3>(3 * kNode);
    for (std::uint32_t i = 0; i < dynamics.nodes(); ++i) {
      if (!body.fixed[i] && i != kNode) continue;
      f.segment<3>(3 * static_cast<Eigen::Index>(i)).setZero();
      k.middleRows<3>(3 * static_cast<Eigen::Index>(i)).setZero();
      k.middleCols<3>(3 * static_cast<Eigen::Index>(i)).setZero();
      k.block<3, 3>(3 * static_cast<Eigen::Index>(i), 3 * static_cast<Eigen::Index>(i)).setIdentity();
    }
    x += k.lu().solve(f);
  }
  CHECK((s.x - x).cwiseAbs().maxCoeff() < 1e-8);
  CHECK((ports[0].lambda - push).norm() < 1e-6 * push.norm());
}

TEST_CASE("The force of a grasp on one spring is its stiffness and its damping") {
  const LumpedBody body = chain(2, 200, 3, 0.01);
  const Dynamics dynamics(body);
  Integrator integrator(dynamics, kNoSkin, {0.010});
  BodyState s = dynamics.rest_state();
  auto ports = grasp(1);
  const double speed = 0.02;
  const auto tool = [&](std::size_t, double t) { return ToolAt{Vec3(0.01 + speed * t, 0, 0), Vec3(speed, 0, 0)}; };
  for (const double t : {0.005, 0.05, 0.137}) {
    REQUIRE(integrator.advance(s, ports, t, tool).converged);
    CHECK(ports[0].lambda.x() == Approx(200 * speed * t + 3 * speed));
    CHECK(ports[0].lambda.tail<2>().norm() < 1e-12);
    CHECK(node_of(s.x, 1).x() == Approx(0.01 + speed * t));
  }
}

TEST_CASE("What a jump of a held node does to its neighbour does not depend on where in a long step it falls") {
  const LumpedBody body = chain(3, 50, 3, 0.01);
  const Dynamics dynamics(body);
  constexpr double kJumpM = 3e-5;  // one step of a device's reading, within one of its ticks
  const auto neighbour_m = [&](double jump_s, double step_s) {
    Integrator integrator(dynamics, kNoSkin, {step_s, 1e-12});
    BodyState s = dynamics.rest_state();
    auto ports = grasp(2);
    const auto tool = [&](std::size_t, double t) {
      const bool jumps = t > jump_s && t <= jump_s + 1e-3;
      return ToolAt{Vec3(0.02 + kJumpM * std::clamp((t - jump_s) / 1e-3, 0.0, 1.0), 0, 0), Vec3(jumps ? kJumpM / 1e-3 : 0, 0, 0)};
    };
    REQUIRE(integrator.advance(s, ports, 0.030, tool).converged);
    return s.x[3] - 0.01;
  };
  for (int ms = 10; ms < 20; ++ms) {
    CAPTURE(ms);
    CHECK(neighbour_m(1e-3 * ms, 0.010) == Approx(neighbour_m(1e-3 * ms, 1e-4)).margin(0.1 * kJumpM));
  }
}

TEST_CASE("A chain that is pulled and left to rest is its springs in series") {
  const LumpedBody body = chain(5, 200, 2, 0.005);
  const Dynamics dynamics(body);
  Integrator integrator(dynamics, kNoSkin, {0.010});
  BodyState s = dynamics.rest_state();
  auto ports = grasp(4);
  const auto tool = [&](std::size_t, double) { return ToolAt{Vec3(0.046, 0, 0), Vec3::Zero()}; };
  REQUIRE(integrator.advance(s, ports, 3, tool).converged);
  CHECK(ports[0].lambda.x() == Approx(200.0 / 4 * 0.006).epsilon(1e-6));
}

TEST_CASE("In gravity a hanging chain settles to the length that its weight asks for") {
  LumpedBody body = chain(4, 200, 1, 0.02);
  body.gravity_m_s2 = {9.81, 0, 0};
  const Dynamics dynamics(body);
  const BodyState s = settled_state(dynamics, "hanging");
  CHECK(s.time_s == 0);
  double x = 0;
  for (std::uint32_t i = 1; i < 4; ++i) {
    x += 0.01 + (4 - i) * 0.02 * 9.81 / 200;
    CHECK(node_of(s.x, i).x() == Approx(x).margin(1e-8));
  }
  body.fixed[0] = 0;
  const Dynamics falling(body);
  try {
    settled_state(falling, "chain");
    FAIL("a chain that nothing holds hangs");
  } catch (const InputError& fault) {
    CHECK_THAT(fault.what(), Catch::Contains("scene \"chain\": body.gravity_m_s2: lets the body find no equilibrium: after "));
  }
}

TEST_CASE("However far a body is pulled out and let go of, a frame ends after some hundred steps of Newton's method") {
  for (const SolidLaw law : {SolidLaw::corotational, SolidLaw::neo_hookean}) {
    CAPTURE(law);
    const LumpedBody body = hexa_box(7, 7, 5, {law, 6000, 0.45, 0.01});
    const Dynamics dynamics(body);
    Integrator integrator(dynamics, Skin(), {});
    BodyState state = dynamics.rest_state();
    std::vector<ToolPort> ports(1);
    ports[0].kind = ContactKind::attach;
    ports[0].node = 3 + 7 * (3 + 7 * 4);
    const Vec3 home = body.nodes[ports[0].node];
    const ToolMotion tool = [&](std::size_t, double t) {
      return ToolAt{home + Vec3(0, 0, 0.3 * std::min(1.0, t / 1.5)), Vec3(0, 0, t < 1.5 ? 0.2 : 0)};
    };
    int most = 0;
    for (int frame = 1; frame <= 50; ++frame) {
      if (frame == 40) ports.clear();
      const AdvanceReport report = integrator.advance(state, ports, 0.05 * frame, tool);
      most = std::max(most, report.newton_iterations);
      REQUIRE(report.converged);
      REQUIRE(state.x.allFinite());
      REQUIRE(state.time_s == Approx(0.05 * frame));
    }
    // 120 for each of its steps, of which rounding may make six, 260 for one more that is cut to the end, 200 for the last.
    CHECK(most <= 1180);
  }
}

TEST_CASE("Stiff bodies hang in gravity as soft ones do, in proportion") {
  double sag_m = 0;  // product with the modulus, for the softest
  for (const double poisson : {0.3, 0.49, 0.499})
    for (const double young_pa : {1e5, 1e6, 1e7, 1e9}) {
      CAPTURE(poisson, young_pa);
      LumpedBody body = hexa_box(7, 4, 4, {SolidLaw::neo_hookean, young_pa, poisson, 0}, 1070);
      body.gravity_m_s2 = {0, 0, -9.81};
      const Dynamics dynamics(body);
      const Equilibrium hangs = find_equilibrium(dynamics);
      REQUIRE(hangs.found);
      CHECK(hangs.residual_n < 1e-7 * hangs.load_n);
      double farthest_m = 0;
      for (std::uint32_t i = 0; i < dynamics.nodes(); ++i)
        farthest_m = std::max(farthest_m, (at_node(hangs.state.x, i) - body.nodes[i]).norm());
      if (young_pa == 1e5) sag_m = young_pa * farthest_m;
      CHECK(young_pa * farthest_m == Approx(sag_m).epsilon(0.01));  // strains of up to 0.3 % in the softest
    }
}

TEST_CASE("After an absurd jump of the tool the state is finite, and the body finds its rest again") {
  const LumpedBody body = box_body(4, 4, 4);
  const Dynamics dynamics(body);
  Integrator integrator(dynamics, kNoSkin, {0.010});
  BodyState s = dynamics.rest_state();
  auto ports = grasp(54);
  const Vec3 home = body.nodes[54];
  const double jump_m = GENERATE(0.05, 1.0, 9.0);
  for (double t = 0.05; t < 12; t += 0.05) {
    const auto tool = [&](std::size_t, double at) {
      return ToolAt{at > 0.1 && at < 0.2 ? Vec3(home + Vec3(jump_m, 0, -jump_m)) : home, Vec3::Zero()};
    };
    const AdvanceReport report = integrator.advance(s, ports, t, tool);
    if (!report.converged) {
      s.time_s = t;
      s.v.setZero();
    }
    REQUIRE((s.x.allFinite() && s.v.allFinite()));
  }
  CHECK(s.v.cwiseAbs().maxCoeff() < 1e-3);
  Vector f;
  dynamics.forces(s.x, s.v, f);
  double residual = 0;
  for (std::uint32_t i = 0; i < dynamics.nodes(); ++i)
    if (!body.fixed[i] && i != 54) residual = std::max(residual, node_of(f, i).norm());
  CHECK(residual < 1e-3);
}

TEST_CASE("Springs that stiffen without bound do not throw a torn body out of the world") {
  LumpedBody body = box_body(4, 4, 4);
  body.law = SpringLaw::stiffening;
  body.stiffening = 5;
  const Dynamics dynamics(body);
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    Integrator integrator(dynamics, kNoSkin, {0.010});
    BodyState s = dynamics.rest_state();
    auto ports = grasp(54);
    Random random(seed);
    for (int frame = 1; frame <= 20; ++frame) {
      const Vec3 at = body.nodes[54] + random_vector(random, 0.35);
      if (!integrator.advance(s, ports, 0.05 * frame, [&](std::size_t, double) { return ToolAt{at, Vec3::Zero()}; }).converged) {
        s.time_s = 0.05 * frame;
        s.v.setZero();
      }
      REQUIRE(s.x.allFinite());
      CHECK(s.x.cwiseAbs().maxCoeff() < 10);
    }
  }
}

TEST_CASE("The same motion twice is the same bits") {
  const LumpedBody body = box_body(4, 3, 3);
  const auto once = [&] {
    const Dynamics dynamics(body);
    Integrator integrator(dynamics, kNoSkin, {0.010});
    BodyState s = plucked(body, 0.2);
    auto ports = grasp(30);
    const auto tool = [&](std::size_t, double t) {
      return ToolAt{body.nodes[30] + 0.004 * Vec3(std::sin(20 * t), 0, std::sin(9 * t)),
                    0.004 * Vec3(20 * std::cos(20 * t), 0, 9 * std::cos(9 * t))};
    };
    for (int frame = 1; frame <= 20; ++frame) integrator.advance(s, ports, 0.05 * frame, tool);
    return s;
  };
  const BodyState a = once(), b = once();
  CHECK(a.x == b.x);
  CHECK(a.v == b.v);
}

TEST_CASE("Fixed nodes and the planes of planar bodies stay where they are") {
  LumpedBody body = box_body(4, 1, 3);
  for (Vec3& x : body.nodes) x = {x.x(), x.z(), 0};
  body.planar = true;
  const Dynamics dynamics(body);
  Integrator integrator(dynamics, kNoSkin, {0.010});
  BodyState s = random_state(dynamics, 2, 0.001, 0.1);
  auto ports = grasp(9);
  const auto tool = [&](std::size_t, double t) { return ToolAt{body.nodes[9] + Vec3(0.01 * t, 0, 0.5), Vec3(0.01, 0, 0)}; };
  REQUIRE(integrator.advance(s, ports, 0.5, tool).converged);
  for (std::uint32_t i = 0; i < dynamics.nodes(); ++i) {
    CHECK(node_of(s.x, i).z() == 0);
    if (body.fixed[i]) CHECK(node_of(s.x, i) == body.nodes[i]);
  }
}
