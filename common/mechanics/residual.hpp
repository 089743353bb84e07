// The stress of finite elements beyond their linear stress from a stamp on, by its definition, for every law:
//
//     Q = P(H + dH) - P(H) - A dH                                          [Pa]
//     its energy  Psi(H + dH) - Psi(H) - P(H) : dH - dH : A dH / 2         [J/m^3]
//
// H = F - 1 at the stamp, A = dP/dF there (law.hpp), dH the change of F. Moduli are multiplied by the elements' volumes, and Q
// and the energy then are too. P(H + dH) - P(H), where much cancels, is computed in doubles; dH, A and Q are floats, so that Q
// has an error of some 1e-7 |A dH|, the rounding of the linear stress itself.
#pragma once

#include <Eigen/Core>
#include <array>

#include "common/mechanics/laws.hpp"

namespace palpate {

/// Elements of one law, linearised together.
class ElementLinearisation {
 public:
  static constexpr std::size_t kElements = 8;
  using Lane = Lanes<float, kElements>;

  /// Elements at rest, without stiffness.
  explicit ElementLinearisation(const LawParameters& law = {}) : law_(law) {}
  /// Sets F and the moduli of one element; linearise() follows the last one.
  void set(std::size_t element, const Eigen::Matrix3d& f, double mu, double lambda);
  /// Computes P, A and Psi.
  void linearise();
  /// Returns the largest absolute row sum of A - lambda_L G G^T, G the cofactors of F: a bound of the stiffness against changes
  /// of F that keep the volume.
  double deviatoric_bound(std::size_t element) const;

  /// Computes Q of each element, row by row. No allocation.
  void stress(const Lane (&df)[9], Lane (&q)[9]) const noexcept;
  /// Returns the sum of the energies beyond the second order. No allocation.
  double energy(const Lane (&df)[9]) const noexcept;
  /// Computes Q of one element at `count` changes, a multiple of kElements: 9 rows of `count` numbers each.
  void stresses(std::size_t element, std::size_t count, const float* df, float* q) const noexcept;

 private:
  using Numbers = std::array<double, kElements>;

  Elasticity law_;
  alignas(64) Numbers mu_{}, lambda_{}, psi_{};
  std::array<Numbers, 9> h_{}, p_{};
  std::array<std::array<float, kElements>, 45> a_{};
};

}  // namespace palpate
