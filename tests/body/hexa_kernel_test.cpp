// The kernel of a hexahedron against finite differences, closed forms and invariants.
#include <Eigen/Dense>
#include <catch2/catch.hpp>
#include <random>

#include "server/body/hexa_lanes.hpp"
#include "server/body/tetra_lanes.hpp"

using namespace palpate;

namespace {

constexpr double kEdgeM = 0.01;

Mat38 box(const Vec3& edges_m) {
  Mat38 x;
  for (int i = 0; i < 8; ++i) x.col(i) = Vec3(i & 1 ? edges_m.x() : 0, i & 2 ? edges_m.y() : 0, i & 4 ? edges_m.z() : 0);
  return x;
}

class Draw {
 public:
  explicit Draw(unsigned seed) : random_(seed) {}
  template <int Rows, int Columns>
  Eigen::Matrix<double, Rows, Columns> numbers(double size) {
    return Eigen::Matrix<double, Rows, Columns>::NullaryExpr([&] { return size * normal_(random_); });
  }
  Mat3 rotation() { return Eigen::Quaterniond(numbers<3, 1>(1).homogeneous()).normalized().toRotationMatrix(); }

 private:
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
};

/// A cube, a box, a skew one, and one as at the surface of a clipped lattice.
std::vector<Mat38> rests() {
  Draw draw(3);
  const Mat3 skew = (Mat3() << 1, 0.2, 0.1, 0, 0.8, -0.2, 0.1, 0, 1.1).finished();
  return {box(Vec3::Constant(kEdgeM)), box({0.01, 0.007, 0.015}), skew * box(Vec3::Constant(kEdgeM)),
          box(Vec3::Constant(kEdgeM)) + draw.numbers<3, 8>(0.08 * kEdgeM)};
}

/// Slightly deformed, strongly deformed, and pressed through itself.
std::vector<Mat38> shapes_of(const Mat38& rest) {
  Draw draw(5);
  std::vector<Mat38> all{rest};
  for (const double size : {0.01, 0.1, 0.3}) all.push_back(draw.rotation() * (rest + draw.numbers<3, 8>(size * kEdgeM)));
  all.push_back(Vec3(1.1, 1, -0.3).asDiagonal() * rest + draw.numbers<3, 8>(0.1 * kEdgeM));
  return all;
}

const std::vector<SolidMaterial> kMaterials{
    {SolidLaw::neo_hookean, 5e3, 0.3, 0.02},          {SolidLaw::neo_hookean, 5e3, 0.499, 0.02},
    {SolidLaw::corotational, 5e3, 0.45, 0.02},        {SolidLaw::mooney_rivlin, 5e3, 0.45, 0.02, 0.4},
    {SolidLaw::veronda_westmann, 5e3, 0.45, 0.02, 2}, {SolidLaw::ogden, 5e3, 0.45, 0.02, 0.3, {5, -4}, {{0.6, 0, 0.8}, 3, 2}}};

struct OneHexa {
  OneHexa(const SolidMaterial& solid, const Mat38& at) : material(solid), rest(at), modes(solid, rest) {}
  Mat37 gradient(const Mat38& x) const { return x * rest.g.transpose(); }
  double energy(const Mat38& x) const { return elastic_energy(material, modes, rest, gradient(x)); }
  Mat38 forces(const Mat38& x) const { return -elastic_stress(material, modes, rest, gradient(x)) * rest.g; }
  TetraMaterial material;
  HexaRest rest;
  Hourglass modes;
};

}  // namespace

TEST_CASE("A hexahedron's gradient is exact for affine motions, which move no hourglass mode", "[body][hexa]") {
  Draw draw(1);
  for (const Mat38& rest : rests()) {
    const HexaRest at(rest);
    const Mat3 f = Mat3::Identity() + draw.numbers<3, 3>(0.5);
    const Mat37 gradient = ((f * rest).colwise() + Vec3(0.3, -0.2, 0.1)) * at.g.transpose();
    CHECK((gradient.leftCols<3>() - f).norm() < 1e-11);
    CHECK(gradient.rightCols<4>().norm() < 1e-12);
  }
}

TEST_CASE("A hexahedron of any deformation gradient has the energy of its law", "[body][hexa]") {
  Draw draw(2);
  for (const SolidMaterial& solid : kMaterials)
    for (const Mat38& rest : rests()) {
      const OneHexa element(solid, rest);
      const Mat3 f = Mat3::Identity() + draw.numbers<3, 3>(0.2);
      CHECK(element.energy(f * rest) ==
            Approx(element.rest.volume_m3 * elastic_energy_density(element.material, f)).epsilon(1e-9));
    }
}

