// Stress of elements beyond their linear stress, against the laws themselves in doubles.
#include "common/mechanics/residual.hpp"

#include <Eigen/Eigenvalues>
#include <catch2/catch.hpp>
#include <random>

using namespace palpate;

namespace {

using Matrix = Eigen::Matrix3d;
using Lane = ElementLinearisation::Lane;
using Pair = Lanes<double, 2>;

constexpr double kResidualMu = 2e3, kResidualLambda = 9e3;
constexpr std::size_t kCount = ElementLinearisation::kElements;

std::vector<LawParameters> residual_laws() {
  return {{SolidLaw::corotational},       {SolidLaw::neo_hookean},
          {SolidLaw::mooney_rivlin, 0.4}, {SolidLaw::veronda_westmann, 2},
          {SolidLaw::gent, 0.8},          {SolidLaw::ogden, 0.3, {5, -4}},
          {SolidLaw::membrane},           {SolidLaw::neo_hookean, 0, {}, {{0.6, 0, 0.8}, 3, 2}}};
}

/// Stress and energy of a law at F.
struct AtDeformation {
  Matrix p;
  double psi;

  AtDeformation(const LawParameters& law, const Matrix& f) {
    const LaneModuli<Pair> m{Pair{} + kResidualMu, Pair{} + kResidualLambda};
    LaneMatrix<Pair> h, stress{};
    for (int k = 0; k < 9; ++k) h.of[k / 3][k % 3] = Pair{} + (f(k / 3, k % 3) - (k % 4 == 0 ? 1 : 0));
    Pair energy;
    Elasticity(law).add_stress(m, h, stress);
    Elasticity(law).energy(m, h, energy);
    for (int k = 0; k < 9; ++k) p(k / 3, k % 3) = stress.of[k / 3][k % 3][0];
    psi = energy[0];
  }
};

/// Elements strained and rotated at the stamp, and a change of each.
struct ResidualCase {
  ElementLinearisation at;
  LawParameters law;
  std::vector<Matrix> f;
  Lane df[9];
  std::mt19937 random{3};

  ResidualCase(const LawParameters& of, float size) : at(of), law(of) {
    std::normal_distribution<double> normal;
    const auto draw = [&](double by) { return Matrix(Matrix::NullaryExpr([&] { return by * normal(random); })); };
    for (std::size_t e = 0; e < kCount; ++e) {
      const Matrix q = Eigen::Quaterniond(Eigen::Vector4d(draw(1).col(0).homogeneous())).normalized().toRotationMatrix();
      f.push_back(q * (Matrix::Identity() + draw(0.08)));
      at.set(e, f.back(), kResidualMu, kResidualLambda);
    }
    for (Lane& entry : df)
      for (std::size_t e = 0; e < kCount; ++e) entry[e] = size * static_cast<float>(normal(random));
    at.linearise();
  }
  Matrix change(std::size_t e) const {
    return Matrix::NullaryExpr([&](Eigen::Index r, Eigen::Index c) { return static_cast<double>(df[3 * r + c][e]); });
  }
  Matrix stress(std::size_t e) const {
    Lane q[9];
    at.stress(df, q);
    return Matrix::NullaryExpr([&](Eigen::Index r, Eigen::Index c) { return static_cast<double>(q[3 * r + c][e]); });
  }
};

}  // namespace

