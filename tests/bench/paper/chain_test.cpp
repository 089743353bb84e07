// The chain of section 5.1 built from elements against the printed formulas.
#include "bench/paper/chain.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "common/base/error.hpp"

using namespace palpate;

namespace {

std::vector<double> grid() {
  std::vector<double> f;
  for (double hz = 0.1; hz < 1e5; hz *= 1.05) f.push_back(hz);
  return f;
}

double critical(const ChainParameters& p, double lambda) { return 2 * std::sqrt(p.mass_kg * p.stiffness_n_m / lambda); }

}  // namespace

TEST_CASE("Eqs 6, 10 and 12 and all poles follow from elements, under-, critically and overdamped", "[chain]") {
  ChainParameters p;
  for (const double damping : {0.01, 0.1, 0.5, critical(p, 2), critical(p, 2 - std::sqrt(2)), 2.0, 20.0}) {
    p.damping_n_s_m = damping;
    for (const ChainModel model : kChainModels) {
      const ChainErrors errors = chain_errors(p, model, grid());
      CAPTURE(damping, name_of(model));
      CHECK(errors.transfer < 1e-9);
      CHECK(errors.poles < 1e-9);
    }
  }
}

TEST_CASE("A chain of any length agrees with its continued fraction and its modes", "[chain]") {
  for (const int masses : {1, 2, 4, 10, 40}) {
    ChainParameters p;
    p.masses = masses;
    for (const double damping : {0.05, 1.0}) {
      p.damping_n_s_m = damping;
      for (const ChainModel model : kChainModels) {
        const ChainErrors errors = chain_errors(p, model, grid());
        CAPTURE(masses, damping, name_of(model));
        CHECK(errors.transfer < 1e-9);
        CHECK(errors.poles < 1e-9);
      }
    }
  }
}

TEST_CASE("The continued fraction and eq. 6 are one function", "[chain]") {
  // Both forms must agree for three masses; for four masses they would differ.
  ChainParameters p;
  for (double hz = 0.1; hz < 1e4; hz *= 1.3) {
    const Complex s(0, 6.28 * hz), z = p.element(s), m = p.mass_kg * s * s;
    Complex y = z;
    for (int i = 0; i < 3; ++i) y = 1.0 / (1.0 / z + 1.0 / (m + y));
    CHECK(std::abs(y / chain_transfer(p, ChainModel::full, s) - 1.0) < 1e-9);
  }
}

TEST_CASE("The chain's poles are those printed as eqs 7 to 9, 11 and 13", "[chain]") {
  const ChainParameters p;
  const double k = p.stiffness_n_m, b = p.damping_n_s_m, m = p.mass_kg;
  const auto printed = [&](double c, double d) { return (-c * b + std::sqrt(Complex(c * b * c * b - d * m * k))) / (2 * m); };
  const auto full = chain_poles(p, ChainModel::full);
  REQUIRE(full.size() == 6);
  const double r = std::sqrt(2);
  CHECK(std::abs(full[0] / printed(2 - r, 4 * (2 - r)) - 1.0) < 1e-12);
  CHECK(std::abs(full[2] / printed(2, 8) - 1.0) < 1e-12);
  CHECK(std::abs(full[4] / printed(2 + r, 4 * (2 + r)) - 1.0) < 1e-12);
  CHECK(std::abs(chain_poles(p, ChainModel::first_mass)[0] / printed(2, 8) - 1.0) < 1e-12);
  CHECK(std::abs(chain_poles(p, ChainModel::two_level)[0] / printed(2.0 / 3, 8.0 / 3) - 1.0) < 1e-12);
}

TEST_CASE("Static gains are k/4, k/2 and k/4, and all end in k + b s", "[chain]") {
  const ChainParameters p;
  const double k = p.stiffness_n_m;
  CHECK(chain_static_gain(p, ChainModel::full) == k / 4);
  CHECK(chain_static_gain(p, ChainModel::first_mass) == k / 2);
  CHECK(chain_static_gain(p, ChainModel::two_level) == k / 4);
  for (const ChainModel model : kChainModels) {
    const SecondOrderSystem system = chain_system(p, model);
    CHECK(TransferFunction(system)(0)(0, 0).real() == Approx(chain_static_gain(p, model)).epsilon(1e-12));
    const Complex fast(0, 1e8);
    CHECK(std::abs(TransferFunction(system)(fast)(0, 0) / p.element(fast) - 1.0) < 1e-4);
  }
}

TEST_CASE("A chain without masses, or of what is no number, is refused", "[chain]") {
  CHECK_THROWS_AS(validate({.masses = 0}, "chain"), InputError);
  CHECK_THROWS_AS(validate({.stiffness_n_m = NAN}, "chain"), InputError);
  CHECK_THROWS_AS(validate({.mass_kg = -1}, "chain"), InputError);
}
