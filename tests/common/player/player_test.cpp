// The patch player against dense exponentials, energy balances and the definition of the contact law.
#include "common/player/player.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>
#include <unsupported/Eigen/MatrixFunctions>

#include "common/base/random.hpp"
#include "tests/support/floor_patch.hpp"

using namespace palpate;
using test::floor_patch, test::kStamp, test::pressed_floor;

namespace {

Vec3 random_vector(Random& random, double size) {
  const double x = random.uniform(-size, size), y = random.uniform(-size, size), z = random.uniform(-size, size);
  return {x, y, z};
}
ModeVector random_modes(Random& random, int r, double size) {
  ModeVector q(r);
  for (double& value : q) value = random.uniform(-size, size);
  return q;
}
ModeMatrix random_damping(Random& random, int r, double size) {
  ModeMatrix a(r, r);
  for (int c = 0; c < r; ++c) a.col(c) = random_modes(random, r, 1);
  return size * a * a.transpose();
}

/// A grasp in motion with full, random damping and a residual force.
Patch moving_grasp(Random& random, int r) {
  Patch p = test::attach_patch(r, 1, kStamp);
  p.damping = random_damping(random, r, 3);
  p.g = random_modes(random, r, 5);
  p.q_rate = random_modes(random, r, 0.02);
  p.force = random_vector(random, 1);
  p.tool = random_vector(random, 0.05);
  p.tool_velocity = random_vector(random, 0.1);
  return p;
}

}  // namespace

TEST_CASE("A tick of a grasp is the dense exponential of the patch with the tool moving linearly") {
  Random random(1);
  const int r = GENERATE(1, 5, 16);
  const Patch p = moving_grasp(random, r);
  // State (q, q', d, tool velocity, 1).
  const Eigen::Index n = r;
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(2 * n + 7, 2 * n + 7);
  a.block(0, n, n, n).setIdentity();
  a.block(n, 0, n, n).diagonal() = -p.stiffness;
  a.block(n, n, n, n) = -p.damping;
  a.block(n, 2 * n, n, 3) = p.b_k;
  a.block(n, 2 * n + 3, n, 3) = p.b_d;
  a.block(n, 2 * n + 6, n, 1) = p.g - p.b_d * p.tool_velocity;
  a.block(2 * n, 2 * n + 3, 3, 3).setIdentity();
  const Eigen::MatrixXd tick = (1e-3 * a).exp();
  Eigen::VectorXd z = Eigen::VectorXd::Zero(2 * n + 7);
  z.segment(n, n) = p.q_rate;
  z[2 * n + 6] = 1;
  PatchPlayer player(p);
  Vec3 tool = p.tool;
  for (int ms = 1; ms <= 500; ++ms) {
    const Vec3 next = tool + random_vector(random, 2e-4);
    z.segment<3>(2 * n + 3) = (next - tool) / 1e-3;
    z = tick * z;
    const Vec3 rate = (next - tool) / 1e-3 - p.tool_velocity;
    const Vec3 force = p.force - p.k_port * (next - p.tool) - p.d_port * rate + p.b_k.transpose() * z.head(n) +
                       p.b_d.transpose() * (z.segment(n, n) - p.q_rate);
    const Vec3 played = player.advance({kStamp + ms * kTick, next}).force;
    CHECK((played - force).norm() < 1e-9 * (1 + force.norm()));
    tool = next;
  }
}

