// The kernel of a tetrahedron against finite differences, closed forms and invariants.
#include <Eigen/Dense>
#include <catch2/catch.hpp>
#include <functional>
#include <random>

#include "common/mechanics/polar.hpp"
#include "server/body/tetra_kernel.hpp"

using namespace palpate;

namespace {

const Mat34 kRest = (Mat34() << 0.1, 1.2, 0.2, 0.3, 0.0, 0.1, 1.1, 0.2, 0.0, 0.2, -0.1, 0.9).finished() * 0.01;

class Draw {
 public:
  explicit Draw(unsigned seed) : random_(seed) {}
  Mat3 matrix(double size) {
    return Mat3::NullaryExpr([&] { return size * normal_(random_); });
  }
  Mat3 rotation() { return Eigen::Quaterniond(matrix(1).col(0).homogeneous()).normalized().toRotationMatrix(); }

 private:
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
};

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

std::vector<TetraMaterial> materials() {
  const std::vector<SolidMaterial> solids = solid_materials();
  return {solids.begin(), solids.end()};
}

using Mat12 = Eigen::Matrix<double, 12, 12>;

Mat12 element_stiffness(const TetraTangent& tangent, const TetraRest& rest) {
  Mat12 k;
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j) k.block<3, 3>(3 * i, 3 * j) = tangent.block(rest, i, j);
  return k;
}

}  // namespace

TEST_CASE("a tetrahedron's stress is the gradient of its energy", "[body][tetra]") {
  Draw draw(1);
  for (const TetraMaterial& m : materials())
    for (const Mat3& f : deformations()) {
      const Mat3 direction = draw.matrix(1), p = elastic_stress(m, f);
      const double h = 1e-6;
      const double slope =
          (elastic_energy_density(m, f + h * direction) - elastic_energy_density(m, f - h * direction)) / (2 * h);
      CHECK(slope == Approx(p.cwiseProduct(direction).sum()).epsilon(1e-6).margin(1e-3));
    }
}

TEST_CASE("a tetrahedron's tangent is the derivative of its stress", "[body][tetra]") {
  Draw draw(2);
  for (const TetraMaterial& m : materials())
    for (const Mat3& f : deformations()) {
      if (m.law == SolidLaw::corotational && f.determinant() < 0.05) continue;  // clamped near the flip of R
      const Mat3 direction = draw.matrix(1);
      const double h = 1e-6;
      const Mat3 slope = (elastic_stress(m, f + h * direction) - elastic_stress(m, f - h * direction)) / (2 * h);
      const Mat3 tangent = TetraTangent(m, f, false).apply(direction);
      CHECK((slope - tangent).norm() < 1e-6 * (slope.norm() + m.mu));
    }
}

TEST_CASE("a tetrahedron's second-order stress is the second derivative of its stress", "[body][tetra]") {
  constexpr double h = 3e-5;
  Draw draw(4);
  for (const TetraMaterial& m : materials())
    for (const Mat3& f : deformations()) {
      const Vec3 stretches = Eigen::JacobiSVD<Mat3>(f).singularValues();
      if (m.law == SolidLaw::corotational && (f.determinant() < 0 || stretches.y() + stretches.z() < 0.5)) continue;
      const Mat3 one = draw.matrix(1), two = draw.matrix(1);
      const auto at = [&](double a, double b) { return elastic_stress(m, f + a * h * one + b * h * two); };
      const Mat3 expected = (at(1, 1) - at(1, -1) - at(-1, 1) + at(-1, -1)) / (4 * h * h);
      CHECK((second_order_stress(m, f, one, two) - expected).norm() < 1e-4 * expected.norm());
      CHECK((second_order_stress(m, f, two, one) - expected).norm() < 1e-4 * expected.norm());
    }
}

TEST_CASE("a tetrahedron at rest has no stress and answers as linear elasticity says", "[body][tetra]") {
  Draw draw(3);
  for (const SolidLaw law :
       {SolidLaw::corotational, SolidLaw::neo_hookean, SolidLaw::mooney_rivlin, SolidLaw::veronda_westmann, SolidLaw::ogden}) {
    const double e = 5e3, nu = 0.3, mu = e / 2.6, lambda = e * nu / (1.3 * 0.4);
    const TetraMaterial m(SolidMaterial{law, e, nu, 0.02, 0.7, {3, -2}});
    const Mat3 turned = draw.rotation(), df = draw.matrix(1), strain = 0.5 * (df + df.transpose());
    const Mat3 hooke = 2 * mu * strain + lambda * strain.trace() * Mat3::Identity();
    CHECK(elastic_stress(m, turned).norm() < 1e-9 * e);
    CHECK(std::abs(elastic_energy_density(m, turned)) < 1e-9 * e);
    CHECK((TetraTangent(m, Mat3::Identity(), false).apply(df) - hooke).norm() < 1e-9 * e);
    CHECK((viscous_stress(m, Mat3::Identity(), df) - 0.02 * hooke).norm() < 1e-9 * e);
  }
}