TEST_CASE("A hexahedron's energy does not notice a rigid motion, and without deformation it pushes nothing", "[body][hexa]") {
  Draw draw(4);
  for (const SolidMaterial& solid : kMaterials)
    for (const Mat38& rest : rests()) {
      const OneHexa element(solid, rest);
      const Mat3 r = draw.rotation();
      const double scale_n = solid.young_pa * kEdgeM * kEdgeM / (1 - 2 * solid.poisson);
      CHECK(element.forces((r * rest).colwise() + Vec3(0.1, 0.2, 0.3)).norm() < 1e-11 * scale_n);
      for (const Mat38& x : shapes_of(rest)) {
        const double energy = element.energy(x);
        CHECK(element.energy((r * x).colwise() + Vec3(0.1, 0.2, 0.3)) == Approx(energy).epsilon(1e-9).margin(1e-12));
        CHECK((element.forces(r * x) - r * element.forces(x)).norm() < 1e-9 * (element.forces(x).norm() + scale_n));
      }
    }
}

TEST_CASE("A hexahedron's forces are minus the gradient of its energy and sum to nothing", "[body][hexa]") {
  Draw draw(6);
  for (const SolidMaterial& solid : kMaterials)
    for (const Mat38& rest : rests()) {
      const OneHexa element(solid, rest);
      for (const Mat38& x : shapes_of(rest)) {
        const Mat38 direction = draw.numbers<3, 8>(1), forces = element.forces(x);
        const double h = 1e-6 * kEdgeM;
        const double slope = (element.energy(x + h * direction) - element.energy(x - h * direction)) / (2 * h);
        const double scale = forces.norm() + 1e-3 * solid.young_pa * kEdgeM * kEdgeM;
        CHECK(std::abs(slope + forces.cwiseProduct(direction).sum()) < 1e-5 * scale * direction.norm());
        CHECK(forces.rowwise().sum().norm() < 1e-12 * scale);
        Vec3 torque = Vec3::Zero();
        for (int i = 0; i < 8; ++i) torque += x.col(i).cross(forces.col(i));
        CHECK(torque.norm() < 1e-11 * scale * x.norm());
      }
    }
}

TEST_CASE("A hexahedron's tangent is the derivative of its forces, and clamped it only resists", "[body][hexa]") {
  for (const SolidMaterial& solid : kMaterials)
    for (const Mat38& rest : rests()) {
      const OneHexa element(solid, rest);
      for (const Mat38& x : shapes_of(rest)) {
        if (solid.law == SolidLaw::corotational && (x * element.rest.g.topRows<3>().transpose()).determinant() < 0.05) continue;
        using Square = Eigen::Matrix<double, 24, 24>;
        const HexaTangent tangent(element.material, element.gradient(x), false),
            clamped(element.material, element.gradient(x), true);
        Square k, numeric, resisting;
        for (int i = 0; i < 8; ++i)
          for (int j = 0; j < 8; ++j) {
            k.block<3, 3>(3 * i, 3 * j) = tangent.block(element.material, element.modes, element.rest, i, j, 0, 1);
            resisting.block<3, 3>(3 * i, 3 * j) = clamped.block(element.material, element.modes, element.rest, i, j, 0, 1);
          }
        const double h = 1e-6 * kEdgeM;
        for (int c = 0; c < 24; ++c) {
          Mat38 step = Mat38::Zero();
          step(c % 3, c / 3) = h;
          const Mat38 slope = (element.forces(x - step) - element.forces(x + step)) / (2 * h);
          numeric.col(c) = Eigen::Map<const Eigen::Matrix<double, 24, 1>>(slope.data());
        }
        CHECK((k - numeric).norm() < 1e-6 * k.norm());
        CHECK(Eigen::SelfAdjointEigenSolver<Square>(resisting).eigenvalues()[0] > -1e-10 * resisting.norm());
      }
    }
}

