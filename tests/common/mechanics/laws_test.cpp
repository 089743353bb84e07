// Every law of elasticity against finite differences, closed forms and itself in other lanes.
#include "common/mechanics/laws.hpp"

#include <Eigen/Dense>
#include <catch2/catch.hpp>
#include <random>

#include "common/mechanics/viscosity.hpp"

using namespace palpate;

namespace {

using Matrix = Eigen::Matrix3d;
using Matrix9 = Eigen::Matrix<double, 9, 9>;
using Two = Lanes<double, 2>;
using L = Lanes<double, 4>;

class Draw {
 public:
  explicit Draw(unsigned seed) : random_(seed) {}
  Matrix matrix(double size) {
    return Matrix::NullaryExpr([&] { return size * normal_(random_); });
  }
  Matrix rotation() { return Eigen::Quaterniond(matrix(1).col(0).homogeneous()).normalized().toRotationMatrix(); }

 private:
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
};

/// Slightly strained, strongly strained, flattened, inside out.
std::vector<Matrix> deformations() {
  Draw draw(7);
  std::vector<Matrix> all{Matrix::Identity()};
  for (const double size : {0.01, 0.1, 0.3})
    for (int k = 0; k < 4; ++k) all.push_back(draw.rotation() * (Matrix::Identity() + draw.matrix(size)));
  all.push_back(draw.rotation() * Eigen::Vector3d(1.1, 0.9, 0.02).asDiagonal() * draw.rotation());
  all.push_back(draw.rotation() * Eigen::Vector3d(1.2, 0.9, -0.4).asDiagonal() * draw.rotation());
  return all;
}

std::vector<LawParameters> laws() {
  const Fibres fibres{{0.6, 0, 0.8}, 3, 2}, springs{{0, 1, 0}, 0.5, 0};
  return {{SolidLaw::corotational},
          {SolidLaw::neo_hookean},
          {SolidLaw::mooney_rivlin, 0.4},
          {SolidLaw::veronda_westmann, 2},
          {SolidLaw::ogden, 0.3, {5, -4}},
          {SolidLaw::gent, 0.8},
          {SolidLaw::ogden, 0, {-4.7, -4.7}, fibres},
          {SolidLaw::neo_hookean, 0, {}, fibres},
          {SolidLaw::mooney_rivlin, 0.4, {}, springs}};
}

constexpr double kMu = 2e3, kLambda = 9e3;
const LaneModuli<L> kModuli{L{} + kMu, L{} + kLambda};

/// H = F - 1 in all lanes.
LaneMatrix<L> lanes(const Matrix& f) {
  LaneMatrix<L> h;
  for (int k = 0; k < 9; ++k) h.of[k / 3][k % 3] = L{} + (f(k / 3, k % 3) - (k % 4 == 0 ? 1.0 : 0.0));
  return h;
}
double energy(const Elasticity& law, const Matrix& f) {
  L psi;
  law.energy(kModuli, lanes(f), psi);
  return psi[2];
}
Matrix stress(const Elasticity& law, const Matrix& f) {
  LaneMatrix<L> p{};
  law.add_stress(kModuli, lanes(f), p);
  return Matrix::NullaryExpr([&](Eigen::Index r, Eigen::Index c) { return p.of[r][c][1]; });
}
Tangent<L> tangent(const Elasticity& law, const Matrix& f) {
  Tangent<L> a;
  a.clear();
  law.add_tangent(kModuli, lanes(f), a);
  return a;
}
Matrix apply(const Tangent<L>& a, const Matrix& df) {
  LaneMatrix<L> of, dp;
  for (int k = 0; k < 9; ++k) of.of[k / 3][k % 3] = L{} + df(k / 3, k % 3);
  a.apply(of, dp);
  return Matrix::NullaryExpr([&](Eigen::Index r, Eigen::Index c) { return dp.of[r][c][3]; });
}
double inner(const Matrix& a, const Matrix& b) { return a.cwiseProduct(b).sum(); }

}  // namespace