TEST_CASE("laws of both invariants have the closed forms of Rivlin's experiments", "[body][tetra]") {
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
    const TetraMaterial m(SolidMaterial{of.law, young_pa, nu, 0, of.shape});
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
          "[body][tetra]") {
  const double young_pa = 5e3, nu = 0.45;
  const TetraMaterial two(SolidMaterial{SolidLaw::ogden, young_pa, nu, 0, 0, {2, 2}}),
      neo(SolidMaterial{SolidLaw::mooney_rivlin, young_pa, nu, 0, 0});
  for (const Mat3& f : deformations()) {
    const Mat3 expected = elastic_stress(neo, f);
    CHECK((elastic_stress(two, f) - expected).norm() < 1e-12 * (expected.norm() + young_pa));
    CHECK(elastic_energy_density(two, f) == Approx(elastic_energy_density(neo, f)).epsilon(1e-12).margin(1e-10 * young_pa));
  }
  const TetraMaterial both(SolidMaterial{SolidLaw::ogden, young_pa, nu, 0, 0.3, {2, -2}}),
      rivlin(SolidMaterial{SolidLaw::mooney_rivlin, young_pa, nu, 0, 0.3});
  for (const double l : {0.7, 0.999, 1.0, 1.2, 1.5}) {
    const Mat3 f = Vec3(l, 1 / std::sqrt(l), 1 / std::sqrt(l)).asDiagonal();
    const Mat3 cauchy = elastic_stress(both, f) * f.transpose(), expected = elastic_stress(rivlin, f) * f.transpose();
    CHECK(cauchy(0, 0) - cauchy(1, 1) == Approx(expected(0, 0) - expected(1, 1)).margin(1e-11 * young_pa));
  }
}

TEST_CASE("Ogden's stress is as sharp where principal stretches nearly agree as where they do not", "[body][tetra]") {
  // Against the definition: dPsi/dl_i in the principal frame.
  Draw draw(29);
  const SolidMaterial solid{SolidLaw::ogden, 5e3, 0.45, 0, 0.4, {9, -3}};
  const TetraMaterial m(solid);
  for (const double apart : {0.0, 1e-12, 1e-9, 1e-6, 4.9e-4, 5.1e-4, 1e-3, 1e-2})
    for (const double third : {1.0, 1 + apart, 1 - 2 * apart, 0.8, 1.2}) {
      const Vec3 l(1.05, 1.05 + apart, 1.05 * third);
      const Mat3 u = draw.rotation(), v = draw.rotation();
      Vec3 g = (m.lambda * (l.prod() - 1) - m.ogden.sum * m.mu) * l.prod() * l.cwiseInverse();
      for (std::size_t p = 0; p < 2; ++p)
        g += 2 * m.mu * (p == 0 ? 0.6 : 0.4) / solid.exponents[p] * l.array().pow(solid.exponents[p] - 1).matrix();
      const Mat3 expected = u * g.asDiagonal() * v.transpose();
      CHECK((elastic_stress(m, u * l.asDiagonal() * v.transpose()) - expected).norm() < 1e-11 * m.mu);
    }
}

TEST_CASE("Ogden's tangent is no steeper than its bound says, where a solid is swollen or squeezed alike above all",
          "[body][tetra]") {
  // By finite differences of the stress, without the term lambda (G : dF) G.
  Draw draw(31);
  for (const double exponent : {2.0, 5.0, -4.7})
    for (const double lambda : {0.5, 50.0, 1000.0})
      for (const double stretch : {0.8, 0.95, 1.05, 1.1, 1.3})
        for (const bool alike : {true, false}) {
          const OgdenLaw law(LawParameters{SolidLaw::ogden, 0, {exponent, exponent}, {}});
          const OgdenModuli moduli{1, lambda};
          const Vec3 l = alike ? Vec3::Constant(stretch) : Vec3(stretch, 1, 1 / stretch);
          const Mat3 f = draw.rotation() * l.asDiagonal() * draw.rotation(), g = cofactors(f);
          Eigen::Matrix<double, 9, 9> tangent;
          for (Eigen::Index i = 0; i < 9; ++i) {
            constexpr double kStep = 1e-5;
            Mat3 df = Mat3::Zero();
            df.reshaped()[i] = kStep;
            const Mat3 dp = (ogden_stress(law, moduli, f + df) - ogden_stress(law, moduli, f - df)) / (2 * kStep);
            tangent.col(i) = (dp - lambda * g.reshaped()[i] * g).reshaped();
          }
          const Eigen::Matrix<double, 9, 9> symmetric = 0.5 * (tangent + tangent.transpose());
          const double steepest =
              Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 9, 9>>(symmetric).eigenvalues().tail<1>()[0];
          CAPTURE(exponent, lambda, stretch, alike);
          CHECK(steepest <= (1 + 1e-6) * ogden_tangent(law, moduli, f).steepest);
        }
}

