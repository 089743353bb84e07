// The patch of one tool with others on the body, against dense linear algebra on the whole body.
#include "server/reduction/frame_model.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <catch2/catch.hpp>

#include "common/base/rotation_vector.hpp"
#include "common/player/player.hpp"
#include "server/reduction/other_tools.hpp"
#include "server/reduction/patch_build.hpp"
#include "tests/support/bodies.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

constexpr Micros kFrameHorizon{100'000};
constexpr double kFrameShift = 20;  // 2 / horizon

struct FrameBench {
  LumpedBody body = box_body(4, 4, 4);
  Dynamics dynamics{body};
  Skin skin{body};
  BodyState state = random_state(dynamics, 5, 0.001, 0.05);
  std::vector<ToolPort> ports;
  std::vector<ToolAt> tools;
  FrameModel frame{dynamics, skin, 0};

  void touch(std::uint32_t triangle, const Vec3& lambda, const Vec3& velocity, double friction = 10) {
    ToolPort port;
    port.parameters = {800, friction};
    port.point = {triangle, Vec3(0.5, 0.3, 0.2)};
    port.lambda = lambda;
    port.touching = true;
    ports.push_back(port);
    const Positions x(state.x.data(), static_cast<std::size_t>(state.x.size()));
    tools.push_back({position_at(skin.view(), x, port.point), velocity});
  }
  /// `wanted`: ports that do not touch, for which other patches are to be built.
  Patch build(std::size_t which, Scheme scheme = Scheme::port, const std::vector<std::size_t>& wanted = {}, int order = 0) {
    frame.begin(state, ports, tools, kFrameHorizon);
    for (const std::size_t k : wanted) frame.request_patch(k);
    PatchRequest request;
    request.scheme = scheme;
    request.horizon = kFrameHorizon;
    request.order = order;
    const auto built = build_patch(frame, which, request);
    REQUIRE(built);
    REQUIRE(check(built->patch) == PatchFault::none);
    return built->patch;
  }
  /// Builds with all candidate directions as modes.
  Patch build_with_all_directions(std::size_t which) { return build(which, Scheme::port, {}, 2 * kMaxModes); }
  Matrix input(std::size_t k) const {
    Matrix b = Matrix::Zero(state.x.size(), 3);
    for (const auto& [node, weight] : skin.weights(ports[k].point))
      if (!body.fixed[node]) b.middleRows<3>(3 * static_cast<Eigen::Index>(node)) += weight * Mat3::Identity();
    return b;
  }
  /// Dynamic stiffness of all free nodes.
  Matrix dynamic(double s) const {
    Matrix p = dense_stiffness(dynamics, state) + s * dense_damping(dynamics, state);
    p.diagonal() += s * s * dynamics.masses();
    for (Eigen::Index i = 0; i < p.rows(); ++i)
      if (body.fixed[static_cast<std::size_t>(i / 3)]) {
        p.row(i).setZero();
        p.col(i).setZero();
        p(i, i) = 1;
      }
    return p;
  }
};

PortRows rows_of(const Patch& p) {
  PortRows rows = PortRows::Zero(3, p.modes());
  for (int k = 0; k < 3; ++k)
    rows += p.point.weight[k] * p.surface.vertices[p.surface.triangles[0][static_cast<std::size_t>(k)]].rows;
  return rows;
}
Matrix dynamic_of(const Patch& p, double s) {
  Matrix dynamic = s * Matrix(p.damping);
  dynamic.diagonal() += p.stiffness + s * s * ModeVector::Ones(p.modes());
  return dynamic;
}

}  // namespace

