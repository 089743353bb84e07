// Patches of the paper's schemes `two-layer` and `balanced`, and the replay of `filtered`.
#include "bench/paper/paper_patches.hpp"

#include <Eigen/LU>
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "bench/paper/compared_scheme.hpp"
#include "common/base/error.hpp"
#include "tests/support/bodies.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

constexpr Micros kPaperHorizon{100'000};
constexpr double kPaperShift = 20;  // 2 / horizon

Scene scene_of(LumpedBody body, ContactKind contact) {
  Scene scene = box_scene(contact);
  scene.body = std::move(body);
  return scene;
}

/// A body in some state with a tool on it, and the patch of scheme `hold` for both.
struct PaperBench {
  Scene scene;
  Dynamics dynamics{scene.body};
  Skin skin{scene.body, scene.tool.radius_m};
  Room::Origin at;
  Patch held;

  PaperBench(LumpedBody body, ContactKind kind, double shift_m, double speed_m_s)
      : scene(scene_of(std::move(body), kind)), at{random_state(dynamics, 5, shift_m, speed_m_s), {}, {}} {
    at.port.kind = held.contact = kind;
    at.port.parameters = {1000, 0.3};
    held.constant = true;
    held.valid_for = 2 * kPaperHorizon;
    held.trust_radius_m = 0.1;
  }
  PaperBench& attach(std::uint32_t node) {
    at.port.node = node;
    held.tool = node_of(at.body.x, node);
    held.tool_velocity = node_of(at.body.v, node);
    held.force = dynamics.element_force(at.body, node);
    held.touching = true;
    return *this;
  }
  PaperBench& touch(std::uint32_t triangle, const Vec3& weight) {
    at.port.point = {triangle, weight};
    const Positions x(at.body.x.data(), static_cast<std::size_t>(at.body.x.size()));
    held.tool = position_at(skin.view(), x, at.port.point) + 0.001 * normal_at(skin.view(), x, at.port.point);
    return *this;
  }
  Patch build(PaperPatches::Model model) {
    const auto patch = PaperPatches(model, scene).build(at, held, kPaperHorizon);
    REQUIRE(patch);
    REQUIRE(check(*patch) == PatchFault::none);
    return *patch;
  }
};

Mat3 patch_stiffness_at(const Patch& p, double s) {
  Matrix dynamic = s * Matrix(p.damping);
  dynamic.diagonal() += p.stiffness + s * s * ModeVector::Ones(p.modes());
  const Matrix port = Matrix(p.b_k) + s * Matrix(p.b_d);
  return p.k_port + s * p.d_port - port.transpose() * dynamic.lu().solve(port);
}

}  // namespace

TEST_CASE("A two-layer patch responds as the unreduced local model at the matched frequency, and starts as the body does") {
  PaperBench bench(box_body(6, 6, 6), ContactKind::attach, 0.0005, 0.05);
  const std::uint32_t node = 2 + 6 * (2 + 6 * 5);
  const Patch patch = bench.attach(node).build(PaperPatches::Model::two_layer);
  const SecondOrderSystem local = two_layer_system(bench.dynamics, bench.at.body, node);
  CHECK(patch.modes() < local.size());
  const Matrix exact = TransferFunction(local)(kPaperShift).real();
  // Couplings of D make room for their rounding on the wire.
  CHECK((patch_stiffness_at(patch, kPaperShift) - exact).norm() < 1e-4 * exact.norm());
  CHECK((patch.force - bench.dynamics.element_force(bench.at.body, node)).norm() == 0);

  // The body's velocity lies in the basis, so its kinetic energy there is that of the rescaled masses.
  double energy = 0;
  for (Eigen::Index i = 0; i < local.size(); ++i)
    energy += local.mass[i] * std::pow(bench.at.body.v[local.coordinates[static_cast<std::size_t>(i)]], 2);
  CHECK(patch.q_rate.squaredNorm() == Approx(energy).epsilon(1e-9));
}

TEST_CASE("A two-layer patch is pushed by the body's own residual force, not by that of rescaled springs") {
  // Stretched evenly: inside, every node is in equilibrium though every spring is in tension.
  PaperBench bench(box_body(6, 6, 6), ContactKind::attach, 0, 0);
  for (Eigen::Index i = 2; i < bench.at.body.x.size(); i += 3) bench.at.body.x[i] *= 1.05;
  CHECK(bench.attach(2 + 6 * (2 + 6 * 3)).build(PaperPatches::Model::two_layer).g.norm() < 1e-9);
}

