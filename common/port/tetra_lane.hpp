// Matrices in single precision, one in every lane of a vector register: for tetrahedra in the player.
//
// For 3x3 matrices A, B: a[3 i + j][l] is A_ij of lane l. inner: A : B = sum_ij A_ij B_ij; sum: A + B; transposed_product: A^T B,
// each lane by itself. Eight wide on every machine.
#pragma once

#include <Eigen/Core>
#include <array>

namespace palpate {

inline constexpr int kTetraLane = 8;  ///< floats of a vector register of 256 bits
using TetraLane = Eigen::Array<float, kTetraLane, 1>;
using TetraLanes = std::array<TetraLane, 9>;  ///< a matrix, row by row

inline TetraLane inner(const TetraLanes& a, const TetraLanes& b) {
  TetraLane sum = a[0] * b[0];
  for (std::size_t i = 1; i < 9; ++i) sum += a[i] * b[i];
  return sum;
}
inline TetraLanes sum(const TetraLanes& a, const TetraLanes& b) {
  TetraLanes c;
  for (std::size_t i = 0; i < 9; ++i) c[i] = a[i] + b[i];
  return c;
}
/// A^T B
inline TetraLanes transposed_product(const TetraLanes& a, const TetraLanes& b) {
  TetraLanes c;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) c[3 * i + j] = a[i] * b[j] + a[3 + i] * b[3 + j] + a[6 + i] * b[6 + j];
  return c;
}

}  // namespace palpate
