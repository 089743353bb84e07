// Tetrahedra in lanes against one after the other, at every width of this processor.
#include <Eigen/Dense>
#include <algorithm>
#include <catch2/catch.hpp>
#include <random>
#include <span>
#include <vector>

#include "server/body/block_matrix.hpp"
#include "server/body/tetra_lanes.hpp"

using namespace palpate;

namespace {

/// Up to eight moving, strained tetrahedra that share nodes, some inside out.
struct Fixture {
  std::vector<Mat34> rest;
  TetraGroup group{};
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

std::vector<TetraMaterial> lane_materials() {
  std::vector<TetraMaterial> all;
  for (const SolidLaw law : {SolidLaw::corotational, SolidLaw::neo_hookean})
    for (const double damping_s : {0.0, 0.02}) all.emplace_back(SolidMaterial{law, 5e3, 0.4, damping_s});
  all.emplace_back(SolidMaterial{SolidLaw::mooney_rivlin, 5e3, 0.4, 0.02, 0.4});
  all.emplace_back(SolidMaterial{SolidLaw::veronda_westmann, 5e3, 0.4, 0.02, 2});
  all.emplace_back(SolidMaterial{SolidLaw::ogden, 5e3, 0.4, 0.02, 0.3, {5, -4}});
  all.emplace_back(SolidMaterial{SolidLaw::neo_hookean, 5e3, 0.4, 0.02, 0, {}, {{0.6, 0, 0.8}, 3, 2}});
  return all;
}

/// One tetrahedron per deformation gradient, at most eight, without common nodes.
struct Apart {
  static constexpr double kEdge = 0.01;  // length of the three edges, along the axes, that meet in node 0
  TetraGroup group{};
  Vector x;

  explicit Apart(std::span<const Mat3> lane_deformations)
      : x(Vector::Zero(12 * static_cast<Eigen::Index>(lane_deformations.size()))) {
    const Mat34 rest_nodes = corners();
    const TetraRest rest(rest_nodes);
    group.count = static_cast<std::uint32_t>(lane_deformations.size());
    for (std::uint32_t l = 0; l < group.count; ++l) {
      group.volume_m3.of[l] = rest.volume_m3;
      for (std::uint32_t i = 0; i < 4; ++i) {
        group.nodes[i][l] = 4 * l + i;
        x.segment<3>(12 * l + 3 * i) = lane_deformations[l] * rest_nodes.col(i);
      }
      for (std::size_t i = 0; i < 3; ++i) group.b[i][i].of[l] = 1 / kEdge;
    }
  }
  static Mat34 corners() { return (Mat34() << 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1).finished() * kEdge; }
  /// Stresses of all tetrahedra, from their forces.
  std::vector<Mat3> stresses(const TetraLoops& loops, const TetraMaterial& m) const {
    const Vector v = Vector::Zero(x.size());
    Vector f = Vector::Zero(x.size());
    loops.add_forces(m, group, x.data(), v.data(), f.data());
    std::vector<Mat3> all;
    for (std::uint32_t l = 0; l < group.count; ++l)
      all.push_back(f.segment<9>(12 * l + 3).reshaped(3, 3) * (-kEdge / group.volume_m3.of[l]));
    return all;
  }
};

Mat3 block_of(const TetraBlocks& blocks, std::size_t lane, int i, int j) {
  Mat3 k;
  for (std::size_t n = 0; n < 9; ++n)
    k(static_cast<int>(n / 3), static_cast<int>(n % 3)) =
        blocks.at[pair_index(static_cast<std::size_t>(i), static_cast<std::size_t>(j))][n].of[lane];
  return k;
}

class LanesDraw {
 public:
  Mat3 matrix(double size) {
    return Mat3::NullaryExpr([&] { return size * normal_(random_); });
  }
  Mat3 turned(double s1, double s2, double s3) { return rotation() * Vec3(s1, s2, s3).asDiagonal() * rotation(); }
  Mat3 rotation() { return Eigen::Quaterniond(matrix(1).col(0).homogeneous()).normalized().toRotationMatrix(); }