TEST_CASE("Stress that fades takes from a grasp what the dense exponential with its branches as states has") {
  Random random(21);
  const int r = GENERATE(1, 6, 16);
  Patch p = moving_grasp(random, r);
  p.fading.count = 2;
  for (PatchBranch& branch : p.fading.branches()) {
    branch.prony = {0.35, random.uniform(0.02, 0.3)};
    branch.pull.resize(r + 3);
    branch.pull << random_vector(random, 1), random_modes(random, r, 5);
  }
  // State (q, q', d, tool velocity, s of each branch on (d, q), 1).
  const Eigen::Index n = r, s = 2 * n + 6, one = s + 2 * (n + 3);
  Eigen::MatrixXd h = Eigen::MatrixXd::Zero(n + 3, n + 3);
  h.topLeftCorner<3, 3>() = p.k_port;
  h.bottomRightCorner(n, n).diagonal() = p.stiffness;
  h.bottomLeftCorner(n, 3) = -p.b_k;
  h.topRightCorner(3, n) = -p.b_k.transpose();
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(one + 1, one + 1);
  a.block(0, n, n, n).setIdentity();
  a.block(n, 0, n, n).diagonal() = -p.stiffness;
  a.block(n, n, n, n) = -p.damping;
  a.block(n, 2 * n, n, 3) = p.b_k;
  a.block(n, 2 * n + 3, n, 3) = p.b_d;
  a.block(n, one, n, 1) = p.g - p.b_d * p.tool_velocity;
  a.block(2 * n, 2 * n + 3, 3, 3).setIdentity();
  for (Eigen::Index k = 0; k < 2; ++k) {
    const PatchBranch& branch = p.fading.of[static_cast<std::size_t>(k)];
    const Eigen::Index at = s + k * (n + 3);
    const double rate = 1 / branch.prony.time_s;
    a.block(n, at + 3, n, n) += branch.prony.share * Eigen::MatrixXd::Identity(n, n);
    a.block(at, at, n + 3, n + 3) -= rate * Eigen::MatrixXd::Identity(n + 3, n + 3);
    a.block(at, 2 * n, n + 3, 3) += rate * h.leftCols<3>();
    a.block(at, 0, n + 3, n) += rate * h.rightCols(n);
    a.block(at, one, n + 3, 1) += rate * branch.pull;
  }
  const Eigen::MatrixXd tick = (1e-3 * a).exp();
  Eigen::VectorXd z = Eigen::VectorXd::Zero(one + 1);
  z.segment(n, n) = p.q_rate;
  z[one] = 1;
  PatchPlayer player(p);
  Patch elastic = p;
  elastic.fading.count = 0;
  PatchPlayer without(elastic);
  double off = 0, faded = 0, most = 0;
  Vec3 tool = p.tool;
  for (int ms = 1; ms <= 500; ++ms) {
    const Vec3 next = p.tool + Vec3(4e-3 * std::sin(0.02 * ms), 2e-3 * std::sin(0.011 * ms), 1e-6 * ms);
    z.segment<3>(2 * n + 3) = (next - tool) / 1e-3;
    z = tick * z;
    const Vec3 rate = (next - tool) / 1e-3 - p.tool_velocity;
    Vec3 force = p.force - p.k_port * (next - p.tool) - p.d_port * rate + p.b_k.transpose() * z.head(n) +
                 p.b_d.transpose() * (z.segment(n, n) - p.q_rate);
    for (Eigen::Index k = 0; k < 2; ++k)
      force += p.fading.of[static_cast<std::size_t>(k)].prony.share * z.segment<3>(s + k * (n + 3));
    off = std::max(off, (player.advance({kStamp + ms * kTick, next}).force - force).norm());
    faded = std::max(faded, (without.advance({kStamp + ms * kTick, next}).force - force).norm());
    most = std::max(most, force.norm());
    tool = next;
  }
  CHECK(off < 0.01 * faded);
  CHECK(faded > 0.1 * most);
}