TEST_CASE("A patch of the paper's schemes passes the receiver's check, at rest and compressed, in a grasp and in a touch") {
  const auto model = GENERATE(PaperPatches::Model::two_layer, PaperPatches::Model::balanced);
  const auto kind = GENERATE(ContactKind::attach, ContactKind::touch);
  for (const double shift_m : {0.0, 0.001, 0.01}) {
    PaperBench bench(box_body(4, 4, 4), kind, shift_m, 0.1);
    const Patch patch = bench.attach(54).touch(20, Vec3(0.3, 0.3, 0.4)).build(model);
    CHECK(patch.modes() == (kind == ContactKind::attach ? 11 : 8));
    for (int i = 1; i < patch.modes(); ++i) CHECK(patch.stiffness[i] >= patch.stiffness[i - 1]);
    if (kind == ContactKind::touch) CHECK(patch.surface.vertex_count >= 6);
  }
}

TEST_CASE("Every scheme of a server is compared, by the same name, and those of the paper alone suit some bodies") {
  for (const std::string_view name : kSchemeNames) CHECK(offered(compared_scheme(std::string(name))) == scheme_from_name(name));
  for (const ComparedScheme scheme : {ComparedScheme::filtered, ComparedScheme::two_layer, ComparedScheme::balanced})
    CHECK_FALSE(offered(scheme));
  CHECK_THROWS_AS(compared_scheme("held"), InputError);
  const LumpedBody springs = box_body(3, 3, 3), solid = solid_box(3, 3, 3, {});
  CHECK(suits(ComparedScheme::two_layer, springs));
  CHECK_FALSE(suits(ComparedScheme::two_layer, solid));
  CHECK(suits(ComparedScheme::balanced, solid));
  CHECK(suits(ComparedScheme::hyper, solid));
}

TEST_CASE("The filtered scheme feels what hold feels, through a first-order low-pass") {
  const Scene scene = box_scene(ContactKind::attach);
  const Vec3 home = home_of(scene);
  const Motion motion({{0, home}, {0.3, home - Vec3(0, 0, 0.004)}, {0.6, home}});
  const auto play = [&](ComparedScheme scheme) {
    ReplayOptions options;
    select(scheme, scene, options);
    return replay(scene, motion, options, [] { return std::int64_t{0}; });
  };
  const ReplayResult hold = play(ComparedScheme::hold), filtered = play(ComparedScheme::filtered);
  REQUIRE(hold.ticks.size() == filtered.ticks.size());
  // The sum over all past forces, each weighted by what is left of it.
  const double kept = std::exp(-2 * std::numbers::pi * kPaperLowPassHz * 1e-3);
  for (const std::size_t tick : {1u, 100u, 500u}) {
    Vec3 sum = std::pow(kept, static_cast<double>(tick)) * hold.ticks[0].felt;
    for (std::size_t k = 1; k <= tick; ++k)
      sum += (1 - kept) * std::pow(kept, static_cast<double>(tick - k)) * hold.ticks[k].felt;
    CHECK((filtered.ticks[tick].felt - sum).norm() < 1e-12);
  }
  CHECK(filtered.fidelity.snr_db != hold.fidelity.snr_db);
}

TEST_CASE("A replay plays the patches of the paper's schemes, better than a held force", "[paper]") {
  const Scene scene = box_scene(ContactKind::attach);
  const Vec3 home = home_of(scene);
  std::vector<MotionPoint> points;
  for (int ms = 0; ms <= 800; ++ms)
    points.push_back({1e-3 * ms, home - Vec3(0, 0, 0.002 * (1 - std::cos(2 * std::numbers::pi * 1e-3 * ms)))});
  const Motion motion(std::move(points));
  const auto snr_db = [&](ComparedScheme scheme) {
    ReplayOptions options;
    select(scheme, scene, options);
    return replay(scene, motion, options, [] { return std::int64_t{0}; }).fidelity.snr_db;
  };
  const double hold = snr_db(ComparedScheme::hold);
  CHECK(snr_db(ComparedScheme::two_layer) > hold);
  CHECK(snr_db(ComparedScheme::balanced) > hold + 10);
}
