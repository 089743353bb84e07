// Loops over eight elements against finite differences and invariants, and against themselves at every width of this processor.
#include "server/elements/element_loops.hpp"

#include <catch2/catch.hpp>

#include "tests/server/elements/one_element.hpp"
#include "tests/support/eigenvalues.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

/// Calls `of` for elements of every material and shape at every deformation.
template <class Shape, class Of>
void for_elements(const Of& of) {
  for (const SolidMaterial& solid : solids())
    for (const auto& rest : rests<Shape>()) {
      const OneElement<Shape> element(solid, rest);
      for (const auto& x : deformed<Shape>(rest)) of(element, x, solid.young_pa * kEdgeM * kEdgeM);
    }
}

/// Eight elements of one material, moving, each with nodes of its own: of one shape, or of several.
template <class Shape>
struct Eight {
  std::vector<Shape> shapes;
  ElementGroup<Shape> group;
  Eigen::VectorXd x, v;

  Eight(const SolidMaterial& solid, bool shared) {
    Draw draw(11);
    const auto all = rests<Shape>();
    constexpr std::size_t kNodes = Shape::kNodes;
    x.resize(3 * kNodes * kElementLanes), v.resize(x.size());
    std::vector<const Shape*> each;
    shapes.reserve(kElementLanes);
    for (std::size_t l = 0; l < kElementLanes; ++l) {
      const auto& rest = all[shared ? 1 : l % all.size()];
      shapes.emplace_back(rest, solid.young_pa);
      each.push_back(&shapes.back());
      const typename Shape::Positions at =
          draw.rotation() * (rest + draw.numbers<3, Shape::kNodes>(l == 3 ? 0.8 * kEdgeM : 0.1 * kEdgeM));
      for (std::size_t i = 0; i < kNodes; ++i) {
        group.nodes[i][l] = static_cast<std::uint32_t>(kNodes * l + i);
        x.segment<3>(3 * static_cast<Eigen::Index>(kNodes * l + i)) = at.col(static_cast<Eigen::Index>(i));
      }
    }
    v = Eigen::VectorXd::NullaryExpr(v.size(), [&] { return draw.numbers<1, 1>(0.1)(0); });
    group.count = kElementLanes;
    if (shared)
      group.shape = &shapes[0];
    else
      group.numbers = ShapeNumbers<Shape>::of(each);
  }
  Eigen::VectorXd forces(const ElementLoops<Shape>& loops, const ElementMaterial& m) const {
    Eigen::VectorXd f = Eigen::VectorXd::Zero(x.size());
    loops.add_forces(m, group, x.data(), v.data(), f.data());
    return f;
  }
};

}  // namespace

TEMPLATE_TEST_CASE("An element's forces are minus the gradient of its energy, and sum to nothing", "[elements]", TetraShape,
                   HexaShape) {
  Draw draw(6);
  for_elements<TestType>([&](const auto& element, const auto& x, double scale_n) {
    const typename TestType::Positions direction = draw.numbers<3, TestType::kNodes>(1), forces = element.forces(x);
    const double h = 1e-6 * kEdgeM;
    const double slope = (element.energy(x + h * direction) - element.energy(x - h * direction)) / (2 * h);
    const double scale = forces.norm() + 1e-3 * scale_n;
    CHECK(std::abs(slope + forces.cwiseProduct(direction).sum()) < 1e-5 * scale * direction.norm());
    CHECK(forces.rowwise().sum().norm() < 1e-12 * scale);
    if (element.material.has_fibres) return;
    Vec3 torque = Vec3::Zero();
    for (int i = 0; i < TestType::kNodes; ++i) torque += Vec3(x.col(i)).cross(Vec3(forces.col(i)));
    CHECK(torque.norm() < 1e-11 * scale * x.norm());
  });
}

