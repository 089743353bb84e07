// Tetrahedra side by side against one after the other, at every width that this processor has.
#include <catch2/catch.hpp>
#include <random>
#include <vector>

#include "server/body/block_matrix.hpp"
#include "server/body/tetra_lanes.hpp"

using namespace palpate;

namespace {

/// Up to eight tetrahedra that share nodes, strained, some inside out, and moving.
struct Fixture {
  std::vector<Mat34> rest;
  TetraGroup group;
  Vector x, v;

  explicit Fixture(std::uint32_t count) {
    std::mt19937 random(count);
    std::normal_distribution<double> normal;
    const std::uint32_t nodes = count + 3;
    x = Vector::NullaryExpr(3 * nodes, [&] { return 0.01 * normal(random); });
    v = Vector::NullaryExpr(3 * nodes, [&] { return 0.1 * normal(random); });
    group.count = count;
    for (std::uint32_t l = 0; l < count; ++l) {
      Mat34 corners = (Mat34() << 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1).finished() * 0.01;
      corners += Mat34::NullaryExpr([&] { return 0.001 * normal(random); });
      rest.push_back(corners);
      const TetraRest at(corners);
      group.volume_m3.of[l] = at.volume_m3;
      for (std::uint32_t i = 0; i < 4; ++i) group.nodes[i][l] = l + i;
      for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t c = 0; c < 3; ++c) group.b[i][c].of[l] = at.b(static_cast<int>(c), static_cast<int>(i) + 1);
    }
    for (std::uint32_t l = count; l < kTetraLanes; ++l)
      for (std::uint32_t i = 0; i < 4; ++i) group.nodes[i][l] = i;
  }
  Mat3 gradient(std::uint32_t l, const Vector& y) const {
    Mat34 nodes;
    for (int i = 0; i < 4; ++i) nodes.col(i) = y.segment<3>(3 * (static_cast<Eigen::Index>(l) + i));
    return nodes * TetraRest(rest[l]).b.transpose();
  }
};

std::vector<TetraMaterial> materials() {
  std::vector<TetraMaterial> all;
  for (const SolidLaw law : {SolidLaw::corotational, SolidLaw::neo_hookean})
    for (const double damping_s : {0.0, 0.02}) all.emplace_back(SolidMaterial{law, 5e3, 0.4, damping_s});
  return all;
}

}  // namespace

TEST_CASE("Forces of tetrahedra side by side are those of one after the other", "[body][tetra]") {
  const auto count = GENERATE(1U, 3U, 8U);
  const Fixture fixture(count);
  for (const TetraMaterial& m : materials()) {
    Vector expected = Vector::Constant(fixture.x.size(), 0.25);
    for (std::uint32_t l = 0; l < count; ++l) {
      const TetraRest rest(fixture.rest[l]);
      const Mat3 f = fixture.gradient(l, fixture.x);
      const Mat3 p = elastic_stress(m, f) + viscous_stress(m, f, fixture.gradient(l, fixture.v));
      for (int i = 0; i < 4; ++i)
        expected.segment<3>(3 * (static_cast<Eigen::Index>(l) + i)) -= rest.volume_m3 * p * rest.b.col(i);
    }
    for (const TetraLoops& loops : tetra_loops()) {
      INFO(loops.width << " in a vector");
      Vector f = Vector::Constant(fixture.x.size(), 0.25);
      loops.add_forces(m, fixture.group, fixture.x.data(), fixture.v.data(), f.data());
      CHECK((f - expected).norm() < 1e-12 * expected.norm());
    }
  }
}

TEST_CASE("Tangents of neo-Hookean tetrahedra side by side are those of one after the other", "[body][tetra]") {
  const auto count = GENERATE(1U, 3U, 8U);
  const Fixture fixture(count);
  const TetraMaterial m(SolidMaterial{SolidLaw::neo_hookean, 5e3, 0.4, 0.02});
  constexpr double kC = 0.3, kD = 0.01;
  for (const TetraLoops& loops : tetra_loops()) {
    INFO(loops.width << " in a vector");
    TetraBlocks blocks;
    loops.blocks(m, fixture.group, fixture.x.data(), kD, kC, blocks);
    for (std::uint32_t l = 0; l < count; ++l) {
      const TetraRest rest(fixture.rest[l]);
      const Mat3 f = fixture.gradient(l, fixture.x);
      const TetraTangent tangent(m, f, false);
      for (int i = 0; i < 4; ++i)
        for (int j = 0; j <= i; ++j) {
          Mat3 k;
          for (int n = 0; n < 9; ++n)
            k(n / 3, n % 3) =
                blocks.at[pair_index(static_cast<std::size_t>(i), static_cast<std::size_t>(j))][static_cast<std::size_t>(n)]
                    .of[l];
          const Mat3 expected = kC * tangent.block(rest, i, j) + kD * viscous_block(m, rest, f, i, j);
          CHECK((k - expected).norm() < 1e-11 * expected.norm());
        }
    }
  }
}

TEST_CASE("Tetrahedra give the same bits at every width", "[body][tetra]") {
  const Fixture fixture(7);
  for (const TetraMaterial& m : materials()) {
    std::vector<Vector> forces;
    std::vector<TetraBlocks> blocks;
    for (const TetraLoops& loops : tetra_loops()) {
      forces.push_back(Vector::Zero(fixture.x.size()));
      loops.add_forces(m, fixture.group, fixture.x.data(), fixture.v.data(), forces.back().data());
      blocks.emplace_back();
      if (m.law == SolidLaw::neo_hookean) loops.blocks(m, fixture.group, fixture.x.data(), 0.01, 0.3, blocks.back());
    }
    for (std::size_t k = 1; k < forces.size(); ++k) {
      CHECK(forces[k] == forces[0]);
      for (std::size_t pair = 0; m.law == SolidLaw::neo_hookean && pair < 10; ++pair)
        for (std::size_t n = 0; n < 9; ++n)
          for (std::size_t l = 0; l < fixture.group.count; ++l)
            REQUIRE(blocks[k].at[pair][n].of[l] == blocks[0].at[pair][n].of[l]);
    }
  }
}