TEST_CASE(
    "A touch beside more tools than its patch has contacts responds as the body does: to its own push, to theirs, and to the "
    "force of the one that is left over") {
  FrameBench bench;
  bench.touch(40, Vec3::Zero(), Vec3::Zero());
  const std::array<Vec3, 4> weights{Vec3(0.3, 0.5, 0.2), Vec3(0.3, 0.3, 0.4), Vec3(0.6, 0.3, 0.1), Vec3(0.2, 0.2, 0.6)};
  for (std::size_t k = 0; k < weights.size(); ++k) {
    bench.touch(40, Vec3::Zero(), Vec3(0.02, -0.01, 0.01 * static_cast<double>(k) - 0.05));
    bench.ports.back().point.weight = weights[k];
  }
  const Positions x(bench.state.x.data(), static_cast<std::size_t>(bench.state.x.size()));
  for (std::size_t k = 0; k < bench.ports.size(); ++k) {
    bench.ports[k].lambda = -0.4 * normal_at(bench.skin.view(), x, bench.ports[k].point);
    bench.tools[k].position = position_at(bench.skin.view(), x, bench.ports[k].point);
  }
  const Patch patch = bench.build_with_all_directions(0);
  REQUIRE(patch.others.count == static_cast<int>(kMaxOtherTools));
  CHECK(patch.load_for == kFrameHorizon);
  // Identifies them by velocity.
  std::vector<std::size_t> contacts;
  for (const OtherContact& other : patch.others.tools())
    for (std::size_t k = 1; k < bench.tools.size(); ++k)
      if ((other.velocity - bench.tools[k].velocity).norm() < 1e-12) contacts.push_back(k);
  REQUIRE(contacts.size() == kMaxOtherTools);
  const std::size_t left_over = 10 - contacts[0] - contacts[1] - contacts[2];

  const auto whole = bench.dynamic(kFrameShift).lu();
  const Matrix b = bench.input(0);
  const Mat3 exact = b.transpose() * whole.solve(b);
  const PortRows rows = rows_of(patch);
  const auto reduced = dynamic_of(patch, kFrameShift).lu();
  CHECK((Matrix(rows) * reduced.solve(Matrix(rows).transpose()) - exact).norm() < 1e-8 * exact.norm());
  for (std::size_t k = 0; k < contacts.size(); ++k) {
    const OtherContact& other = patch.others.of[k];
    const Matrix b_o = bench.input(contacts[k]);
    const Mat3 across = b.transpose() * whole.solve(b_o), own = b_o.transpose() * whole.solve(b_o);
    CHECK((Matrix(rows) * reduced.solve(Matrix(other.rows.transpose())) - across).norm() < 1e-8 * across.norm());
    CHECK((Matrix(other.rows) * reduced.solve(Matrix(other.rows.transpose())) + other.c_static - own).norm() < 1e-8 * own.norm());
    CHECK(other.touching);
    CHECK((other.normal - normal_at(bench.skin.view(), x, bench.ports[contacts[k]].point)).norm() < 1e-12);
    CHECK((other.gap - other.c_static * bench.ports[contacts[k]].lambda).norm() < 1e-12);  // the tool is on the surface
  }

  Vector residual;
  bench.dynamics.forces(bench.state.x, bench.state.v, residual);
  residual += bench.input(left_over) * bench.ports[left_over].lambda;
  mask(bench.body.fixed, residual);
  CHECK(patch.load_rate.size() == 0);
  const Vec3 sag = b.transpose() * whole.solve(residual);
  const Vector reduced_residual = patch.g - patch.damping * patch.q_rate;
  CHECK((Matrix(rows) * reduced.solve(reduced_residual) - sag).norm() < 1e-8 * sag.norm());
}