 private:
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
};

/// Neighbours that take different numbers of iterations, all rotated at random: slightly and strongly strained, very small and
/// large, flat, thin, inside out and nearly mirrored.
std::vector<Mat3> lane_deformations() {
  LanesDraw draw;
  std::vector<Mat3> all{Mat3::Identity()};
  for (int k = 0; k < 20; ++k) {
    for (const double size : {0.01, 0.1, 0.5}) all.push_back(draw.rotation() * (Mat3::Identity() + draw.matrix(size)));
    all.push_back(draw.turned(1.1, 0.9, 1e-3));
    all.push_back(draw.turned(1.3, 0.7, 0));
    all.push_back(draw.turned(1.2, 0.9, -0.4));
    all.push_back(draw.turned(1.1, 1, -0.98));
    all.push_back(draw.turned(1.5, 0.04, 0.02));
    all.push_back(draw.turned(2e-6, 1.5e-6, 1e-6));
    all.push_back(draw.turned(3e6, 2e6, -1e6));
  }
  return all;
}

}  // namespace

TEST_CASE("Corotational tetrahedra side by side, of whatever deformation, have the stress of one after the other",
          "[body][tetra]") {
  const std::vector<Mat3> all = lane_deformations();
  const TetraMaterial m(SolidMaterial{SolidLaw::corotational, 5e3, 0.4, 0});
  for (const TetraLoops& loops : tetra_loops())
    for (std::size_t first = 0; first < all.size(); first += kTetraLanes) {
      const std::span some = std::span(all).subspan(first, std::min(kTetraLanes, all.size() - first));
      const std::vector<Mat3> stresses = Apart(some).stresses(loops, m);
      for (std::size_t l = 0; l < some.size(); ++l) {
        INFO(loops.width << " in a vector, deformation\n" << some[l]);
        const Mat3 expected = elastic_stress(m, some[l]);
        CHECK((stresses[l] - expected).norm() < 1e-12 * (expected.norm() + m.mu));
      }
    }
}

TEST_CASE("The force of a tetrahedron does not depend on which others are beside it", "[body][tetra]") {
  const std::vector<Mat3> all = lane_deformations();
  for (const TetraMaterial& m : lane_materials())
    for (const TetraLoops& loops : tetra_loops())
      for (std::size_t first = 0; first + kTetraLanes <= all.size(); first += 5) {
        const std::span some = std::span(all).subspan(first, kTetraLanes);
        const std::vector<Mat3> together = Apart(some).stresses(loops, m);
        for (std::size_t l = 0; l < some.size(); ++l) CHECK(together[l] == Apart(some.subspan(l, 1)).stresses(loops, m)[0]);
      }
}

TEST_CASE("A corotational tetrahedron that several rotations fit has the force of one of them", "[body][tetra]") {
  LanesDraw draw;
  const TetraMaterial m(SolidMaterial{SolidLaw::corotational, 5e3, 0, 0});
  for (const Vec3& s : {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(1, 1, -1), Vec3(1, 0.5, -0.5), Vec3(1, 1e-9, -1e-10)})
    for (const bool along_axes : {true, false}) {
      const Mat3 f = along_axes ? Mat3(s.asDiagonal()) : draw.turned(s.x(), s.y(), s.z());
      for (const TetraLoops& loops : tetra_loops()) {
        const Mat3 r = f - Apart(std::span(&f, 1)).stresses(loops, m)[0] / (2 * m.mu);
        INFO(loops.width << " in a vector, deformation\n" << f);
        CHECK((r.transpose() * r - Mat3::Identity()).norm() < 1e-12);
        CHECK(r.determinant() == Approx(1));
        CHECK(r.cwiseProduct(f).sum() == Approx(s.sum()).margin(1e-6));
      }
    }
}

TEST_CASE("Forces of tetrahedra side by side are those of one after the other", "[body][tetra]") {
  const auto count = GENERATE(1U, 3U, 8U);
  const Fixture fixture(count);
  for (const TetraMaterial& m : lane_materials()) {
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

TEST_CASE("Tangents of tetrahedra side by side are those of one after the other, or said to be cut", "[body][tetra]") {
  const std::vector<Mat3> all = lane_deformations();
  const TetraRest rest(Apart::corners());
  constexpr double kC = 0.3, kD = 0.01;
  int cut = 0;
  for (const TetraMaterial& m : lane_materials())
    for (const TetraLoops& loops : tetra_loops())
      for (std::size_t l = 0; l < all.size(); ++l) {
        const Apart some(
            std::span<const Mat3>(all).subspan(l - l % kTetraLanes, std::min(kTetraLanes, all.size() - l + l % kTetraLanes)));
        TetraBlocks blocks;
        const std::uint32_t good = loops.blocks(m, some.group, some.x.data(), kD, kC, blocks);
        INFO(loops.width << " in a vector, deformation\n" << all[l]);
        const Mat3& f = all[l];
        const Vec3 s = Eigen::JacobiSVD<Mat3>(f).singularValues();
        const bool apart = m.law != SolidLaw::corotational || s.y() + std::copysign(s.z(), f.determinant()) > kLeastPairSum;
        REQUIRE((good >> l % kTetraLanes & 1U) == (apart ? 1U : 0U));
        if (!apart) {
          ++cut;
          continue;
        }
        const TetraTangent tangent(m, f, false);
        for (int i = 0; i < 4; ++i)
          for (int j = 0; j <= i; ++j) {
            const Mat3 expected = kC * tangent.block(rest, i, j) + kD * viscous_block(m, rest, f, i, j);
            CHECK((block_of(blocks, l % kTetraLanes, i, j) - expected).norm() <
                  1e-11 * (expected.norm() + kC * m.mu * Apart::kEdge));
          }
      }
  CHECK(cut > 20);
}

TEST_CASE("Tetrahedra give the same bits at every width", "[body][tetra]") {
  const Fixture fixture(7);
  for (const TetraMaterial& m : lane_materials()) {
    std::vector<Vector> forces;
    for (const TetraLoops& loops : tetra_loops()) {
      forces.push_back(Vector::Zero(fixture.x.size()));
      loops.add_forces(m, fixture.group, fixture.x.data(), fixture.v.data(), forces.back().data());
      CHECK(forces.back() == forces.front());
    }
  }
}

TEST_CASE("Tetrahedra of whatever deformation give the same bits at every width", "[body][tetra]") {
  const std::vector<Mat3> all = lane_deformations();
  const TetraLoops& narrow = tetra_loops().front();
  for (const TetraMaterial& m : lane_materials())
    for (std::size_t first = 0; first + kTetraLanes <= all.size(); first += kTetraLanes) {
      const Apart some(std::span<const Mat3>(all).subspan(first, kTetraLanes));
      TetraBlocks expected;
      const std::uint32_t good = narrow.blocks(m, some.group, some.x.data(), 0.01, 0.3, expected);
      for (const TetraLoops& loops : tetra_loops()) {
        CHECK(some.stresses(loops, m) == some.stresses(narrow, m));
        TetraBlocks blocks;
        CHECK(loops.blocks(m, some.group, some.x.data(), 0.01, 0.3, blocks) == good);
        for (std::size_t l = 0; l < kTetraLanes; ++l)
          for (int i = 0; i < 4; ++i)
            for (int j = 0; j <= i; ++j) CHECK(block_of(blocks, l, i, j) == block_of(expected, l, i, j));
      }
    }
}
