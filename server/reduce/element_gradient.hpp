// A finite element of a body as its law sees it, tetrahedron, triangle or hexahedron: by one gradient F(y) = sum_i y_i b_i^T over
// its nodes, of any field y on the nodes; b_i [1/m] the gradients of its shape functions at rest, of a hexahedron in the mean
// (tetra_kernel.hpp, hexa_kernel.hpp). They sum to nothing.
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
/// The e-th of a body, which has elements_of() (local_body.hpp).
ElementGradient element_gradient(const Dynamics& dynamics, std::uint32_t e);
/// F of y, 3 N.
Mat3 mean_gradient(const Dynamics& dynamics, std::uint32_t e, const Eigen::Ref<const Vector>& y);

}  // namespace palpate