TEST_CASE("A patch expects of other hands the parabola that ends where they get to in its time") {
  FrameBench bench;
  bench.touch(40, Vec3(0, 0, -0.4), Vec3::Zero());
  bench.touch(44, Vec3(0, 0, -0.4), Vec3(0.3, 0, 0));
  bench.frame.begin(bench.state, bench.ports, bench.tools, kFrameHorizon);
  const HandMotion hand{Vec3(0.01, 0.02, -0.03), Vec3(0.4, 0, -0.2)};
  bench.frame.set_hands({{}, hand});
  const HandMotion path = bench.frame.path(1, kFrameHorizon);
  CHECK(path.velocity == hand.velocity);
  // It accelerates for 50 of 100 ms.
  const Vec3 end = 0.1 * hand.velocity + (0.5 * 0.05 * 0.05 + 0.05 * 0.05) * hand.acceleration;
  CHECK((0.1 * path.velocity + 0.5 * 0.1 * 0.1 * path.acceleration - end).norm() < 1e-12);
}

TEST_CASE(
    "The directions for a touch that slides on know what the body does when the load has gone where the tool will be and turned "
    "with "
    "the surface") {
  FrameBench bench;
  bench.touch(40, Vec3(0.1, 0, -0.4), Vec3(0.1, 0.04, 0));
  const Positions x(bench.state.x.data(), static_cast<std::size_t>(bench.state.x.size()));
  const Vec3 lambda = bench.ports[0].lambda, way = seconds(kFrameHorizon) * bench.tools[0].velocity;
  const Matrix b = bench.input(0);
  const auto whole = bench.dynamic(kFrameShift).lu();
  const auto wrong = [&](double part) {  // error of the compliance, along the load
    const SurfacePoint here = bench.ports[0].point, there = slide(bench.skin.view(), x, here, part * way);
    bench.ports[0].point = there;
    const Matrix b_end = bench.input(0);
    bench.ports[0].point = here;
    const Patch patch = bench.build_with_all_directions(0);
    PortRows rows = PortRows::Zero(3, patch.modes());
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 corner = vertex(x, bench.skin.view().triangles[there.triangle][k]);
      int found = 0;
      for (int i = 0; i < patch.surface.vertex_count; ++i) {
        const PortVertex& v = patch.surface.vertices[static_cast<std::size_t>(i)];
        if ((v.position - corner).norm() > 1e-9) continue;
        rows += there.weight[static_cast<int>(k)] * v.rows;
        ++found;
      }
      REQUIRE(found == 1);
    }
    const SurfaceView surface = bench.skin.view();
    const Rotation turn = shortest_rotation(normal_at(surface, x, here), normal_at(surface, x, there));
    const Vec3 lambda_end = turn * lambda;
    const Matrix gone = b_end - b, r_gone = Matrix(rows) - Matrix(rows_of(patch));
    const Vec3 exact = gone.transpose() * whole.solve(b_end * lambda_end - b * lambda);
    const Vector reduced_load = rows.transpose() * lambda_end - rows_of(patch).transpose() * lambda;
    const Vec3 reduced = r_gone * dynamic_of(patch, kFrameShift).lu().solve(reduced_load);
    return (reduced - exact).norm() / exact.norm();
  };
  CHECK(wrong(1) < 1e-8);
  CHECK(wrong(0.5) < 1e-8);
  bench.tools[0].velocity.setZero();
  CHECK(wrong(1) > 0.2);
}

TEST_CASE("A hand that slides goes on, one that rests may set off any way, for those who ask") {
  const Vec3 normal = Vec3(0.1, -0.2, 1).normalized(), velocity(0.1, 0, 0.02);
  CHECK(expected_slides(velocity, normal, {}).empty());
  for (const bool from_rest : {false, true}) {
    const auto slides = expected_slides(velocity, normal, {0.1, from_rest});
    REQUIRE(slides.size() == 2);
    CHECK((slides[0] - 0.1 * velocity).norm() < 1e-15);
    CHECK((slides[1] - 0.05 * velocity).norm() < 1e-15);
  }
  for (const Vec3& still : {Vec3(Vec3::Zero()), Vec3(-0.3 * normal)}) {  // the latter only presses
    CHECK(expected_slides(still, normal, {0.1, false}).empty());
    const auto slides = expected_slides(still, normal, {0.1, true});
    REQUIRE(slides.size() == 2);
    for (const Vec3& way : slides) {
      CHECK(way.norm() == Approx(0.25 * 0.5 * 0.4 * 0.1 * 0.1));
      CHECK(std::abs(way.dot(normal)) < 1e-15);
    }
    CHECK(std::abs(slides[0].dot(slides[1])) < 1e-15);
  }
}

