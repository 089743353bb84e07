// Elements of a player against the law of the body that they are of, and the bound of Ogden's tangent that a player uses.
#include <Eigen/Dense>
#include <catch2/catch.hpp>
#include <random>

#include "common/mechanics/polar.hpp"
#include "common/port/nonlinear_tetrahedron.hpp"
#include "server/elements/element_material.hpp"

using namespace palpate;

namespace {

class PlayerDraw {
 public:
  explicit PlayerDraw(unsigned seed) : random_(seed) {}
  Mat3 matrix(double size) {
    return Mat3::NullaryExpr([&] { return size * normal_(random_); });
  }
  Mat3 rotation() { return Eigen::Quaterniond(matrix(1).col(0).homogeneous()).normalized().toRotationMatrix(); }

 private:
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
};

/// Slightly strained, strongly strained, flattened, inside out.
std::vector<Mat3> player_deformations() {
  PlayerDraw draw(7);
  std::vector<Mat3> all{Mat3::Identity()};
  for (const double size : {0.01, 0.1, 0.3})
    for (int k = 0; k < 4; ++k) all.push_back(draw.rotation() * (Mat3::Identity() + draw.matrix(size)));
  all.push_back(draw.rotation() * Vec3(1.1, 0.9, 0.02).asDiagonal() * draw.rotation());
  all.push_back(draw.rotation() * Vec3(1.2, 0.9, -0.4).asDiagonal() * draw.rotation());
  return all;
}

std::vector<SolidMaterial> player_materials() {
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

}  // namespace

TEST_CASE("Ogden's tangent is no steeper than its bound says, where a solid is swollen or squeezed alike above all",
          "[body][tetra]") {
  // By finite differences of the stress, without the term lambda (G : dF) G.
  PlayerDraw draw(31);
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

TEST_CASE("what a player's tetrahedron pushes beyond its tangent is what is left of its law, near and far", "[body][tetra]") {
  PlayerDraw draw(19);
  for (const SolidMaterial& solid : player_materials()) {
    const ElementMaterial m(solid);
    if (m.kind == SolidLaw::corotational) continue;  // in its own frame: tests/port
    for (const Mat3& f : player_deformations()) {
      ElementLinearisation at;
      std::vector<Mat3> changes;
      TetraLanes df;
      for (int l = 0; l < kTetraLane; ++l) {
        at.set(l, solid.parameters(), f, m.mu, m.lambda);
        changes.push_back(draw.matrix(std::pow(10.0, -2 + 0.28 * l)));
        for (int k = 0; k < 9; ++k) df[static_cast<std::size_t>(k)][l] = static_cast<float>(changes.back()(k / 3, k % 3));
      }
      const TetraLanes q = nonlinear_residual_stress(at, df, ElementRotation());
      const TetraLane energy = nonlinear_residual_energy(at, df, ElementRotation());
      for (int l = 0; l < kTetraLane; ++l) {
        Mat3 change, found;
        for (int k = 0; k < 9; ++k) {
          change(k / 3, k % 3) = static_cast<double>(df[static_cast<std::size_t>(k)][l]);
          found(k / 3, k % 3) = static_cast<double>(q[static_cast<std::size_t>(k)][l]);
        }
        const Mat3 all = elastic_stress(m, f + change), here = elastic_stress(m, f),
                   linear = (elastic_tangent(m, f, false) * change.reshaped<Eigen::RowMajor>()).reshaped<Eigen::RowMajor>(3, 3);
        const Mat3 expected = all - here - linear;
        INFO("nu " << solid.poisson << ", law " << static_cast<int>(m.kind) << ", |dF| " << change.norm() << ", F\n" << f);
        // Rounding of single precision (6e-8) in sums of products of up to five numbers.
        CHECK((found - expected).norm() < 2e-5 * expected.norm() + 5e-6 * (linear.norm() + here.norm() * change.norm()));
        const double second = 0.5 * linear.cwiseProduct(change).sum(), first = here.cwiseProduct(change).sum();
        const double stored = elastic_energy_density(m, f + change) - elastic_energy_density(m, f) - first - second;
        CHECK(std::abs(static_cast<double>(energy[l]) - stored) <
              2e-5 * (std::abs(stored) + 0.3 * (linear.norm() + here.norm() * change.norm()) * change.norm()));
      }
    }
  }
}
