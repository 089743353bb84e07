// The kernel of a tetrahedron against finite differences, closed forms and invariants.
#include <Eigen/Dense>
#include <catch2/catch.hpp>
#include <random>

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

/// Little strained, much strained, flattened, inside out.
std::vector<Mat3> deformations() {
  Draw draw(7);
  std::vector<Mat3> all{Mat3::Identity()};
  for (const double size : {0.01, 0.1, 0.3})
    for (int k = 0; k < 4; ++k) all.push_back(draw.rotation() * (Mat3::Identity() + draw.matrix(size)));
  all.push_back(draw.rotation() * Vec3(1.1, 0.9, 0.02).asDiagonal() * draw.rotation());
  all.push_back(draw.rotation() * Vec3(1.2, 0.9, -0.4).asDiagonal() * draw.rotation());
  return all;
}

std::vector<TetraMaterial> materials() {
  std::vector<TetraMaterial> all;
  for (const SolidLaw law : {SolidLaw::corotational, SolidLaw::neo_hookean})
    for (const double poisson : {0.0, 0.3, 0.49}) all.emplace_back(SolidMaterial{law, 5e3, poisson, 0.02});
  return all;
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
      if (m.law == SolidLaw::corotational && f.determinant() < 0.05) continue;  // cut where R turns over
      const Mat3 direction = draw.matrix(1);
      const double h = 1e-6;
      const Mat3 slope = (elastic_stress(m, f + h * direction) - elastic_stress(m, f - h * direction)) / (2 * h);
      const Mat3 tangent = TetraTangent(m, f, false).apply(direction);
      CHECK((slope - tangent).norm() < 1e-6 * (slope.norm() + m.mu));
    }
}

TEST_CASE("a tetrahedron's second-order stress is the second derivative of its stress", "[body][tetra]") {
  constexpr double h = 1e-4;
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
  for (const SolidLaw law : {SolidLaw::corotational, SolidLaw::neo_hookean}) {
    const double e = 5e3, nu = 0.3, mu = e / 2.6, lambda = e * nu / (1.3 * 0.4);
    const TetraMaterial m(SolidMaterial{law, e, nu, 0.02});
    const Mat3 turned = draw.rotation(), df = draw.matrix(1), strain = 0.5 * (df + df.transpose());
    const Mat3 hooke = 2 * mu * strain + lambda * strain.trace() * Mat3::Identity();
    CHECK(elastic_stress(m, turned).norm() < 1e-9 * e);
    CHECK(std::abs(elastic_energy_density(m, turned)) < 1e-9 * e);
    CHECK((TetraTangent(m, Mat3::Identity(), false).apply(df) - hooke).norm() < 1e-9 * e);
    CHECK((viscous_stress(m, Mat3::Identity(), df) - 0.02 * hooke).norm() < 1e-9 * e);
  }
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
      CHECK(change.eigenvalues().minCoeff() > -1e-8 * clamped.norm());  // it only adds
      // The 9 eigenvalues of dP/dF are non-negative exactly when those of K are.
      if (eigen.eigenvalues().minCoeff() > -1e-9 * k.norm()) {
        CHECK((clamped - k).norm() < 1e-6 * k.norm());
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
