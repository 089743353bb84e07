// Force on a tool after sliding: closed forms for a patch whose modes represent one place only.
#include "common/player/slide_compliance.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <catch2/catch.hpp>
#include <cmath>

#include "common/base/random.hpp"
#include "common/player/player.hpp"
#include "tests/support/patches.hpp"

using namespace palpate;

namespace {

constexpr Micros kSlideStamp{5'000'000};

PortRows random_rows(Random& random, int modes, double size) {
  PortRows rows(3, modes);
  for (double& entry : rows.reshaped()) entry = random.uniform(-size, size);
  return rows;
}

Mat3 random_rotation(Random& random) {
  return Eigen::Quaterniond(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1))
      .normalized()
      .toRotationMatrix();
}

/// R (s^2 + s D + K)^-1 R^T.
Mat3 of_modes(const Patch& patch, const PortRows& rows) {
  const double s = SlideCompliance::kShift_1_s;
  Eigen::MatrixXd dynamic = s * patch.damping;
  dynamic.diagonal() += patch.stiffness;
  dynamic.diagonal().array() += s * s;
  return rows * dynamic.inverse() * rows.transpose();
}

double least(const Mat3& symmetric) {
  return Eigen::SelfAdjointEigenSolver<Mat3>(0.5 * (symmetric + symmetric.transpose())).eigenvalues()[0];
}

/// A flat frictionless surface whose modes move the three vertices at x < 0 alike and the others not at all.
Patch known_on_one_side(int modes) {
  Patch patch = test::touch_patch(modes, 1, kSlideStamp);
  patch.friction = 0;
  patch.c_static = 1e-6 * Mat3::Identity();
  PortRows rows = PortRows::Zero(3, modes);  // each mode along one axis
  for (int mode = 0; mode < modes; ++mode) rows(mode % 3, mode) = 2;
  for (int i = 0; i < patch.surface.vertex_count; ++i) {
    PortVertex& vertex = patch.surface.vertices[static_cast<std::size_t>(i)];
    vertex.rows = (vertex.position.x() < -0.01 ? 1.0 : 0.0) * rows;
  }
  patch.point = {0, Vec3(1, 0, 0)};
  return patch;
}

}  // namespace

TEST_CASE("Where the modes do not move the surface, it yields at once what it yields at the stamp, less what may be missing") {
  const Patch patch = known_on_one_side(8);
  const PortRows& at_stamp = patch.surface.vertices[0].rows;
  const Mat3 modes = of_modes(patch, at_stamp), whole = modes + patch.c_static;
  REQUIRE(least(0.75 * modes - SlideCompliance::kMissingShareMin * whole) > 0);
  const Vec3 corner(1, 0, 0), edge(0.5, 0.5, 0);
  const SlideCompliance slide(patch, at_stamp, corner);
  // In the metric of C_0 the missing part is C_a = C_0 - c_static: all of it except theta, where c_static is small.
  const Mat3 missing = slide.missing(PortRows::Zero(3, 8), corner);
  CHECK((missing - (modes - SlideCompliance::kMissingShareMin * whole)).norm() < 1e-5 * whole.norm());
  CHECK(slide.missing(at_stamp, corner).norm() == 0);
  CHECK(slide.missing(0.9 * at_stamp, corner).norm() == 0);
  // Evaluated by hand for a point at which the modes move half as far.
  const Mat3 half = slide.missing(0.5 * at_stamp, corner);
  CHECK((half - (0.75 * modes - SlideCompliance::kMissingShareMin * whole)).norm() < 1e-5 * whole.norm());
  // A push shared by two nodes yields half as much, but no more than at a stamp where it was shared.
  CHECK((slide.missing(PortRows::Zero(3, 8), edge) - 0.5 * missing).norm() < 1e-12 * whole.norm());
  const SlideCompliance shared(patch, at_stamp, edge);
  CHECK((shared.missing(PortRows::Zero(3, 8), corner) - missing).norm() < 1e-12 * whole.norm());
}

