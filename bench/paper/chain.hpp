// The chain of the paper's section 5.1: x - (k, b) - m - (k, b) - m - ... - m - (k, b) - wall.
//
// Three models of it as seen from the displaced end x, each a body of elements linearised like any other, and the formulas that
// they have to agree with. With N masses, n = N + 1 elements, z = k + b s:
//
//     full (fig. 12)        F/X = Y_n,   Y_1 = z,   1/Y_i = 1/z + 1/(m s^2 + Y_{i-1})     poles  m s^2 + lambda_j (b s + k) = 0,
//                           a continued fraction; eq. 6 for N = 3                        lambda_j = 2 - 2 cos(j pi / n), j = 1..N
//     first mass (fig. 13)  F/X = z (1 - z / (m s^2 + 2 z))                   eq. 10      lambda = 2, eq. 11
//     two-level (fig. 14)   F/X = z (1 - z / (m' s^2 + z + z / (n - 1)))      eq. 12    m' s^2 + n/(n - 1) (b s + k) = 0, eq. 13
//                           m' = m (1 + (N - 1) / 2)
//
// All have the high-frequency asymptote z; their static gains are k/n, k/2 and k/n: k/4, k/2, k/4 for the paper's three masses.
// Poles come in pairs from a quadratic. If the two of a pair nearly coincide (critical damping), the eigenvalues of the state
// matrix are known only to the square root of rounding, but their mean and product to rounding, so those are compared there.
// Source: Cavusoglu and Tendick, eqs 6-13, figs 12-15.
#pragma once

#include "bench/paper/second_order.hpp"

namespace palpate {

struct ChainParameters {
  int masses = 3;
  double stiffness_n_m = 100, damping_n_s_m = 0.1, mass_kg = 0.001;

  int elements() const { return masses + 1; }
  /// k + b s
  Complex element(Complex s) const { return stiffness_n_m + s * damping_n_s_m; }
};

/// Throws InputError for invalid parameters; `where` names the source of the numbers.
void validate(const ChainParameters& p, const std::string& where);

/// The chain along x; node 0 is displaced, node masses + 1 is the wall.
LumpedBody chain_body(const ChainParameters& p);

enum class ChainModel { full, first_mass, two_level };
inline constexpr ChainModel kChainModels[] = {ChainModel::full, ChainModel::first_mass, ChainModel::two_level};
const char* name_of(ChainModel model);

/// The system assembled from elements.
SecondOrderSystem chain_system(const ChainParameters& p, ChainModel model);

/// Transfer function by the formulas: eqs 6, 10 and 12 literally for three masses, else the forms above.
Complex chain_transfer(const ChainParameters& p, ChainModel model, Complex s);
double chain_static_gain(const ChainParameters& p, ChainModel model);  ///< [N/m]
/// Poles [rad/s], the two of each pair one after the other, eqs 7-9, 11 and 13.
std::vector<Complex> chain_poles(const ChainParameters& p, ChainModel model);

/// Errors of the element models against the formulas, the largest over all frequencies and poles.
struct ChainErrors {
  double transfer = 0, poles = 0;  ///< relative
};
ChainErrors chain_errors(const ChainParameters& p, ChainModel model, const std::vector<double>& frequencies_hz);

}  // namespace palpate
