// Shapes of finite elements against closed forms and invariants.
#include "server/elements/element_shape.hpp"

#include <catch2/catch.hpp>

#include "tests/server/elements/one_element.hpp"

using namespace palpate;
using namespace palpate::test;

TEMPLATE_TEST_CASE("An element's gradient is exact for affine motions, which move no hourglass mode", "[elements]", TetraShape,
                   HexaShape) {
  Draw draw(1);
  for (const auto& rest : rests<TestType>()) {
    const TestType at(rest);
    const Mat3 f = Mat3::Identity() + draw.numbers<3, 3>(0.5);
    const auto gradient = at.gradient((f * rest).colwise() + Vec3(0.3, -0.2, 0.1));
    CHECK((gradient.template leftCols<3>() - f).norm() < 1e-11);
    if constexpr (TestType::kModes > 0) CHECK(gradient.template rightCols<4>().norm() < 1e-12);
  }
}

TEST_CASE("A tetrahedron has a sixth of the parallelepiped of its edges, a triangle half of its parallelogram", "[elements]") {
  const Mat34 corners = rests<TetraShape>()[1];
  const Vec3 a = corners.col(1) - corners.col(0), b = corners.col(2) - corners.col(0), c = corners.col(3) - corners.col(0);
  CHECK(TetraShape(corners).volume_m3 == Approx(a.cross(b).dot(c) / 6));
  Mat34 triangle = corners;
  triangle.col(3) = triangle.col(0);
  const TetraShape flat(triangle);
  CHECK(flat.volume_m3 == Approx(a.cross(b).norm() / 2));
  CHECK((flat.gradient(triangle) * a - a).norm() < 1e-12 * a.norm());
  CHECK((flat.gradient(triangle) * a.cross(b)).norm() < 1e-12 * a.cross(b).norm());
}

TEST_CASE("A cube bends by the theory of beams whatever its Poisson's ratio, and a flat box is not much stiffer", "[elements]") {
  struct Bent {
    Vec3 edges_m;
    double stiffer;  // upper bound of the stiffness over that of a beam
  };
  for (const double poisson : {0.0, 0.3, 0.45, 0.499})
    for (const auto& [edges, stiffer] :
         {Bent{Vec3::Constant(kEdgeM), 1}, Bent{{0.02, 0.02, 0.01}, 2}, Bent{{0.04, 0.04, 0.01}, 2}}) {
      const SolidMaterial solid{SolidLaw::neo_hookean, 5e3, poisson, 0};
      const OneElement<HexaShape> element(solid, box(edges));
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

TEST_CASE("What a hexahedron's modes resist with does not depend on what else it has gone through", "[elements]") {
  Draw draw(10);
  for (const Mat38& rest : rests<HexaShape>()) {
    const OneElement<HexaShape> element(solids()[0], rest);
    const Mat34 q = draw.numbers<3, 4>(0.1 * kEdgeM);
    std::vector<double> energies;
    for (const double stretch : {0.2, 1.0, 3.0}) {
      Mat37 at = Mat37::Zero(), without;
      at.leftCols<3>() = stretch * draw.rotation();
      without = at;
      at.rightCols<4>() = draw.rotation() * q;
      energies.push_back(element.energy_of(at) - element.energy_of(without));
    }
    CHECK(energies[0] == Approx(energies[1]).epsilon(1e-9));
    CHECK(energies[2] == Approx(energies[1]).epsilon(1e-9));
    CHECK(energies[1] > 0);
  }
}