TEMPLATE_TEST_CASE("An element's energy does not notice a rigid motion, and without deformation it pushes nothing", "[elements]",
                   TetraShape, HexaShape) {
  Draw draw(4);
  const Mat3 r = draw.rotation();
  const Vec3 shift(0.1, 0.2, 0.3);
  for_elements<TestType>([&](const auto& element, const auto& x, double scale_n) {
    scale_n *= 1 + element.material.lambda / element.material.mu;
    CHECK(element.energy((r * x).colwise() + shift) == Approx(element.energy(x)).epsilon(1e-9).margin(1e-12));
    CHECK((element.forces(r * x) - r * element.forces(x)).norm() < 1e-9 * (element.forces(x).norm() + scale_n));
  });
  for (const SolidMaterial& solid : solids())
    for (const auto& rest : rests<TestType>()) {
      const OneElement<TestType> element(solid, rest);
      CHECK(element.forces((r * rest).colwise() + shift).norm() <
            1e-10 * solid.young_pa * kEdgeM * kEdgeM / (1 - 2 * solid.poisson));
    }
}

TEMPLATE_TEST_CASE("An element's stiffness is the derivative of its forces, and clamped it only resists", "[elements]",
                   TetraShape, HexaShape) {
  for_elements<TestType>([&](const auto& element, const auto& x, double) {
    using Square = typename OneElement<TestType>::Square;
    const Square k = element.matrix(x, 0, 1, false), clamped = element.matrix(x, 0, 1, true);
    CHECK(test::symmetric_eigenvalues(clamped)[0] > -1e-9 * clamped.norm());
    CHECK(test::symmetric_eigenvalues(clamped - k)[0] > -1e-8 * clamped.norm());
    const Mat3 f = element.shape.gradient(x).template leftCols<3>();
    // The corotational tangent is limited where two stretches nearly cancel; Ogden's has a kink where its powers end.
    if ((element.material.kind == SolidLaw::corotational || element.material.kind == SolidLaw::ogden) && f.determinant() < 0.1)
      return;
    Square numeric;
    const double h = 1e-6 * kEdgeM;
    for (int c = 0; c < 3 * TestType::kNodes; ++c) {
      typename TestType::Positions step = TestType::Positions::Zero();
      step(c % 3, c / 3) = h;
      numeric.col(c) = ((element.forces(x - step) - element.forces(x + step)) / (2 * h)).reshaped();
    }
    CHECK((k - numeric).norm() < 1e-6 * k.norm());
  });
}

TEMPLATE_TEST_CASE("An element's viscous forces never give energy, are those of its damping, and none resists a rotation",
                   "[elements]", TetraShape, HexaShape) {
  Draw draw(9);
  for_elements<TestType>([&](const auto& element, const auto& x, double) {
    if (!element.material.is_viscous()) return;
    using Positions = typename TestType::Positions;
    const Positions v = draw.numbers<3, TestType::kNodes>(0.1), still = element.forces(x);
    const Positions viscous = element.forces(x, v) - still;
    CHECK(viscous.cwiseProduct(v).sum() < 0);
    Positions turning = x;
    for (int i = 0; i < TestType::kNodes; ++i) turning.col(i) = Vec3(1, -2, 0.5).cross(Vec3(x.col(i)));
    CHECK((element.forces(x, turning) - still).norm() < 1e-10 * (viscous.norm() + still.norm()));
    const Positions expected = -(element.matrix(x, 1, 0, false) * v.reshaped()).reshaped(3, TestType::kNodes);
    CHECK((expected - viscous).norm() < 1e-10 * (viscous.norm() + still.norm()));
  });
}

TEST_CASE("A triangle's forces are minus the gradient of its membrane energy", "[elements]") {
  Mat34 rest = rests<TetraShape>()[1];
  rest.col(3) = rest.col(0);
  const OneElement<TetraShape> element({SolidLaw::membrane, 50, 0.3, 0.01}, rest);
  Draw draw(12);
  for (int k = 0; k < 4; ++k) {
    Mat34 x = draw.rotation() * (rest + draw.numbers<3, 4>(0.1 * kEdgeM)), direction = draw.numbers<3, 4>(1);
    x.col(3) = x.col(0), direction.col(3) = direction.col(0);
    const Mat34 forces = element.forces(x);
    const double h = 1e-6 * kEdgeM, slope = (element.energy(x + h * direction) - element.energy(x - h * direction)) / (2 * h);
    CHECK(forces.col(3).norm() == 0);
    CHECK(slope == Approx(-forces.cwiseProduct(direction).sum()).epsilon(1e-6));
  }
}