TEST_CASE("A hexahedron's viscous forces never give energy, and none resists a rotation", "[body][hexa]") {
  Draw draw(9);
  for (const Mat38& rest : rests()) {
    const OneHexa element(kMaterials[0], rest);
    for (const Mat38& x : shapes_of(rest)) {
      const Mat38 v = draw.numbers<3, 8>(0.1);
      const auto viscous = [&](const Mat38& rate) {
        return Mat38(-viscous_stress(element.material, element.modes, element.rest, element.gradient(x), element.gradient(rate)) *
                     element.rest.g);
      };
      CHECK(viscous(v).cwiseProduct(v).sum() < 0);
      Mat38 turning = x;
      for (int i = 0; i < 8; ++i) turning.col(i) = Vec3(1, -2, 0.5).cross(Vec3(x.col(i)));
      CHECK(viscous(turning).norm() < 1e-10 * viscous(v).norm());
      // Linear in the rate, with the blocks of D.
      const HexaTangent tangent(element.material, element.gradient(x), false);
      Mat38 sum = Mat38::Zero();
      for (int i = 0; i < 8; ++i)
        for (int j = 0; j < 8; ++j)
          sum.col(i) -= tangent.block(element.material, element.modes, element.rest, i, j, 1, 0) * v.col(j);
      CHECK((sum - viscous(v)).norm() < 1e-10 * sum.norm());
    }
  }
}

TEST_CASE("A cube bends by the theory of beams whatever its Poisson's ratio, and a flat box is not much stiffer",
          "[body][hexa]") {
  struct Bent {
    Vec3 edges_m;
    double stiffer;  // upper bound of the stiffness over that of a beam
  };
  for (const double poisson : {0.0, 0.3, 0.45, 0.499})
    for (const auto& [edges, stiffer] :
         {Bent{Vec3::Constant(kEdgeM), 1}, Bent{{0.02, 0.02, 0.01}, 2}, Bent{{0.04, 0.04, 0.01}, 2}}) {
      const SolidMaterial solid{SolidLaw::neo_hookean, 5e3, poisson, 0};
      const OneHexa element(solid, box(edges));
      constexpr double kCurvature1M = 10;  // curvature of fibres along x, over z
      Mat38 x = box(edges);
      for (int i = 0; i < 8; ++i) {
        const Vec3 from_middle = box(edges).col(i) - 0.5 * edges;
        x(0, i) += kCurvature1M * from_middle.x() * from_middle.z();
      }
      const double beam = solid.young_pa * edges.prod() * edges.z() * edges.z() / 12 * kCurvature1M * kCurvature1M / 2;
      CHECK(element.energy(x) > beam * (1 - 1e-9));
      CHECK(element.energy(x) < beam * (stiffer + 1e-9));
    }
}

TEST_CASE("What a hexahedron's modes resist with does not depend on what else it has gone through", "[body][hexa]") {
  Draw draw(10);
  for (const Mat38& rest : rests()) {
    const OneHexa element(kMaterials[0], rest);
    const Mat34 q = draw.numbers<3, 4>(0.1 * kEdgeM);
    std::vector<double> energies;
    for (const double stretch : {0.2, 1.0, 3.0}) {
      Mat37 at = Mat37::Zero(), without;
      at.leftCols<3>() = stretch * draw.rotation();
      without = at;
      at.rightCols<4>() = draw.rotation() * q;
      energies.push_back(elastic_energy(element.material, element.modes, element.rest, at) -
                         elastic_energy(element.material, element.modes, element.rest, without));
    }
    CHECK(energies[0] == Approx(energies[1]).epsilon(1e-9));
    CHECK(energies[2] == Approx(energies[1]).epsilon(1e-9));
    CHECK(energies[1] > 0);
  }
}

TEST_CASE("Stretched and sheared, a hexahedron has the closed forms of its law", "[body][hexa]") {
  const SolidMaterial solid{SolidLaw::neo_hookean, 6e3, 0.45, 0};
  const Mat38 rest = rests()[3];
  const OneHexa element(solid, rest);
  const TetraMaterial m(solid);
  Mat3 sheared = Mat3::Identity();
  sheared(0, 1) = 0.4;
  // Simple shear: J = 1, G = F^-T, so P_12 = mu (1 - 1/(I + 1)) gamma.
  const Mat37 p = elastic_stress(element.material, element.modes, element.rest, element.gradient(sheared * rest));
  CHECK(p(0, 1) / element.rest.volume_m3 == Approx(m.mu * (1 - 1 / (3 + 0.16 + 1)) * 0.4).epsilon(1e-10));
  const double a = 1.3, b = 0.9;
  const Mat37 q =
      elastic_stress(element.material, element.modes, element.rest, element.gradient(Vec3(a, b, b).asDiagonal() * rest));
  const double i = a * a + 2 * b * b;
  CHECK(q(0, 0) / element.rest.volume_m3 ==
        Approx(m.mu * (1 - 1 / (i + 1)) * a + m.lambda * (a * b * b - m.alpha) * b * b).epsilon(1e-10));
}

