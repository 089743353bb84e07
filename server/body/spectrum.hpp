// Bounds of the eigenvalues of a body's motion, for explicit integrators.
//
//     x'' = -M^-1 K x - M^-1 D x'
//
// w2 and g are the largest eigenvalues of M^-1 K and M^-1 D at rest (power iteration), times kStiffer or kSolidStiffer and
// kThicker as a margin for deformation; the margin is smaller for solids, whose integrators monitor the strains. A mode of
// frequency w has a damping between least_s w^2 and most_s w^2: for any motion y, y . D y lies between the least and the largest
// b / k of the springs, or t of the materials, times y . K y; that, too, with kThicker and kStiffer.
#pragma once

#include <utility>

#include "server/body/dynamics.hpp"

namespace palpate {

struct Spectrum {
  static constexpr double kStiffer = 1.5, kSolidStiffer = 1.2, kThicker = 1.2;
  double w2 = 0;                   ///< largest eigenvalue of M^-1 K [1/s^2]
  double g = 0;                    ///< largest eigenvalue of M^-1 D [1/s]
  double least_s = 0, most_s = 0;  ///< b / k [s]
};

/// Returns the least and the largest b / k of the springs or t of the materials [s].
std::pair<double, double> damping_times(const LumpedBody& body);
/// Returns the spectrum of a body of springs or of finite elements.
Spectrum spectrum_of(const Dynamics& dynamics);

}  // namespace palpate
