// A few tetrahedra that represent all: against the body's own forces at displacements that were not among the samples.
#include "server/reduction/sample_elements.hpp"

#include "server/sampling/gradient_points.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <random>
#include <set>

#include "server/sampling/element_gradient.hpp"
#include "server/scene/capsule.hpp"
#include "tests/support/bodies.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

constexpr Eigen::Index kTetraVariables = 6;

/// A block of finite elements with smooth shapes: an indentation of the top, sheared and twisted.
struct Block {
  LumpedBody body;
  Dynamics dynamics{body};
  BodyState state = random_state(dynamics, 5, 0.0005, 0);
  WholeBody whole{dynamics, state};
  Matrix moved = Matrix::Zero(state.x.size(), kTetraVariables), stiffness;
  Sampling sampling;

  explicit Block(SolidLaw law) : Block(solid_box(6, 6, 5, {law, 8e3, 0.45, 0.01})) {}
  explicit Block(LumpedBody of) : body(std::move(of)) {
    for (std::uint32_t i = 0; i < dynamics.nodes(); ++i) {
      if (body.fixed[i]) continue;
      const Vec3& x = body.nodes[i];
      const double far = (x - body.nodes.back()).norm(), indentation = std::exp(-far * far / (0.04 * 0.04)), up = x.z() / 0.1;
      auto rows = moved.middleRows<3>(3 * static_cast<Eigen::Index>(i));
      rows.col(0) = indentation * Vec3::UnitX();
      rows.col(1) = indentation * Vec3::UnitY();
      rows.col(2) = indentation * Vec3::UnitZ();
      rows.col(3) = up * Vec3::UnitX();
      rows.col(4) = up * up * Vec3::UnitY();
      rows.col(5) = up * Vec3(-x.y(), x.x(), 0) / 0.1;
    }
    Matrix k_moved, d_moved;
    whole.multiply(moved, k_moved, d_moved);
    stiffness = moved.transpose() * k_moved;
    sampling.budget = {kTetraVariables, false, false, 3, false, true};
    sampling.stiffness = stiffness.diagonal();
    sampling.likely = 0.004 * Matrix::Identity(kTetraVariables, kTetraVariables);
    sampling.likeliest = {0, 1, 2};
  }
  /// -N(u), by the body itself.
  Vector exact(const Vector& u) const {
    const Vector still = Vector::Zero(state.x.size());
    Vector here, there;
    dynamics.forces(state.x, still, here);
    dynamics.forces(state.x + moved * u, still, there);
    return -(moved.transpose() * (there - here) + stiffness * u);
  }
  /// Relative error of a force over 50 random displacements, in units in which each variable is equally stiff.
  double wrong(SampledSolidForce& force) const {
    std::mt19937 random(11);
    std::uniform_real_distribution<double> draw(-0.005, 0.005);
    const Vector unit = sampling.stiffness.cwiseSqrt().cwiseInverse();
    double wrong = 0, all = 0;
    for (int k = 0; k < 50; ++k) {
      const Vector u = Vector::NullaryExpr(kTetraVariables, [&] { return draw(random); }), should = exact(u);
      SampledSolidForce::Values g(kTetraVariables);
      force.move_to(u.cast<float>());
      force.gradient(g);
      wrong += unit.cwiseProduct(g.cast<double>() - should).squaredNorm();
      all += unit.cwiseProduct(should).squaredNorm();
    }
    return std::sqrt(wrong / all);
  }
};

}  // namespace

TEST_CASE("A tenth of the tetrahedra of a block bends as all of them do where it was not sampled, within a few hundredths") {
  const Block block(GENERATE(SolidLaw::neo_hookean, SolidLaw::corotational));
  const auto solid = sample_elements(block.whole, block.moved, block.sampling);
  REQUIRE(solid);
  CHECK(10 * solid->count() <= static_cast<int>(block.body.tetrahedra.size()));
  CHECK(numbers_of(block.sampling.budget, solid->motion.nodes(), solid->count()) <= kUsualNumbers);
  CHECK(solid->stiffness.minCoeff() > 0);
  SampledSolidForce force(*solid, 0, 1e-6, false);
  REQUIRE_FALSE(force.empty());
  CHECK(block.wrong(force) < 0.05);
}

