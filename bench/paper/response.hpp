// Frequency responses at a port, and the distance of a small model's response from the whole body's.
//
//     error(omega) = |G_r(j omega) - G(j omega)| / |G(j omega)|,   |.| the largest singular value of the p x p matrix
//
// so the error for the worst direction of motion is compared with the largest force of the body at that frequency: an entry that
// is zero by symmetry (normal against tangential) does not count as infinitely wrong. G is the force over the displacement,
// feed-through included [N/m].
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "bench/paper/hinf.hpp"

namespace palpate {

using Transfer = std::function<ComplexMatrix(Complex)>;

/// G at s = 2 pi i f.
struct Response {
  std::vector<double> frequency_hz;
  std::vector<ComplexMatrix> value;
};

/// Frequencies from `from_hz` to `to_hz`, both included, in `per_decade` logarithmic steps (rounded up to a whole number of
/// steps).
std::vector<double> log_frequencies(double from_hz, double to_hz, int per_decade);
Response sample(const Transfer& transfer, std::span<const double> frequencies_hz);

/// error(omega) of `small` against `full`, on the same frequencies.
std::vector<double> relative_error(const Response& small, const Response& full);
/// Largest entry of `error` between two frequencies, both included.
double worst_in_band(std::span<const double> frequencies_hz, std::span<const double> error, double from_hz, double to_hz);

}  // namespace palpate
