// Materials of finite elements at one deformation gradient: against finite differences and closed forms.
#include <Eigen/Dense>
#include <catch2/catch.hpp>
#include <functional>

#include "common/mechanics/polar.hpp"
#include "server/elements/element_material.hpp"
#include "tests/server/elements/one_element.hpp"
#include "tests/support/eigenvalues.hpp"

using namespace palpate;
using palpate::test::Draw;

namespace {

/// Slightly strained, strongly strained, flattened, inside out.
std::vector<Mat3> deformations() {
  Draw draw(7);
  std::vector<Mat3> all{Mat3::Identity()};
  for (const double size : {0.01, 0.1, 0.3})
    for (int k = 0; k < 4; ++k) all.push_back(draw.rotation() * (Mat3::Identity() + draw.matrix(size)));
  all.push_back(draw.rotation() * Vec3(1.1, 0.9, 0.02).asDiagonal() * draw.rotation());
  all.push_back(draw.rotation() * Vec3(1.2, 0.9, -0.4).asDiagonal() * draw.rotation());
  return all;
}

std::vector<SolidMaterial> solid_materials() {
  std::vector<SolidMaterial> all;
  const Fibres fibres{{0.6, 0, 0.8}, 3, 2}, springs{{0, 1, 0}, 0.5, 0};
  for (const SolidLaw law : {SolidLaw::corotational, SolidLaw::neo_hookean})
    for (const double poisson : {0.0, 0.3, 0.49}) all.push_back({law, 5e3, poisson, 0.02});
  for (const double poisson : {0.0, 0.3, 0.49}) {
    all.push_back({SolidLaw::mooney_rivlin, 5e3, poisson, 0.02, 0.4});
    all.push_back({SolidLaw::veronda_westmann, 5e3, poisson, 0.02, 2});
  }
  for (const double poisson : {0.0, 0.3, 0.49}) all.push_back({SolidLaw::ogden, 5e3, poisson, 0.02, 0.3, {5, -4}});
  all.push_back({SolidLaw::ogden, 5e3, 0.45, 0.02, 0, {-4.7, -4.7}, fibres});
  all.push_back({SolidLaw::neo_hookean, 5e3, 0.45, 0.02, 0, {}, fibres});
  all.push_back({SolidLaw::mooney_rivlin, 5e3, 0.45, 0.02, 0.4, {}, springs});
  all.push_back({SolidLaw::corotational, 5e3, 0.3, 0.02, 0, {}, fibres});
  return all;
}

std::vector<ElementMaterial> materials() {
  const std::vector<SolidMaterial> solids = solid_materials();
  return {solids.begin(), solids.end()};
}

}  // namespace

TEST_CASE("laws of both invariants have the closed forms of Rivlin's experiments", "[elements]") {
  const double young_pa = 5e3, nu = 0.45, mu = young_pa / (2 * (1 + nu)), b = 3;
  struct Of {
    SolidLaw law;
    double shape;
    std::function<double(double)> w1, w2;  // dPsi/dI_1, dPsi/dI_2 of I_1 - 3, where J = 1
  };
  const double share = 0.3;
  for (const Of& of :
       {Of{SolidLaw::mooney_rivlin, share, [&](double) { return (1 - share) * mu / 2; }, [&](double) { return share * mu / 2; }},
        Of{SolidLaw::veronda_westmann, b, [&](double i) { return mu * std::exp(b * i); }, [&](double) { return -mu / 2; }}}) {
    const ElementMaterial m(SolidMaterial{of.law, young_pa, nu, 0, of.shape});
    for (const double gamma : {0.1, 0.4, 0.8}) {  // simple shear: tau = 2 (W_1 + W_2) gamma
      Mat3 f = Mat3::Identity();
      f(0, 1) = gamma;
      const Mat3 cauchy = elastic_stress(m, f) * f.transpose();
      const double i = gamma * gamma;
      CHECK(cauchy(0, 1) == Approx(2 * (of.w1(i) + of.w2(i)) * gamma).epsilon(1e-10));
      CHECK(cauchy(0, 0) - cauchy(1, 1) == Approx(2 * (of.w1(i) + of.w2(i)) * gamma * gamma).epsilon(1e-10));
    }
    for (const double l : {0.7, 1.2, 1.5}) {  // uniaxial: sigma = 2 (l^2 - 1/l) (W_1 + W_2 / l)
      const Mat3 f = Vec3(l, 1 / std::sqrt(l), 1 / std::sqrt(l)).asDiagonal();
      const Mat3 cauchy = elastic_stress(m, f) * f.transpose();
      const double i = l * l + 2 / l - 3;
      CHECK(cauchy(0, 0) - cauchy(1, 1) == Approx(2 * (l * l - 1 / l) * (of.w1(i) + of.w2(i) / l)).epsilon(1e-10));
    }
    for (const double l : {0.8, 1.2}) {  // equibiaxial: sigma = 2 (l^2 - 1/l^4) (W_1 + W_2 l^2)
      const Mat3 f = Vec3(l, l, 1 / (l * l)).asDiagonal();
      const Mat3 cauchy = elastic_stress(m, f) * f.transpose();
      const double i = 2 * l * l + 1 / (l * l * l * l) - 3;
      CHECK(cauchy(0, 0) - cauchy(2, 2) == Approx(2 * (l * l - std::pow(l, -4)) * (of.w1(i) + of.w2(i) * l * l)).epsilon(1e-10));
    }
  }
}