TEST_CASE("A hand that speeds up or slows down is looked for where that takes it, if it is elsewhere") {
  const Vec3 normal = Vec3::UnitZ(), velocity(0.1, 0, 0), sideways(0, 0.5, 0);
  const auto slides = expected_slides(velocity, normal, {0.2, true, sideways});
  REQUIRE(slides.size() == 3);
  // Over the first 0.05 s of 0.2 s: 0.625 mm by then, and 25 mm/s from there on.
  CHECK((slides[2] - Vec3(0.02, 0.004375, 0)).norm() < 1e-15);
  CHECK((expected_slides(velocity, normal, {0.05, true, sideways})[2] - Vec3(0.005, 0.5 * 0.5 * 0.0025, 0)).norm() < 1e-15);
  // No hand moves further than 12 mm in that time.
  CHECK((expected_slides(velocity, normal, {0.2, true, 100 * sideways})[2] - Vec3(0.02, 0.012, 0)).norm() < 1e-15);
  CHECK(expected_slides(velocity, normal, {0.2, true, 0.01 * sideways}).size() == 2);
  CHECK(expected_slides(velocity, normal, {0.2, true, 3 * normal}).size() == 2);
  // A hand that turns round and is back at its start needs no slide.
  CHECK(expected_slides(velocity, normal, {0.1, true, Vec3(-8.0 / 3, 0, 0)}).size() == 2);
  CHECK(expected_slides(Vec3::Zero(), normal, {0.2, false, sideways}).size() == 1);
}

TEST_CASE("Predicted states become snapshots of the frame, with their kinds and weights, and are forgotten with it") {
  FrameBench bench;
  const auto aside = [&](double m) { return Vector(bench.state.x + Vector::Constant(bench.state.x.size(), m)); };
  const auto begin = [&] { bench.frame.begin(bench.state, bench.ports, bench.tools, kFrameHorizon); };
  begin();
  bench.frame.set_predicted_states({{SnapshotKind::rollout, 1, aside(0.001)},
                                    {SnapshotKind::rollout, 1, aside(0.002)},
                                    {SnapshotKind::rollout_end, 0.5, aside(0.003)}});
  const SnapshotSet& snapshots = bench.frame.whole().snapshots();
  const Matrix weighted = snapshots.weighted();
  CHECK(snapshots.of(SnapshotKind::history).empty());
  CHECK(snapshots.of(SnapshotKind::rest).size() == 1);
  const auto rollouts = snapshots.of(SnapshotKind::rollout), ends = snapshots.of(SnapshotKind::rollout_end);
  REQUIRE(rollouts.size() == 2);
  REQUIRE(ends.size() == 1);
  CHECK((weighted.col(rollouts[0]).array() - 0.001).abs().maxCoeff() < 1e-12);
  CHECK((weighted.col(rollouts[1]).array() - 0.002).abs().maxCoeff() < 1e-12);
  CHECK((weighted.col(ends[0]).array() - 0.0015).abs().maxCoeff() < 1e-12);
  begin();
  CHECK(bench.frame.whole().snapshots().of(SnapshotKind::rollout).empty());
  CHECK(bench.frame.whole().snapshots().of(SnapshotKind::rollout_end).empty());
}