TEST_CASE("A load of other tools grows with time until its end and then stays, exactly") {
  Random random(8);
  const int r = GENERATE(1, 5, 8);
  const auto kind = GENERATE(ContactKind::attach, ContactKind::touch);
  Patch p = kind == ContactKind::attach ? moving_grasp(random, r) : floor_patch(r);
  p.touching = kind == ContactKind::attach;
  p.load_rate = random_modes(random, r, 40);
  p.load_for = Micros{60'000};
  // State (q, q', growth of the load per second, load); the tool rests where it was (attach) or far above (touch).
  const Eigen::Index n = r;
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(4 * n, 4 * n);
  a.block(0, n, n, n).setIdentity();
  a.block(n, 0, n, n).diagonal() = -p.stiffness;
  a.block(n, n, n, n) = -p.damping;
  a.block(n, 3 * n, n, n).setIdentity();
  a.block(3 * n, 2 * n, n, n).setIdentity();
  const Eigen::MatrixXd tick = (1e-3 * a).exp();
  Eigen::VectorXd z = Eigen::VectorXd::Zero(4 * n);
  z.segment(n, n) = p.q_rate;
  z.segment(2 * n, n) = p.load_rate;
  z.tail(n) = p.g;
  if (kind == ContactKind::attach) z.tail(n) -= p.b_d * p.tool_velocity;
  PatchPlayer player(p);
  const Vec3 tool = kind == ContactKind::attach ? p.tool : Vec3(0, 0, 0.5);
  if (kind == ContactKind::touch) player.advance({kStamp + kTick, tool});
  for (int ms = 1; ms <= 200; ++ms) {
    z = tick * z;
    if (ms == 60) z.segment(2 * n, n).setZero();
    player.advance({kStamp + ms * kTick, tool});
    const double energy = 0.5 * (z.segment(n, n).squaredNorm() + z.head(n).cwiseAbs2().dot(Eigen::VectorXd(p.stiffness)));
    CHECK(player.energy() == Approx(energy).epsilon(1e-8));
  }
}

TEST_CASE("Several ticks at once are the tool moving linearly through them") {
  Random random(2);
  const Patch p = moving_grasp(random, 8);
  PatchPlayer at_once(p), one_by_one(p);
  const Vec3 end = p.tool + Vec3(0.01, -0.004, 0.002);
  for (int k = 1; k <= 7; ++k) one_by_one.advance({kStamp + k * kTick, p.tool + (k / 7.0) * (end - p.tool)});
  at_once.advance({kStamp + 7 * kTick, end});
  CHECK((at_once.output().force - one_by_one.output().force).norm() < 1e-9);
  CHECK(at_once.energy() == Approx(one_by_one.energy()));
  // Less than half a tick has no effect.
  const Vec3 before = at_once.output().force;
  CHECK(at_once.advance({kStamp + 7 * kTick + Micros{499}, Vec3::Zero()}).force == before);
}

TEST_CASE("The energy of a patch that nothing drives never grows") {
  Random random(3);
  for (int trial = 0; trial < 6; ++trial) {
    const int r = 1 + 3 * trial;
    Patch p = moving_grasp(random, r);
    p.g.setZero();
    p.tool_velocity.setZero();
    if (trial == 2) p.damping.setZero();
    if (trial == 3) p.stiffness.head(2).setZero();
    PatchPlayer player(p);
    double last = player.energy();
    REQUIRE(last > 0);
    double worst = 0;
    for (int ms = 1; ms <= 10'000; ++ms) {
      player.advance({kStamp + ms * kTick, p.tool});
      worst = std::max(worst, player.energy() / last - 1);
      last = player.energy();
    }
    CHECK(worst < 1e-12);
  }
}

TEST_CASE("A grasp at rest responds to a slow tool with the static stiffness of the patch") {
  Patch p = test::attach_patch(6, 1, kStamp);
  PatchPlayer player(p);
  const Vec3 d(0.003, -0.002, 0.001);
  for (int ms = 1; ms <= 5000; ++ms) player.advance({kStamp + ms * kTick, std::min(1.0, ms / 500.0) * d});
  const Mat3 stiffness = p.k_port - p.b_k.transpose() * p.stiffness.cwiseInverse().asDiagonal() * p.b_k;
  CHECK((player.output().force + stiffness * d).norm() < 1e-6 * (stiffness * d).norm());
}

TEST_CASE("Touch begins in the very tick in which the tool crosses the surface, and ends when it would pull") {
  const Patch p = test::touch_patch(8, 1, kStamp);
  PatchPlayer player(p);
  const auto height = [](int ms) { return ms <= 60 ? 0.0103 - 0.0005 * ms : -0.0197 + 0.0005 * (ms - 60); };
  int onset = 0, release = 0;
  for (int ms = 1; ms <= 130; ++ms) {
    const PlayerOutput out = player.advance({kStamp + ms * kTick, Vec3(0.003, 0.004, height(ms))});
    CHECK(out.contact == (out.force.norm() > 0));
    if (out.contact) CHECK(out.force.z() > 0);
    if (out.contact && onset == 0) onset = ms;
    if (!out.contact && onset > 0 && release == 0) release = ms;
  }
  CHECK(onset == 21);
  CHECK(release > 60);
  CHECK(release <= 101);
}

TEST_CASE("A tool beside the local surface does not touch it") {
  PatchPlayer player(test::touch_patch(8, 1, kStamp));
  for (int ms = 1; ms <= 20; ++ms) CHECK_FALSE(player.advance({kStamp + ms * kTick, Vec3(0.03, 0, -0.001 * ms)}).contact);
}

TEST_CASE("A push that grows is felt as it is at the end of the tick, whether contact is soft or stiff") {
  // One mode under a tool that descends ever faster: m q'' + d q' + (k + k_c) q = k_c h, by the dense exponential of (q, q', h,
  // h', h''). The remaining error is of second order in the tick.
  Patch p = pressed_floor(Eigen::RowVectorXd::Constant(1, 3));
  p.contact_stiffness_n_m = GENERATE(200, 1000, 5000);
  p.damping(0, 0) = 200;
  constexpr double kJerky = 20, kRow = 3;
  Eigen::Matrix<double, 5, 5> a = Eigen::Matrix<double, 5, 5>::Zero();
  a(0, 1) = a(2, 3) = a(3, 4) = 1;
  a.row(1) << -p.stiffness[0] - kRow * kRow * p.contact_stiffness_n_m, -p.damping(0, 0), kRow * p.contact_stiffness_n_m, 0, 0;
  const Eigen::Matrix<double, 5, 5> tick = (1e-3 * a).exp();
  Eigen::Matrix<double, 5, 1> z = Eigen::Matrix<double, 5, 1>::Zero();
  z[4] = -kJerky;
  PatchPlayer player(p);
  double worst_n = 0, half_a_tick_n = 0, before_n = 0;
  for (int ms = 1; ms <= 40; ++ms) {
    z = tick * z;
    const double force = -p.contact_stiffness_n_m * (z[2] - kRow * z[0]);
    worst_n = std::max(worst_n, std::abs(player.advance({kStamp + ms * kTick, {0, 0, z[2]}}).force.z() - force));
    half_a_tick_n = std::max(half_a_tick_n, 0.5 * std::abs(force - before_n));
    before_n = force;
  }
  CHECK(worst_n < 0.1 * half_a_tick_n);
}

TEST_CASE("A body that leans on a contact stiffer than a step moves it comes to rest there, without a swing from step to step") {
  Patch p = pressed_floor(Eigen::RowVectorXd::Constant(1, 3));
  p.g[0] = 30;                    // 10 N
  p.contact_stiffness_n_m = 1e6;  // moves the mode by 4.5 times its own compliance
  PatchPlayer player(p);
  for (int ms = 1; ms <= 60; ++ms) {
    const double force_n = player.advance({kStamp + ms * kTick, Vec3::Zero()}).force.z();
    CAPTURE(p.contact_stiffness_n_m, ms);
    if (ms > 30) CHECK(force_n == Approx(10).epsilon(0.001));
  }
}

TEST_CASE("A resting push is the compliance of the modes in series with the contact") {
  const Patch p = floor_patch(8);
  PatchPlayer player(p);
  const double depth = 0.004;
  for (int ms = 1; ms <= 6000; ++ms)
    player.advance({kStamp + ms * kTick, Vec3(0.003, 0.002, -depth * std::min(1.0, ms / 300.0))});
  const PortRows& rows = p.surface.vertices[0].rows;
  const Mat3 compliance = p.c_static + Mat3(rows * p.stiffness.cwiseInverse().asDiagonal() * rows.transpose());
  CHECK(player.output().force.z() == Approx(depth / (compliance(2, 2) + 1 / p.contact_stiffness_n_m)).epsilon(1e-4));
}

// With f = -lambda at the end of tick n, its mean m_n = (1 - s) lambda_n + s lambda_n-1 and the tool h, the energy that the tool
// puts in is sum_n m_n . (h_n - h_n-1). In contact h = p + lambda / k_c, so this is the work on the modes (exact, as the mean is
// constant inside a tick), which is their energy and the dissipation of D, plus sum m_n . (lambda_n - lambda_n-1) / k_c >=
// (lambda_end^2 - lambda_begin^2) / (2 k_c), plus, at an onset from outside, a push through a gap, which is positive too. In the
// tick in which contact ends the force lasts as long as the surface. From rest without contact back to no contact it cannot be
// negative.
TEST_CASE("Over any cycle from no contact to no contact, without friction, a tool puts energy in and gets none out") {
  Random random(4);
  for (int trial = 0; trial < 20; ++trial) {
    Patch p = floor_patch(8);
    p.damping = random_damping(random, 8, trial % 2 ? 0.0 : 5.0);
    p.c_static *= trial % 3;
    PatchPlayer player(p);
    const double fast = random.uniform(0.01, 0.4), wide = random.uniform(0, 0.01), deep = random.uniform(0.004, 0.01);
    Vec3 last(0, 0, 0.003), lambda = Vec3::Zero(), surface = player.vertex(0);
    double work = 0, through = 0;
    bool out_of_contact = true;
    for (int ms = 1; ms <= 4000 || !out_of_contact; ++ms) {
      const double t = ms < 4000 ? ms : 4000;
      Vec3 tool(wide * std::sin(0.3 * fast * t), wide * std::cos(0.21 * fast * t), 0.002 - deep * std::sin(fast * t));
      if (ms > 4000) tool.z() = 0.0005 * (ms - 4000);
      const PlayerOutput out = player.advance({kStamp + ms * kTick, tool});
      const Vec3 moved = out.contact ? Vec3(tool - last) : Vec3(player.vertex(0) - surface);
      const double now = 0.5 * (lambda - out.force).dot(moved);
      work += now;
      through += std::abs(now);
      last = tool;
      lambda = -out.force;
      surface = player.vertex(0);
      out_of_contact = !out.contact;
      if (out_of_contact) CHECK(work >= -1e-9 * through);
      // The energy in the modes came from the tool.
      CHECK(player.energy() <= work + 1e-9 * through);
    }
    CHECK(through > 0);
  }
}

TEST_CASE("Friction in a stroke stays on the cone and takes energy") {
  Patch p = floor_patch(8);
  p.friction = 0.4;
  PatchPlayer player(p);
  double work = 0;
  Vec3 last(-0.015, 0, 0.001);
  for (int ms = 1; ms <= 2000; ++ms) {
    const Vec3 tool(0.015 * std::sin(0.01 * ms), 0, -0.004 * std::min(1.0, ms / 200.0));
    const Vec3 force = player.advance({kStamp + ms * kTick, tool}).force;
    CHECK(force.head<2>().norm() <= 0.4 * force.z() * (1 + 1e-9) + 1e-12);
    work -= force.dot(tool - last);
    last = tool;
  }
  CHECK(work > 0);
}

TEST_CASE("A tool that slides off the surface of a patch feels it go on as it is at the border, and brake it both ways") {
  Patch p = floor_patch(8);
  p.friction = 0.4;
  Patch wide = p;
  for (PortVertex& v : wide.surface.vertices) v.position.head<2>() *= 10;
  PatchPlayer player(p), on_wide(wide);
  double reach = 0;
  for (int i = 0; i < p.surface.vertex_count; ++i)
    reach = std::max(reach, p.surface.vertices[static_cast<std::size_t>(i)].position.head<2>().norm());
  const double far = 2 * reach;
  int back_outside = 0;
  for (int ms = 1; ms <= 4000; ++ms) {
    const double phase = 0.002 * ms;
    const Vec3 tool(far * std::sin(phase), 0.3 * far * std::sin(2.5 * phase), -0.004 * std::min(1.0, ms / 200.0));
    const Vec3 force = player.advance({kStamp + ms * kTick, tool}).force;
    CHECK((force - on_wide.advance({kStamp + ms * kTick, tool}).force).norm() < 1e-9);
    if (ms <= 200 || std::abs(tool.x()) <= reach || std::abs(std::cos(phase)) < 0.3) continue;
    CHECK(force.x() * std::cos(phase) < 0);
    back_outside += std::sin(phase) * std::cos(phase) < 0 ? 1 : 0;
  }
  CHECK(back_outside > 100);
}

TEST_CASE("A tool that slides without friction is pushed along the normal of where it is at the tick's end") {
  constexpr double kRadiusM = 0.06, kC = 1e-4;
  Patch p = test::touch_patch(0, 1, kStamp);
  p.friction = 0;
  p.c_static = kC * Mat3::Identity();
  std::vector<double> x;
  for (int i = 0; i < p.surface.vertex_count; ++i) {
    Vec3& at = p.surface.vertices[static_cast<std::size_t>(i)].position;
    at.z() = -0.5 * at.head<2>().squaredNorm() / kRadiusM;
    x.insert(x.end(), at.data(), at.data() + 3);
  }
  const auto end = p.surface.triangles.begin() + p.surface.triangle_count;
  const Surface surface({p.surface.triangles.begin(), end}, x.size() / 3);
  PatchPlayer player(p);
  for (int ms = 1; ms <= 1000; ++ms) {
    const double phase = 2 * std::numbers::pi * ms / 1000;
    const Vec3 tool(0.015 * std::sin(2 * phase), 0.012 * std::sin(phase), -0.006 * std::min(1.0, ms / 50.0));
    const PlayerOutput out = player.advance({kStamp + ms * kTick, tool});
    if (ms < 60) continue;
    REQUIRE(out.contact);
    // With the springs in series, the point that belongs to the force is on the surface, and the force along its normal.
    const Vec3 point = tool + (kC + 1 / p.contact_stiffness_n_m) * out.force;
    const NearestPoint nearest = nearest_point(surface.view(), x, point);
    CHECK(std::abs(nearest.height_m) < 2e-6);
    CHECK((out.force.normalized() - nearest.normal).norm() < 1e-3);
  }
}

TEST_CASE("A constant patch shows its force") {
  Patch p;
  p.constant = true;
  p.stamp = kStamp;
  p.force = Vec3(1, 2, 3);
  PatchPlayer hold(p);
  CHECK(hold.advance({kStamp + kTick, Vec3::Ones()}).force == p.force);
}