TEST_CASE("the stress of every law is the gradient of its energy", "[mechanics]") {
  Draw draw(1);
  for (const LawParameters& of : laws()) {
    const Elasticity law(of);
    for (const Matrix& f : deformations()) {
      const Matrix way = draw.matrix(1);
      const double h = 1e-6, slope = (energy(law, f + h * way) - energy(law, f - h * way)) / (2 * h);
      INFO("law " << static_cast<int>(of.kind) << " F " << f);
      CHECK(std::abs(slope - inner(stress(law, f), way)) < 1e-5 * (stress(law, f).norm() + kMu) * way.norm());
    }
  }
}

TEST_CASE("the tangent of every law is the derivative of its stress", "[mechanics]") {
  Draw draw(2);
  for (const LawParameters& of : laws()) {
    const Elasticity law(of);
    for (const Matrix& f : deformations()) {
      // The corotational tangent is limited where two stretches nearly cancel; Ogden's has a kink where its powers end.
      if (of.kind == SolidLaw::corotational && f.determinant() < 0) continue;
      if (of.kind == SolidLaw::ogden && f.determinant() < 0.1) continue;
      const Matrix way = draw.matrix(1);
      const double h = 1e-6;
      const Matrix slope = (stress(law, f + h * way) - stress(law, f - h * way)) / (2 * h), dp = apply(tangent(law, f), way);
      INFO("law " << static_cast<int>(of.kind) << " F " << f << "\n" << slope << "\n" << dp);
      CHECK((slope - dp).norm() < 1e-6 * (dp.norm() + kMu));
    }
  }
}

TEST_CASE("every law has the moduli of small strains and no stress at rest", "[mechanics]") {
  Draw draw(3);
  for (const LawParameters& of : laws()) {
    if (of.fibres.share > 0) continue;
    const Elasticity law(of);
    CHECK(stress(law, Matrix::Identity()).norm() < 1e-9 * kMu);
    CHECK(std::abs(energy(law, Matrix::Identity())) < 1e-12 * kMu);
    const Matrix way = draw.matrix(1), strain = 0.5 * (way + way.transpose());
    const Matrix expected = 2 * kMu * strain + kLambda * strain.trace() * Matrix::Identity();
    INFO("law " << static_cast<int>(of.kind));
    CHECK((apply(tangent(law, Matrix::Identity()), way) - expected).norm() < 1e-9 * expected.norm());
  }
}

TEST_CASE("fibres stiffen by four times their modulus along themselves, and not across", "[mechanics]") {
  const Eigen::Vector3d a(0.6, 0, 0.8), across(0.8, 0, -0.6);
  const Elasticity with({SolidLaw::neo_hookean, 0, {}, {{0.6, 0, 0.8}, 3, 2}}), without({SolidLaw::neo_hookean});
  const auto more = [&](const Eigen::Vector3d& n) {
    const Matrix way = n * n.transpose();
    return inner(apply(tangent(with, Matrix::Identity()), way) - apply(tangent(without, Matrix::Identity()), way), way);
  };
  CHECK(more(a) == Approx(4 * 3 * kMu));
  CHECK(std::abs(more(across)) < 1e-9 * kMu);
}

TEST_CASE("a law without fibres turns its stress with the element", "[mechanics]") {
  Draw draw(4);
  for (const LawParameters& of : laws()) {
    const Elasticity law(of);
    for (const Matrix& f : deformations()) {
      const Matrix q = draw.rotation(), p = stress(law, f);
      CHECK((stress(law, q * f) - q * p).norm() < 1e-8 * (p.norm() + kMu));
    }
  }
}

TEST_CASE("laws have the same bits at every width", "[mechanics]") {
  for (const LawParameters& of : laws()) {
    const Elasticity law(of);
    for (const Matrix& f : deformations()) {
      LaneMatrix<Two> h, p{};
      for (int k = 0; k < 9; ++k) h.of[k / 3][k % 3] = Two{} + (f(k / 3, k % 3) - (k % 4 == 0 ? 1.0 : 0.0));
      law.add_stress({Two{} + kMu, Two{} + kLambda}, h, p);
      const Matrix wide = stress(law, f);
      for (int k = 0; k < 9; ++k) CHECK(p.of[k / 3][k % 3][0] == wide(k / 3, k % 3));
    }
  }
}