TEST_CASE("Tools that touch, or will within its time, are contacts of a patch, three of them at most") {
  FrameBench bench;
  bench.touch(40, Vec3(0, 0, -0.4), Vec3(0, 0, -0.1));
  CHECK(bench.build(0).others.count == 0);
  for (const std::uint32_t triangle : {44u, 48u, 52u}) bench.touch(triangle, Vec3(0, 0, -0.5), Vec3::Zero());
  CHECK(bench.build(0).others.count == 3);
  const Positions x(bench.state.x.data(), static_cast<std::size_t>(bench.state.x.size()));
  const Vec3 normal = normal_at(bench.skin.view(), x, bench.ports[3].point);
  bench.ports[3].touching = false;
  bench.tools[3].position += 0.002 * normal;
  bench.tools[3].velocity = -0.03 * normal;
  CHECK(bench.build(0).others.count == 2);  // its position over the body is unknown
  const Patch patch = bench.build(0, Scheme::port, {3});
  CHECK(patch.others.count == 3);
  CHECK(std::ranges::count_if(patch.others.tools(), [](const OtherContact& other) { return other.touching; }) == 2);
  bench.tools[3].velocity = -0.01 * normal;  // 1 mm within the patch's time
  CHECK(bench.build(0, Scheme::port, {3}).others.count == 2);

  bench.ports[3].touching = true;
  bench.touch(56, Vec3(0, 0, -0.5), Vec3::Zero());
  bench.touch(40, Vec3(0, 0, -0.4), Vec3::Zero());
  CHECK(bench.build(0).others.count == 3);
}

TEST_CASE("Every scheme serves a touch beside others with a patch that passes the receiver's check") {
  FrameBench bench;
  bench.touch(40, Vec3(0, 0, -0.4), Vec3::Zero());
  bench.touch(40, Vec3(0, 0, -0.4), Vec3(0, 0, -0.1));
  bench.touch(44, Vec3(0.2, 0, -0.5), Vec3(0, 0.3, -0.1));
  bench.ports[2].parameters.contact_stiffness_n_m = 0;  // rigid
  for (const Scheme scheme : {Scheme::hold, Scheme::tangent, Scheme::ring, Scheme::port})
    for (std::size_t which = 0; which < 3; ++which) bench.build(which, scheme);
}

TEST_CASE("A grasp beside a node that another tool moves gets the force that its elements pass on") {
  FrameBench bench;
  for (const std::uint32_t node : {54u, 58u}) {
    ToolPort port;
    port.kind = ContactKind::attach;
    port.node = node;
    bench.ports.push_back(port);
    bench.tools.push_back({node_of(bench.state.x, node), Vec3(0.01, 0, -0.04)});
  }
  const Patch patch = bench.build(0);
  REQUIRE(patch.load_rate.size() == patch.modes());
  CHECK(patch.load_rate.norm() > 0);
  CHECK(patch.load_for == kFrameHorizon);
  bench.tools[1].velocity.setZero();
  CHECK(bench.build(0).load_rate.size() == 0);
}