TEST_CASE("Ogden's law of the exponents 2 and -2 is that of Mooney and Rivlin where no volume changes, of 2 alone everywhere",
          "[elements]") {
  const double young_pa = 5e3, nu = 0.45;
  const ElementMaterial two(SolidMaterial{SolidLaw::ogden, young_pa, nu, 0, 0, {2, 2}}),
      neo(SolidMaterial{SolidLaw::mooney_rivlin, young_pa, nu, 0, 0});
  for (const Mat3& f : deformations()) {
    const Mat3 expected = elastic_stress(neo, f);
    CHECK((elastic_stress(two, f) - expected).norm() < 1e-12 * (expected.norm() + young_pa));
    CHECK(elastic_energy_densities(two, {f, f, f, f})[0] ==
          Approx(elastic_energy_densities(neo, {f, f, f, f})[0]).epsilon(1e-12).margin(1e-10 * young_pa));
  }
  const ElementMaterial both(SolidMaterial{SolidLaw::ogden, young_pa, nu, 0, 0.3, {2, -2}}),
      rivlin(SolidMaterial{SolidLaw::mooney_rivlin, young_pa, nu, 0, 0.3});
  for (const double l : {0.7, 0.999, 1.0, 1.2, 1.5}) {
    const Mat3 f = Vec3(l, 1 / std::sqrt(l), 1 / std::sqrt(l)).asDiagonal();
    const Mat3 cauchy = elastic_stress(both, f) * f.transpose(), expected = elastic_stress(rivlin, f) * f.transpose();
    CHECK(cauchy(0, 0) - cauchy(1, 1) == Approx(expected(0, 0) - expected(1, 1)).margin(1e-11 * young_pa));
  }
}

TEST_CASE("Ogden's stress is as sharp where principal stretches nearly agree as where they do not", "[elements]") {
  // Against the definition: dPsi/dl_i in the principal frame.
  Draw draw(29);
  const SolidMaterial solid{SolidLaw::ogden, 5e3, 0.45, 0, 0.4, {9, -3}};
  const ElementMaterial m(solid);
  const double sum = 2 * (0.6 / 9 - 0.4 / 3), lambda = m.lambda + sum * m.mu;
  for (const double apart : {0.0, 1e-12, 1e-9, 1e-6, 4.9e-4, 5.1e-4, 1e-3, 1e-2})
    for (const double third : {1.0, 1 + apart, 1 - 2 * apart, 0.8, 1.2}) {
      const Vec3 l(1.05, 1.05 + apart, 1.05 * third);
      const Mat3 u = draw.rotation(), v = draw.rotation();
      Vec3 g = (lambda * (l.prod() - 1) - sum * m.mu) * l.prod() * l.cwiseInverse();
      for (std::size_t p = 0; p < 2; ++p)
        g += 2 * m.mu * (p == 0 ? 0.6 : 0.4) / solid.exponents[p] * l.array().pow(solid.exponents[p] - 1).matrix();
      const Mat3 expected = u * g.asDiagonal() * v.transpose();
      CHECK((elastic_stress(m, u * l.asDiagonal() * v.transpose()) - expected).norm() < 1e-11 * m.mu);
    }
}