TEST_CASE("Eight hexahedra side by side are those of the kernel, to the bit the same whatever the width", "[body][hexa]") {
  Draw draw(11);
  const std::vector<Mat38> all = rests();
  for (const SolidMaterial& solid : kMaterials)
    for (const bool shared : {true, false}) {
      const TetraMaterial material(solid);
      std::vector<HexaShape> shapes;
      for (std::size_t l = 0; l < kHexaLanes; ++l) shapes.emplace_back(solid, 0, HexaRest(shared ? all[1] : all[l % all.size()]));
      HexaGroup group;
      group.count = 7;
      group.damping_s = solid.damping_s;
      std::array<const HexaShape*, kHexaLanes> each;
      for (std::size_t l = 0; l < kHexaLanes; ++l) each[l] = &shapes[l];
      if (shared)
        group.shape = &shapes[0];
      else
        group.numbers = numbers_of(each);
      Eigen::VectorXd x(3 * 8 * 8), v(x.size());
      for (std::size_t l = 0; l < kHexaLanes; ++l) {
        const Mat38 rest = shared ? all[1] : all[l % all.size()];
        const Mat38 at = draw.rotation() * (rest + draw.numbers<3, 8>(0.1 * kEdgeM)), rate = draw.numbers<3, 8>(0.1);
        for (std::size_t i = 0; i < 8; ++i) {
          group.nodes[i][l] = static_cast<std::uint32_t>(8 * (l < group.count ? l : 0) + i);
          x.segment<3>(3 * static_cast<Eigen::Index>(8 * l + i)) = at.col(static_cast<Eigen::Index>(i));
          v.segment<3>(3 * static_cast<Eigen::Index>(8 * l + i)) = rate.col(static_cast<Eigen::Index>(i));
        }
      }
      std::vector<Eigen::VectorXd> forces;
      std::vector<HexaBlocks> blocks;
      for (const HexaLoops& loops : hexa_loops()) {
        forces.emplace_back(Eigen::VectorXd::Zero(x.size()));
        loops.add_forces(material, group, x.data(), v.data(), forces.back().data());
        CHECK(loops.blocks(material, group, x.data(), 0.3, 0.7, blocks.emplace_back()) == (1U << kHexaLanes) - 1);
        CHECK(forces.back() == forces.front());
      }
      for (std::size_t l = 0; l < group.count; ++l) {
        const HexaShape& shape = *each[l];
        const auto at = [&](const Eigen::VectorXd& y) {
          Mat38 nodes;
          for (Eigen::Index i = 0; i < 8; ++i) nodes.col(i) = y.segment<3>(3 * (8 * static_cast<Eigen::Index>(l) + i));
          return Mat38(nodes.colwise() - Vec3(nodes.col(0)));
        };
        const Mat37 gradient = at(x) * shape.rest.g.transpose(), rate = at(v) * shape.rest.g.transpose();
        const Mat38 expected = -(elastic_stress(material, shape.modes, shape.rest, gradient) +
                                 viscous_stress(material, shape.modes, shape.rest, gradient, rate)) *
                               shape.rest.g;
        for (Eigen::Index i = 0; i < 8; ++i)
          CHECK((forces.back().segment<3>(3 * (8 * static_cast<Eigen::Index>(l) + i)) - expected.col(i)).norm() <
                1e-11 * expected.norm());
        const HexaTangent tangent(material, gradient, false);
        for (int i = 0; i < 8; ++i)
          for (int j = 0; j <= i; ++j) {
            const Mat3 k = tangent.block(material, shape.modes, shape.rest, i, j, 0.3, 0.7);
            const auto& numbers = blocks.back().at[pair_index(static_cast<std::size_t>(i), static_cast<std::size_t>(j))];
            for (std::size_t n = 0; n < 9; ++n) {
              const auto row = static_cast<Eigen::Index>(n / 3), column = static_cast<Eigen::Index>(n % 3);
              CHECK(numbers[n].of[l] == Approx(k(row, column)).epsilon(1e-9).margin(1e-9 * k.norm() + 1e-12));
              CHECK(numbers[n].of[l] ==
                    blocks.front().at[pair_index(static_cast<std::size_t>(i), static_cast<std::size_t>(j))][n].of[l]);
            }
          }
      }
    }
}