TEST_CASE("the residual is the stress of the law beyond its first order, and the energy that beyond its second", "[mechanics]") {
  for (const LawParameters& law : residual_laws())
    for (const float size : {0.02F, 0.2F}) {
      const ResidualCase c(law, size);
      double energy = 0;
      for (std::size_t e = 0; e < kCount; ++e) {
        constexpr double h = 1e-5;
        const Matrix df = c.change(e);
        const AtDeformation before(law, c.f[e]), there(law, c.f[e] + df), more(law, c.f[e] + h * df), less(law, c.f[e] - h * df);
        const Matrix first = (more.p - less.p) / (2 * h), expected = there.p - before.p - first;
        INFO("law " << static_cast<int>(law.kind) << " size " << size);
        CHECK((c.stress(e) - expected).norm() < 1e-6 * first.norm() + 1e-6 * expected.norm());
        energy += there.psi - before.psi - before.p.cwiseProduct(df).sum() - 0.5 * first.cwiseProduct(df).sum();
      }
      const double scale = kResidualMu * static_cast<double>(size) * static_cast<double>(size);
      CHECK(std::abs(c.at.energy(c.df) - energy) < 1e-5 * std::abs(energy) + 1e-5 * scale);
    }
}

TEST_CASE("one element at many changes has the bits of that element among others", "[mechanics]") {
  for (const LawParameters& law : residual_laws()) {
    const ResidualCase c(law, 0.1F);
    constexpr std::size_t kChanges = 16;
    for (std::size_t e = 0; e < kCount; ++e) {
      float df[9 * kChanges], q[9 * kChanges];
      for (std::size_t k = 0; k < 9; ++k)
        for (std::size_t s = 0; s < kChanges; ++s) df[k * kChanges + s] = c.df[k][e];
      c.at.stresses(e, kChanges, df, q);
      Lane together[9];
      c.at.stress(c.df, together);
      for (std::size_t k = 0; k < 9; ++k)
        for (std::size_t s = 0; s < kChanges; ++s) CHECK(q[k * kChanges + s] == together[k][e]);
    }
  }
}

TEST_CASE("the bound of the stiffness against changes that keep the volume is twice mu at rest, whatever the law",
          "[mechanics]") {
  for (const LawParameters& law : residual_laws()) {
    if (law.fibres.share > 0 || law.kind == SolidLaw::membrane) continue;
    ElementLinearisation at(law);
    at.set(5, Matrix::Identity(), kResidualMu, kResidualLambda);
    at.linearise();
    CHECK(at.deviatoric_bound(5) == Approx(2 * kResidualMu).epsilon(1e-5));
    // Strained, no change that keeps the volume has more stiffness.
    const ResidualCase c(law, 0);
    for (std::size_t e = 0; e < kCount; ++e) {
      const Matrix g = c.f[e].determinant() * c.f[e].inverse().transpose();
      std::mt19937 random(9);
      std::normal_distribution<double> normal;
      for (int k = 0; k < 20; ++k) {
        Matrix way = Matrix::NullaryExpr([&] { return normal(random); });
        way -= g * (g.cwiseProduct(way).sum() / g.squaredNorm());
        way /= way.norm();
        constexpr double h = 1e-5;
        const Matrix dp = (AtDeformation(law, c.f[e] + h * way).p - AtDeformation(law, c.f[e] - h * way).p) / (2 * h);
        CHECK(dp.cwiseProduct(way).sum() < (1 + 1e-5) * c.at.deviatoric_bound(e));
      }
    }
  }
}

TEST_CASE("Gent's law stiffens to four times its modulus and is finite beyond its limit", "[mechanics]") {
  // Simple shear by s: J = 1 and I_1 = s^2, so that the shear stress is mu s e(s^2).
  constexpr double kLimit = 0.5;
  const LawParameters law{SolidLaw::gent, kLimit};
  const auto shear = [&](double s) {
    Matrix f = Matrix::Identity();
    f(0, 1) = s;
    return AtDeformation(law, f).p(0, 1);
  };
  for (const double s : {0.01, 0.2, 0.4, 0.6}) CHECK(shear(s) == Approx(kResidualMu * s / (1 - s * s / kLimit)));
  const double end = 0.75 * kLimit, slope = 16 / kLimit;
  for (const double s : {0.7, 1.0, 3.0}) CHECK(shear(s) == Approx(kResidualMu * s * (4 + slope * (s * s - end))));
}