TEST_CASE("fibres pull along themselves as their exponential says, and across themselves with nothing", "[elements]") {
  const double young_pa = 5e3, nu = 0.3, mu = young_pa / (2 * (1 + nu)), share = 2, b = 1.5;
  const Vec3 a = Vec3(1, -2, 2) / 3;
  const SolidMaterial plain{SolidLaw::neo_hookean, young_pa, nu, 0};
  SolidMaterial with = plain;
  with.fibres = {{a.x(), a.y(), a.z()}, share, b};
  const ElementMaterial without(plain), m(with);
  Draw draw(3);
  const Mat3 turned = draw.rotation();
  for (const double l : {0.5, 0.9, 1.0, 1.1, 1.4}) {
    const Mat3 f = turned * (Mat3::Identity() + (l - 1) * a * a.transpose());
    const double e = l * l - 1, grown = e > 0 ? std::exp(b * e * e) : 1;
    const Mat3 expected = 2 * share * mu * e * grown * l * (turned * a) * a.transpose();
    CHECK((elastic_stress(m, f) - elastic_stress(without, f) - expected).norm() < 1e-10 * young_pa);
    const double stored = share * mu / 2 * (e > 0 ? (grown - 1) / b : e * e);
    CHECK(elastic_energy_densities(m, {f, f, f, f})[0] - elastic_energy_densities(without, {f, f, f, f})[0] ==
          Approx(stored).margin(1e-10 * young_pa));
  }
  const Vec3 across = Vec3(2, 1, 0).normalized(), beyond = a.cross(across);
  const Mat3 slid = Mat3::Identity() + 0.4 * across * beyond.transpose() + 0.2 * beyond * beyond.transpose();
  CHECK((elastic_stress(m, slid) - elastic_stress(without, slid)).norm() < 1e-10 * young_pa);
}

TEST_CASE("the polar rotation is a rotation that leaves a symmetric stretch", "[elements]") {
  for (const Mat3& f : deformations()) {
    const Mat3 r = polar_rotation(f), s = r.transpose() * f;
    CHECK((r.transpose() * r - Mat3::Identity()).norm() < 1e-12);
    CHECK(r.determinant() == Approx(1));
    CHECK((s - s.transpose()).norm() < 1e-11);
  }
}

TEST_CASE("a clamped tangent has no negative eigenvalue, only adds stiffness, and is exact where it need not", "[elements]") {
  int softening = 0, exact = 0;
  for (const ElementMaterial& m : materials())
    for (const Mat3& f : deformations()) {
      const Mat9 a = elastic_tangent(m, f, false), clamped = elastic_tangent(m, f, true);
      CHECK((a - a.transpose()).norm() == 0);
      CHECK(test::symmetric_eigenvalues(clamped).minCoeff() > -1e-9 * a.norm());
      CHECK(test::symmetric_eigenvalues(clamped - a).minCoeff() > -1e-9 * a.norm());
      const Eigen::Matrix<double, 9, 1> dropped = (-test::symmetric_eigenvalues(a)).cwiseMax(0.0);
      CHECK((clamped - a).norm() == Approx(dropped.norm()).epsilon(1e-6).margin(1e-9 * a.norm()));
      ++(dropped.norm() < 1e-9 * a.norm() ? exact : softening);
    }
  CHECK(exact > 5);
  CHECK(softening > 20);
}

TEST_CASE("the corotational stress is that of the nearest rotation, for whatever deformation", "[elements]") {
  Draw draw(11);
  const ElementMaterial m(SolidMaterial{SolidLaw::corotational, 5e3, 0.4, 0});
  std::vector<Mat3> all = deformations();
  for (const Vec3& s : {Vec3(1.1, 0.9, 1e-3), Vec3(1.3, 0.7, 0), Vec3(1.1, 1, -0.98), Vec3(1.5, 0.04, 0.02),
                        Vec3(2e-6, 1.5e-6, 1e-6), Vec3(3e6, 2e6, -1e6)})
    all.push_back(draw.rotation() * s.asDiagonal() * draw.rotation());
  for (const Mat3& f : all) {
    const Mat3 r = polar_rotation(f);
    const Mat3 expected = 2 * m.mu * (f - r) + m.lambda * (r.cwiseProduct(f).sum() - 3) * r;
    const Vec3 stretches =
        signed_svd(f).s;  // H = F - 1 holds F to the rounding of 1, which turns R by its share of a pair of stretches
    const double of_rounding = 2.3e-16 * (2 * m.mu + 3 * m.lambda) / (stretches.y() + stretches.z());
    CHECK((elastic_stress(m, f) - expected).norm() < 1e-12 * (expected.norm() + m.mu) + of_rounding);
  }
}

TEST_CASE("a corotational solid that several rotations fit has the stress of one of them", "[elements]") {
  Draw draw(12);
  const ElementMaterial m(SolidMaterial{SolidLaw::corotational, 5e3, 0, 0});
  for (const Vec3& s : {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(1, 1, -1), Vec3(1, 0.5, -0.5), Vec3(1, 1e-9, -1e-10)})
    for (const bool along_axes : {true, false}) {
      const Mat3 f = along_axes ? Mat3(s.asDiagonal()) : Mat3(draw.rotation() * s.asDiagonal() * draw.rotation());
      const Mat3 r = f - elastic_stress(m, f) / (2 * m.mu);
      CHECK((r.transpose() * r - Mat3::Identity()).norm() < 1e-12);
      CHECK(r.determinant() == Approx(1));
      CHECK(r.cwiseProduct(f).sum() == Approx(s.sum()).margin(1e-6));
    }
}