TEST_CASE("What is missing turns with the frame, is never negative and leaves no more than a share missing") {
  Random random(11);
  for (int trial = 0; trial < 50; ++trial) {
    Patch patch = test::touch_patch(1 + trial % 13, 1, kSlideStamp);
    const PortRows a = random_rows(random, patch.modes(), 2), p = random_rows(random, patch.modes(), 2);
    const Vec3 weight(0.2, 0.5, 0.3);
    const Mat3 missing = SlideCompliance(patch, a, weight).missing(p, weight);
    const Mat3 whole = of_modes(patch, a) + patch.c_static;
    CHECK(least(missing) >= -1e-12 * whole.norm());
    const Mat3 left = of_modes(patch, a) - of_modes(patch, p) - missing;
    CHECK(least(SlideCompliance::kMissingShareMin * whole - left) >= -1e-5 * whole.norm());
    const Mat3 turn = random_rotation(random);
    const Mat3 turned = SlideCompliance(patch, turn * a, weight).missing(turn * p, weight);  // c_static is isotropic
    CHECK((turned - turn * missing * turn.transpose()).norm() < 1e-9 * whole.norm());
  }
}

TEST_CASE("A push that slides on never yields less than before") {
  Random random(12);
  for (int trial = 0; trial < 50; ++trial) {
    const PortRows a = random_rows(random, 3, 1), b = random_rows(random, 3, 1);
    const Mat3 before = a * a.transpose(), missing = b * b.transpose(), grown = SlideCompliance::grown(before, missing);
    CHECK(least(grown - before) >= -1e-12);
    CHECK(least(grown - missing) >= -1e-12);
    CHECK((SlideCompliance::grown(grown, missing) - grown).norm() < 1e-12);
    CHECK((SlideCompliance::grown(before, before + missing) - (before + missing)).norm() < 1e-12);
  }
}

TEST_CASE("A body that is held everywhere yields nowhere") {
  Patch patch = test::touch_patch(4, 1, kSlideStamp);
  patch.c_static.setZero();
  const Vec3 weight(0.2, 0.5, 0.3);
  const SlideCompliance slide(patch, PortRows::Zero(3, 4), weight);
  CHECK(slide.missing(PortRows::Zero(3, 4), weight).norm() == 0);
}

TEST_CASE("A tool that has slid to where the modes do not follow rests on what the body yields there, with terms on c_static") {
  const Patch patch = known_on_one_side(8);
  NonlinearTerms terms = test::spring_terms(patch);
  terms.elements.stiffness.setZero();  // without force
  terms.elements.damping.setZero();
  const SlideCompliance slide(patch, patch.surface.vertices[0].rows, patch.point.weight);
  const Mat3 missing = slide.missing(PortRows::Zero(3, 8), patch.point.weight);
  REQUIRE(missing(2, 2) > 2 * patch.c_static(2, 2));
  for (const bool bends : {false, true}) {
    PatchPlayer player(patch, bends ? terms : NonlinearTerms{});
    constexpr double kDepth = 0.004, kFrom = -0.0195, kTo = 0.001;  // along y = 0, over the vertex in the middle
    for (int ms = 1; ms <= 8000; ++ms) {
      const double in = std::min(1.0, ms / 300.0), along = std::clamp((ms - 500) / 400.0, 0.0, 1.0);
      player.advance({kSlideStamp + ms * kTick, Vec3(kFrom + along * (kTo - kFrom), 0, -kDepth * in)});
    }
    const Mat3 compliance = bends ? patch.c_static : Mat3(patch.c_static + missing);
    CHECK(player.output().force.z() == Approx(kDepth / (compliance(2, 2) + 1 / patch.contact_stiffness_n_m)).epsilon(5e-3));
  }
}

TEST_CASE("A tool that slides over a body known in one place gets out no more than it put in, whichever way it goes") {
  const bool bends = GENERATE(false, true);
  Random random(13);
  for (int trial = 0; trial < 20; ++trial) {
    const Patch patch = known_on_one_side(8);
    PatchPlayer player(patch, bends ? test::slack_spring_terms(patch) : NonlinearTerms{});
    const double fast = random.uniform(0.01, 0.1), along = random.uniform(0.005, 0.05), from = random.uniform(0, 6);
    Vec3 last(0, 0, 0.003), force = Vec3::Zero();
    double work = 0;
    for (int ms = 1; ms <= 6000; ++ms) {
      const Vec3 tool(0.018 * std::sin(along * ms + from), 0.01 * std::cos(0.7 * along * ms),
                      0.001 - 0.004 * std::sin(fast * ms));
      const Vec3 now = player.advance({kSlideStamp + ms * kTick, tool}).force;
      work -= 0.5 * (force + now).dot(tool - last);
      last = tool;
      force = now;
      // The ticks in which contact ends amount to some uJ; returning the energy of the yielded motion would amount to 0.3 mJ.
      if (now.isZero(0)) CHECK(work >= -3e-5);
    }
    CHECK(work > 1e-3);
  }
}