TEST_CASE("A third of the hexahedra of a block bends as all of them do where it was not sampled, within a tenth") {
  const Block block(hexa_box(6, 6, 5, {GENERATE(SolidLaw::neo_hookean, SolidLaw::corotational), 8e3, 0.45, 0.01}));
  const auto solid = sample_elements(block.whole, block.moved, block.sampling);
  REQUIRE(solid);
  CHECK(3 * solid->count() <= static_cast<int>(block.body.hexahedra.size()));
  CHECK(numbers_of(block.sampling.budget, solid->motion.nodes(), solid->count()) <= kUsualNumbers);
  SampledSolidForce force(*solid, 0, 1e-6, false);
  REQUIRE_FALSE(force.empty());
  CHECK(block.wrong(force) < 0.1);
}

TEST_CASE("Few elements of a block in a capsule, of Ogden's law and with fibres, bend as all of them do") {
  SolidMaterial material{SolidLaw::neo_hookean, 8e3, 0.45, 0.01};
  const bool hexa = GENERATE(true, false), capsule = GENERATE(true, false);
  if (!capsule) material = {SolidLaw::ogden, 8e3, 0.45, 0.01, 0.3, {5, -4}, {{0.6, 0, 0.8}, 2, 1}};
  LumpedBody body = hexa ? hexa_box(6, 6, 5, material) : solid_box(6, 6, 5, material);
  if (capsule) add_capsule(body, {1e6, 1e-4, 0.3, 0.01});
  const Block block(body);
  const auto solid = sample_elements(block.whole, block.moved, block.sampling);
  REQUIRE(solid);
  int triangles = 0;
  for (int e = 0; e < solid->count(); ++e) triangles += solid->is_triangle(e);
  CHECK((triangles > 0) == capsule);
  CHECK(numbers_of(block.sampling.budget, solid->motion.nodes(), solid->count()) <= kUsualNumbers);
  SampledSolidForce force(*solid, 0, 1e-6, false);
  REQUIRE_FALSE(force.empty());
  CHECK(block.wrong(force) < 0.15);
}

TEST_CASE(
    "The places of a hexahedron have its mean gradient, those of a triangle beside it its own, moved by a tool that holds a node "
    "of it or not") {
  LumpedBody body = hexa_box(3, 3, 3, {SolidLaw::neo_hookean, 8e3, 0.45, 0.01});
  Random random(5);
  for (Vec3& x : body.nodes) x += random_vector(random, 0.1 * kSpacingM);
  add_capsule(body, {1e6, 1e-4, 0.3, 0.01});
  std::vector<std::uint32_t> chosen{0, 3, 6, 7, 10};
  for (std::uint32_t k = 0; k < body.tetrahedra.size(); ++k)
    if (std::find(body.tetrahedra[k].nodes.begin(), body.tetrahedra[k].nodes.end(), 22U) != body.tetrahedra[k].nodes.end())
      chosen.push_back(8 + k);
  REQUIRE(chosen.size() > 7);
  const Dynamics dynamics(body);
  const BodyState state = random_state(dynamics, 6, 0.2 * kSpacingM, 0);
  constexpr int kHeldNode = 22;
  Matrix moved(state.x.size(), 6);
  for (double& v : moved.reshaped()) v = random.uniform(-1, 1);
  moved.leftCols<3>().setZero();
  moved.middleRows<3>(3 * kHeldNode).setZero();
  moved.block<3, 3>(3 * kHeldNode, 0).setIdentity();
  const int tool = GENERATE_COPY(-1, kHeldNode);
  const GradientPoints places(dynamics, state, moved, chosen, tool);
  const Vector u = Vector::NullaryExpr(6, [&] { return random.uniform(-0.01, 0.01); });
  // Neighbouring triangles share their nodes; each hexahedron has three places of its own.
  std::set<std::uint32_t> corners;
  std::size_t cells = 0;
  for (const std::uint32_t e : chosen) {
    if (e < body.hexahedra.size()) {
      ++cells;
      continue;
    }
    const auto& nodes = body.tetrahedra[e - body.hexahedra.size()].nodes;
    corners.insert(nodes.begin(), nodes.end());
  }
  if (tool >= 0) corners.erase(kHeldNode);
  CHECK(places.count() == 2 + 3 * cells + corners.size());
  const Rows all = places.moved();
  for (const std::uint32_t e : places.elements()) {
    const TetraShape rest = places.rest(e);
    Mat34 at;
    for (int i = 0; i < 4; ++i) at.col(i) = at_node(places.at_stamp(), places.place(e, i));
    CHECK((rest.gradient(at) - mean_gradient(dynamics, e, state.x)).norm() < 1e-12);
    CHECK(rest.volume_m3 == element_gradient(dynamics, e).volume_m3);
    Mat3 change = Mat3::Zero();
    for (int i = 0; i < 4; ++i)
      change +=
          (all.middleRows<3>(3 * static_cast<Eigen::Index>(places.place(e, i))).cast<double>() * u) * rest.b.col(i).transpose();
    CHECK((change - mean_gradient(dynamics, e, moved * u)).norm() < 1e-5 * change.norm());
    for (int i = 0; i < 4 && tool >= 0; ++i)  // only the held node moves with the tool
      if (static_cast<int>(places.place(e, i)) != places.tool())
        CHECK(all.block<3, 3>(3 * static_cast<Eigen::Index>(places.place(e, i)), 0).norm() == 0);
  }
}