TEST_CASE("fibres pull along themselves as their exponential says, and across themselves with nothing", "[body][tetra]") {
  const double young_pa = 5e3, nu = 0.3, mu = young_pa / (2 * (1 + nu)), share = 2, b = 1.5;
  const Vec3 a = Vec3(1, -2, 2) / 3;
  const SolidMaterial plain{SolidLaw::neo_hookean, young_pa, nu, 0};
  SolidMaterial with = plain;
  with.fibres = {{a.x(), a.y(), a.z()}, share, b};
  const TetraMaterial without(plain), m(with);
  Draw draw(3);
  const Mat3 turned = draw.rotation();
  for (const double l : {0.5, 0.9, 1.0, 1.1, 1.4}) {
    const Mat3 f = turned * (Mat3::Identity() + (l - 1) * a * a.transpose());
    const double e = l * l - 1, grown = e > 0 ? std::exp(b * e * e) : 1;
    const Mat3 expected = 2 * share * mu * e * grown * l * (turned * a) * a.transpose();
    CHECK((elastic_stress(m, f) - elastic_stress(without, f) - expected).norm() < 1e-10 * young_pa);
    const double stored = share * mu / 2 * (e > 0 ? (grown - 1) / b : e * e);
    CHECK(elastic_energy_density(m, f) - elastic_energy_density(without, f) == Approx(stored).margin(1e-10 * young_pa));
  }
  const Vec3 across = Vec3(2, 1, 0).normalized(), beyond = a.cross(across);
  const Mat3 slid = Mat3::Identity() + 0.4 * across * beyond.transpose() + 0.2 * beyond * beyond.transpose();
  CHECK((elastic_stress(m, slid) - elastic_stress(without, slid)).norm() < 1e-10 * young_pa);
}

TEST_CASE("blocks of a tetrahedron's stiffness are its tangent between its nodes", "[body][tetra]") {
  const TetraRest rest(kRest);
  for (const TetraMaterial& m : materials())
    for (const Mat3& f : deformations())
      for (const bool clamp : {false, true}) {
        const TetraTangent tangent(m, f, clamp);
        const Mat12 k = element_stiffness(tangent, rest);
        for (int j = 0; j < 4; ++j)
          for (int axis = 0; axis < 3; ++axis) {
            const Mat34 forces = rest.volume_m3 * tangent.apply(Vec3::Unit(axis) * rest.b.col(j).transpose()) * rest.b;
            CHECK((k.col(3 * j + axis) - forces.reshaped()).norm() < 1e-9 * k.norm());
          }
      }
}

TEST_CASE("a clamped tetrahedron never softens and is exact where it does not", "[body][tetra]") {
  const TetraRest rest(kRest);
  int softening = 0, exact = 0;
  for (const TetraMaterial& m : materials())
    for (const Mat3& f : deformations()) {
      const Mat12 k = element_stiffness(TetraTangent(m, f, false), rest),
                  clamped = element_stiffness(TetraTangent(m, f, true), rest);
      const Eigen::SelfAdjointEigenSolver<Mat12> eigen(k), eigen_clamped(clamped);
      CHECK((clamped - clamped.transpose()).norm() < 1e-9 * clamped.norm());
      CHECK(eigen_clamped.eigenvalues().minCoeff() > -1e-9 * clamped.norm());
      const Eigen::SelfAdjointEigenSolver<Mat12> change(clamped - k);
      CHECK(change.eigenvalues().minCoeff() > -1e-8 * clamped.norm());  // it only adds stiffness
      // The 9 eigenvalues of dP/dF are non-negative exactly when those of K are.
      if (eigen.eigenvalues().minCoeff() > -1e-9 * k.norm()) {
        if (m.fibre_k == 0) CHECK((clamped - k).norm() < 1e-6 * k.norm());  // otherwise each is clamped by itself
        ++exact;
      } else {
        ++softening;
      }
    }
  CHECK(exact > 5);
  CHECK(softening > 20);
}

TEST_CASE("the polar rotation is a rotation that leaves a symmetric stretch", "[body][tetra]") {
  for (const Mat3& f : deformations()) {
    const Mat3 r = polar_rotation(f), s = r.transpose() * f;
    CHECK((r.transpose() * r - Mat3::Identity()).norm() < 1e-12);
    CHECK(r.determinant() == Approx(1));
    CHECK((s - s.transpose()).norm() < 1e-11);
  }
}

TEST_CASE("a viscous tetrahedron takes energy from every motion but a rigid one", "[body][tetra]") {
  Draw draw(4);
  const TetraRest rest(kRest);
  for (const TetraMaterial& m : materials())
    for (const Mat3& f : deformations()) {
      const Mat3 rate = draw.matrix(1), spin = draw.matrix(1);
      CHECK(viscous_stress(m, f, rate).cwiseProduct(rate).sum() > 0);
      CHECK(viscous_stress(m, f, (spin - spin.transpose()) * f).norm() < 1e-9 * m.mu);
      for (int i = 0; i < 4; ++i)
        for (int j = 0; j < 4; ++j) {
          const Vec3 v = rate.col(0);
          const Vec3 force = rest.volume_m3 * viscous_stress(m, f, v * rest.b.col(j).transpose()) * rest.b.col(i);
          CHECK((viscous_block(m, rest, f, i, j) * v - force).norm() < 1e-10 * (force.norm() + 1e-6));
        }
    }
}