TEMPLATE_TEST_CASE("Elements have the same bits at every width, whichever others are beside them, of one shape or several",
                   "[elements]", TetraShape, HexaShape) {
  constexpr std::size_t kNodes = TestType::kNodes;
  for (const SolidMaterial& solid : solids())
    for (const bool shared : {true, false}) {
      const ElementMaterial m(solid);
      const Eight<TestType> eight(solid, shared);
      const auto all = element_loops<TestType>();
      const Eigen::VectorXd forces = eight.forces(all.front(), m);
      ElementBlocks<TestType> expected;
      all.front().blocks(m, eight.group, eight.x.data(), eight.v.data(), 0.3, 0.7, true, expected);
      for (const ElementLoops<TestType>& loops : all) {
        CHECK(eight.forces(loops, m) == forces);
        ElementBlocks<TestType> blocks;
        loops.blocks(m, eight.group, eight.x.data(), eight.v.data(), 0.3, 0.7, true, blocks);
        for (std::size_t p = 0; p < blocks.at.size(); ++p)
          for (std::size_t n = 0; n < 9; ++n)
            for (std::size_t l = 0; l < kElementLanes; ++l) REQUIRE(blocks.at[p][n].of[l] == expected.at[p][n].of[l]);
      }
      for (std::size_t l = 0; l < kElementLanes; ++l) {
        OneElement<TestType> one(solid, rests<TestType>()[1]);
        one.shape = eight.shapes[l];
        typename TestType::Positions x, v;
        for (std::size_t i = 0; i < kNodes; ++i) {
          const auto node = 3 * static_cast<Eigen::Index>(kNodes * l + i);
          x.col(static_cast<Eigen::Index>(i)) = eight.x.template segment<3>(node);
          v.col(static_cast<Eigen::Index>(i)) = eight.v.template segment<3>(node);
        }
        const typename TestType::Positions alone = one.forces(x, v);
        CHECK(alone.reshaped() == forces.template segment<3 * TestType::kNodes>(3 * static_cast<Eigen::Index>(kNodes * l)));
      }
    }
}

TEMPLATE_TEST_CASE("Products with an element's tangent are those of its blocks", "[elements]", TetraShape, HexaShape) {
  Draw draw(13);
  for_elements<TestType>([&](const auto& element, const auto& x, double) {
    const ElementLoops<TestType>& loops = element_loops<TestType>().back();
    ElementTangent<TestType> tangent;
    std::array<ElementTangent<TestType>*, kElementLanes> tangents{};
    tangents[0] = &tangent;
    loops.tangents(element.material, element.group(), x.data(), x.data(), tangents);
    ElementCell<TestType> cell{{}, 0, 0};
    std::vector<NodeLanes> y(TestType::kNodes), k_y(y.size(), NodeLanes{}), d_y(k_y), both(k_y);
    for (std::uint32_t i = 0; i < cell.nodes.size(); ++i) cell.nodes[i] = i;
    const Eigen::Matrix<double, 3 * TestType::kNodes, kColumnLanes> columns = draw.numbers<3 * TestType::kNodes, kColumnLanes>(1);
    pack_columns(columns, 0, y);
    const ElementProducts<TestType> products{{&cell, 1}, {&element.shape, 1}, {&element.material, 1}, {&tangent, 1}};
    loops.add_products(products, y.data(), 0.7, 0.3, k_y.data(), d_y.data());
    loops.add_products(products, y.data(), 0.7, 0.3, both.data(), both.data());
    const auto check = [&](const std::vector<NodeLanes>& of, double c_d, double c_k) {
      Eigen::MatrixXd found(columns.rows(), columns.cols());
      unpack_columns(of, 0, found);
      const Eigen::MatrixXd expected = element.matrix(x, c_d, c_k, false) * columns;
      CHECK((found - expected).norm() <= 1e-12 * expected.norm());
    };
    check(k_y, 0, 0.7);
    check(d_y, 0.3, 0);
    check(both, 0.3, 0.7);
  });
}