TEST_CASE("the neo-Hookean stress loses no digits in single precision at small strains", "[mechanics]") {
  const Elasticity law({SolidLaw::neo_hookean});
  REQUIRE(law.is_single_precision());
  Draw draw(5);
  for (const double size : {1e-6, 1e-4, 1e-2, 0.3}) {
    const Matrix h = draw.matrix(size);
    using F = Lanes<float, 8>;
    LaneMatrix<F> narrow, p{};
    for (int k = 0; k < 9; ++k) narrow.of[k / 3][k % 3] = F{} + static_cast<float>(h(k / 3, k % 3));
    law.add_stress({F{} + static_cast<float>(kMu), F{} + static_cast<float>(kLambda)}, narrow, p);
    const Matrix exact = stress(law, Matrix::Identity() + h);
    const double largest = exact.cwiseAbs().maxCoeff();
    for (int k = 0; k < 9; ++k)
      CHECK(std::abs(static_cast<double>(p.of[k / 3][k % 3][5]) - exact(k / 3, k % 3)) < 2e-6 * largest);
  }
}

TEST_CASE("a membrane has the stress of its plane strain energy", "[mechanics]") {
  Draw draw(6);
  const Elasticity law({SolidLaw::membrane});
  const Matrix plane = Eigen::Vector3d(1, 1, 0).asDiagonal();
  for (int k = 0; k < 5; ++k) {
    const Matrix f = draw.rotation() * (plane + draw.matrix(0.2) * plane), way = draw.matrix(1) * plane;
    const Matrix strain = 0.5 * (f.transpose() * f - plane);
    const double closed_form = kMu * strain.squaredNorm() + 0.5 * kLambda * strain.trace() * strain.trace(), h = 1e-6;
    CHECK(energy(law, f) == Approx(closed_form));
    CHECK(std::abs((energy(law, f + h * way) - energy(law, f - h * way)) / (2 * h) - inner(stress(law, f), way)) < 1e-5 * kMu);
    CHECK(((stress(law, f + h * way) - stress(law, f - h * way)) / (2 * h) - apply(tangent(law, f), way)).norm() < 1e-5 * kMu);
  }
}

TEST_CASE("blocks of a tangent are its products with gradients of shape functions", "[mechanics]") {
  Draw draw(8);
  const Elasticity law({SolidLaw::neo_hookean});
  const Tangent<L> a = tangent(law, deformations()[9]);
  const Eigen::Vector3d bi = draw.matrix(1).col(0), bj = draw.matrix(1).col(0), u = draw.matrix(1).col(0);
  const L of_i[3] = {L{} + bi[0], L{} + bi[1], L{} + bi[2]}, of_j[3] = {L{} + bj[0], L{} + bj[1], L{} + bj[2]};
  TangentColumns<L> columns;
  LaneMatrix<L> k;
  columns_of(a, of_j, columns);
  block(columns, of_i, k);
  const Matrix of_k = Matrix::NullaryExpr([&](Eigen::Index r, Eigen::Index c) { return k.of[r][c][0]; });
  const Eigen::Vector3d expected = apply(a, u * bj.transpose()) * bi;
  CHECK((of_k * u - expected).norm() < 1e-12 * expected.norm());
}

TEST_CASE("the viscous stress is linear in the rate, with its tangent, and dissipates", "[mechanics]") {
  Draw draw(9);
  for (const Matrix& f : deformations()) {
    const Matrix rate = draw.matrix(1);
    LaneMatrix<L> of_f, of_rate, p{};
    Tangent<L> a;
    a.clear();
    for (int k = 0; k < 9; ++k) {
      of_f.of[k / 3][k % 3] = L{} + f(k / 3, k % 3);
      of_rate.of[k / 3][k % 3] = L{} + rate(k / 3, k % 3);
    }
    add_viscous_stress(kModuli.mu, kModuli.lambda, of_f, of_rate, p);
    add_viscous_tangent(kModuli.mu, kModuli.lambda, of_f, a);
    const Matrix c = f.transpose() * rate;
    const Matrix closed_form = f * (kMu * (c + c.transpose()) + kLambda * c.trace() * Matrix::Identity());
    const Matrix of_lanes = Matrix::NullaryExpr([&](Eigen::Index r, Eigen::Index col) { return p.of[r][col][2]; });
    CHECK((of_lanes - closed_form).norm() < 1e-12 * closed_form.norm());
    CHECK((apply(a, rate) - closed_form).norm() < 1e-12 * closed_form.norm());
    CHECK(inner(closed_form, rate) >= 0);
  }
}