TEST_CASE("An element costs each of its new nodes once, a triangle too, which has one of them twice") {
  const auto numbers = [](int nodes, int elements) { return 100 * nodes + elements; };
  ByteCosts costs({0, 1, 2, 0, 1, 2, 3, 1, 4, 5, 6, 4}, 4, 7, numbers);
  costs.with({});
  CHECK(costs.of(0) == 301);
  costs.with({0});
  CHECK(costs.of(1) == 101);
  CHECK(costs.of(2) == 301);
}

TEST_CASE("All tetrahedra of a small solid, sampled with a weight of one, are its own forces") {
  const SolidLaw law = GENERATE(SolidLaw::neo_hookean, SolidLaw::corotational);
  LumpedBody body = solid_box(3, 3, 2, {law, 8e3, 0.45, 0.01});
  const Dynamics dynamics(body);
  const BodyState state = random_state(dynamics, 5, 0.002, 0);
  const WholeBody whole(dynamics, state);
  Random random(3);
  Matrix moved(state.x.size(), 4);
  for (double& v : moved.reshaped()) v = random.uniform(-1, 1);
  for (std::uint32_t i = 0; i < dynamics.nodes(); ++i)
    if (body.fixed[i]) moved.middleRows<3>(3 * static_cast<Eigen::Index>(i)).setZero();
  SampledElements solid;
  solid.law.kind = law;
  const auto count = static_cast<Eigen::Index>(body.tetrahedra.size());
  REQUIRE(count <= kMaxFiniteElements);
  solid.motion = rounded(moved.cast<float>(), -1);
  moved = solid.motion.rows(0).cast<double>();
  solid.position = state.x.reshaped(3, dynamics.nodes()).cast<float>();
  solid.rest.resize(3, dynamics.nodes());
  for (std::uint32_t i = 0; i < dynamics.nodes(); ++i) solid.rest.col(i) = body.nodes[i].cast<float>();
  solid.nodes.resize(4, count);
  solid.stiffness.resize(count);
  for (Eigen::Index e = 0; e < count; ++e) {
    for (int k = 0; k < 4; ++k)
      solid.nodes(k, e) = static_cast<int>(body.tetrahedra[static_cast<std::size_t>(e)].nodes[static_cast<std::size_t>(k)]);
    solid.stiffness[e] = static_cast<float>(kSpacingM * kSpacingM * kSpacingM / 6 * 8e3 / (2 * 1.45));
  }
  solid.dilation = static_cast<float>(2 * 0.45 / (1 - 2 * 0.45)) * solid.stiffness;
  solid.damping.setZero(count);
  SampledSolidForce force(solid, 0, 1e-6, false);
  REQUIRE_FALSE(force.empty());
  Matrix k_moved, d_moved;
  whole.multiply(moved, k_moved, d_moved);
  const Vector still = Vector::Zero(state.x.size());
  Vector here, there;
  dynamics.forces(state.x, still, here);
  for (int k = 0; k < 10; ++k) {
    const Vector u = Vector::NullaryExpr(4, [&] { return random.uniform(-0.004, 0.004); });
    dynamics.forces(state.x + moved * u, still, there);
    const Vector exact = -moved.transpose() * (there - here + k_moved * u);
    SampledSolidForce::Values g(4);
    force.move_to(u.cast<float>());
    force.gradient(g);
    CHECK((g.cast<double>() - exact).norm() < 1e-3 * exact.norm());
  }
}
