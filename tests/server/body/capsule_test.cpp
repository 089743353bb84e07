// A membrane on a solid: closed forms of its law, and its effect on a body.
#include "server/scene/capsule.hpp"

#include <Eigen/Dense>
#include <catch2/catch.hpp>
#include <random>

#include "server/body/dynamics.hpp"
#include "tests/support/bodies.hpp"

using namespace palpate;

namespace {

constexpr CapsuleSettings kCapsule{2e6, 1e-4, 0.3, 0.01};
constexpr double kYoungN_M = 2e6 * 1e-4;

ElementMaterial membrane() {
  SolidMaterial m;
  m.law = SolidLaw::membrane, m.young_pa = kYoungN_M, m.poisson = kCapsule.poisson, m.damping_s = 0;
  return ElementMaterial(m);
}

/// A deformation gradient of a triangle in the plane of two unit vectors.
Mat3 in_plane(const Mat3& turned, double along, double across, double shear) {
  Mat3 f = Mat3::Zero();
  f.col(0) = along * turned.col(0);
  f.col(1) = across * turned.col(1) + shear * turned.col(0);
  return f;
}

}  // namespace

TEST_CASE("a membrane pulled along one direction has the traction of St. Venant's and Kirchhoff's law in plane stress",
          "[body][membrane]") {
  const ElementMaterial m = membrane();
  const Mat3 turned = Eigen::AngleAxisd(0.8, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  for (const double l : {0.8, 1.0, 1.2, 1.6}) {
    // Its sides are free: E_22 = -nu E_11, S_11 = E h E_11.
    const double e = (l * l - 1) / 2, across = std::sqrt(1 - 2 * kCapsule.poisson * e);
    const Mat3 f = in_plane(turned, l, across, 0), p = elastic_stress(m, f);
    CHECK((p.col(0) - kYoungN_M * e * l * turned.col(0)).norm() < 1e-12 * kYoungN_M);
    CHECK(p.rightCols<2>().norm() < 1e-12 * kYoungN_M);
    CHECK(elastic_energy_densities(m, {f, f, f, f})[0] == Approx(0.5 * kYoungN_M * e * e).margin(1e-12 * kYoungN_M));
  }
}

TEST_CASE("a block in a capsule resists by what its solid and its sides resist together", "[body][membrane]") {
  // nu = 0, so there is no lateral contraction: everything is stretched alike.
  const bool hexa = GENERATE(true, false);
  constexpr int kNodes = 4;
  const SolidMaterial solid{SolidLaw::corotational, 5e3, 0, 0};
  LumpedBody body = hexa ? hexa_box(kNodes, kNodes, kNodes, solid) : solid_box(kNodes, kNodes, kNodes, solid);
  body.fixed.assign(body.nodes.size(), 0);
  CapsuleSettings capsule = kCapsule;
  capsule.poisson = 0;
  const double width_m = (body.nodes.back() - body.nodes.front()).x(), l = 1.3;
  const auto pulled = [&](const LumpedBody& of) {
    const Dynamics dynamics(of);
    Vector x(3 * static_cast<Eigen::Index>(of.nodes.size())), f;
    for (std::uint32_t i = 0; i < of.nodes.size(); ++i) at_node(x, i) = Vec3(l, 1, 1).cwiseProduct(of.nodes[i]);
    dynamics.forces(x, Vector::Zero(x.size()), f);
    double sum = 0;
    for (std::uint32_t i = 0; i < of.nodes.size(); ++i)
      if (of.nodes[i].x() < 1e-9) sum += at_node(f, i).x();
    return sum;
  };
  const double bare = pulled(body);
  CHECK(bare == Approx(5e3 * (l - 1) * width_m * width_m));
  add_capsule(body, capsule);
  CHECK(pulled(body) - bare == Approx(4 * width_m * kYoungN_M * l * (l * l - 1) / 2));
}
