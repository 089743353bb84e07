// A finite element of a body as its law uses it, tetrahedron, triangle or hexahedron: one gradient F(y) = sum_i y_i b_i^T over
// its nodes, for any nodal field y; b_i [1/m] the gradients of its shape functions at rest, averaged over a hexahedron
// (element_shape.hpp). The b_i sum to zero.
#pragma once

#include <span>

#include "server/body/dynamics.hpp"

namespace palpate {

struct ElementGradient {
  std::span<const std::uint32_t> nodes;
  Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, 8> b;
  double volume_m3;
  std::uint32_t material;
};
/// Returns element e of a body, which has elements_of() (local_body.hpp).
ElementGradient element_gradient(const Dynamics& dynamics, std::uint32_t e);
/// Returns F of the nodal field y, 3 N.
Mat3 mean_gradient(const Dynamics& dynamics, std::uint32_t e, const Eigen::Ref<const Vector>& y);

}  // namespace palpate