TEST_CASE("Stations of one frame share its solves, which are made together") {
  FrameBench bench;
  for (const std::uint32_t triangle : {40u, 44u, 48u}) bench.touch(triangle, Vec3(0, 0, -0.4), Vec3::Zero());
  bench.ports[2].touching = false;
  bench.build(0);
  const auto key = [&](Micros horizon) { return SystemKey{bench.frame.shift(horizon), false, bench.frame.whole().held()}; };
  SharedSystem* const p = bench.frame.whole().system(key(kFrameHorizon), 1e-2);
  REQUIRE(p);
  CHECK(bench.frame.whole().system(key(Micros{30'000}), 1e-2) == p);  // of all, at their mean horizon
  const Port& kept = p->port(1);
  const Mat3 exact = bench.input(1).transpose() * bench.dynamic(kFrameShift).lu().solve(bench.input(1));
  CHECK((kept.compliance - exact).norm() < 1e-8 * exact.norm());
  const Vector before = kept.response[2];
  REQUIRE(bench.frame.whole().respond(*p, 1, true));
  CHECK(&p->port(1) == &kept);
  CHECK(kept.response[2] == before);
  CHECK_THROWS(p->port(2));  // neither touches nor is wanted
  bench.frame.request_patch(2);
  REQUIRE(bench.frame.whole().respond(*p, 1, true));
  CHECK(p->port(2).compliance.trace() > 0);
  CHECK(kept.response[2] == before);
}

TEST_CASE("A touch patch of fewer modes than a tool has directions yields statically in all of them, none twice") {
  for (const int states : {2, 4, 6}) {
    FrameBench bench;
    bench.touch(40, Vec3(0.05, 0, -0.4), Vec3::Zero());
    bench.frame.begin(bench.state, bench.ports, bench.tools, kFrameHorizon);
    PatchRequest request;
    request.order = states;
    request.horizon = kFrameHorizon;
    const auto built = build_patch(bench.frame, 0, request);
    REQUIRE(built);
    const Patch* const patch = &built->patch;
    REQUIRE(check(*patch) == PatchFault::none);
    REQUIRE(patch->modes() == states / 2);
    const Matrix b = bench.input(0);
    const Mat3 exact = b.transpose() * bench.dynamic(kFrameShift).lu().solve(b);
    const PortRows rows = rows_of(*patch);
    const Mat3 reduced = Matrix(rows) * dynamic_of(*patch, kFrameShift).lu().solve(Matrix(rows).transpose()) + patch->c_static;
    INFO(states << " states");
    CHECK((reduced - exact).norm() < 0.02 * exact.norm());
    // The immediate compliance has acted by the stamp: the surface is where the body has it.
    const Positions x(bench.state.x.data(), static_cast<std::size_t>(bench.state.x.size()));
    const Vec3 corner =
        patch->surface.vertices[patch->surface.triangles[0][0]].position + patch->c_static * bench.ports[0].lambda;
    CHECK((corner - vertex(x, bench.skin.view().triangles[40][0])).norm() < 1e-12);
  }
}

TEST_CASE("Everywhere on its piece of the surface a frictionless touch is pushed along the normal of the whole surface") {
  FrameBench bench;
  bench.state = random_state(bench.dynamics, 5, 0.004, 0);
  const std::uint32_t triangle = GENERATE(0u, 40u, 90u);
  bench.touch(triangle, Vec3::Zero(), Vec3::Zero(), 0);
  bench.ports[0].touching = false;
  bench.frame.begin(bench.state, bench.ports, bench.tools, kFrameHorizon);
  PatchRequest request;
  request.horizon = kFrameHorizon;
  request.vertices_max = [](int, bool, int, PatchContacts) { return 6; };  // so few that all are at the rim
  auto built = build_patch(bench.frame, 0, request);
  REQUIRE(built);
  Patch* const patch = &built->patch;
  const Positions x(bench.state.x.data(), static_cast<std::size_t>(bench.state.x.size()));
  patch->contact_stiffness_n_m = 800;
  patch->friction = 0;
  for (int t = 0; t < patch->surface.triangle_count; ++t) {
    const Triangle& corners = patch->surface.triangles[static_cast<std::size_t>(t)];
    const auto corner = [&](std::size_t k) { return patch->surface.vertices[corners[k]].position; };
    const Vec3 middle = (corner(0) + corner(1) + corner(2)) / 3;
    const Vec3 normal = nearest_point(bench.skin.view(), x, middle).normal;
    Patch still = *patch;
    still.g.setZero();
    still.q_rate.setZero();
    still.point = {static_cast<std::uint32_t>(t), Vec3::Constant(1.0 / 3)};
    still.tool = middle + 1e-3 * normal;
    PatchPlayer player(still);
    const Vec3 force = player.advance({still.stamp + kTick, middle - 1e-4 * normal}).force;
    REQUIRE(force.norm() > 0);
    CHECK(force.normalized().dot(normal) > 1 - 1e-4);  // 0.8 degrees, as the surface yields to the force
  }
}
