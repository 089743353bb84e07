// A body linearised around a state and held at one node (the port), as a linear second-order system:
//
//     M q'' + D q' + K q = B_k d + B_d d'
//     f = K_p d + D_p d' - B_k^T q - B_d^T q'
//     G(s) = F(s)/X(s) = K_p + s D_p - (B_k + s B_d)^T (s^2 M + s D + K)^-1 (B_k + s B_d)
//
// d displacement of the port [m], f the force with which the holder pushes [N] (without the inertia of the port node), q
// displacements of the n free coordinates [m]. The symmetric parts of the tangents are used, so M, D, K, K_p, D_p are symmetric.
//
// Coordinates without stiffness (the third axis of a planar body, those across a straight chain) are left out, of the body and of
// the port: p is 1 for a chain, 2 for a sheet, 3 for a solid. The transfer function has feed-through: G -> K_p + s D_p - B_d^T
// M^-1 B_d for s -> infinity; reductions work on the rest, which is strictly proper.
#pragma once

#include <cstdint>
#include <vector>

#include "bench/paper/dynamic_stiffness.hpp"
#include "server/body/dynamics.hpp"

namespace palpate {

struct SecondOrderSystem {
  Vector mass;                             ///< M, n entries [kg]
  SparseMatrix damping, stiffness;         ///< D, K, n x n, both triangles stored [N s/m], [N/m]
  Matrix b_k, b_d;                         ///< n x p [N/m], [N s/m]
  Matrix k_port, d_port;                   ///< p x p [N/m], [N s/m]
  std::vector<std::uint32_t> coordinates;  ///< index in the body, 3 node + axis, of each of the n rows
  std::vector<std::uint32_t> port_axes;    ///< 0 x, 1 y, 2 z, of each of the p ports

  Eigen::Index size() const { return mass.size(); }
  Eigen::Index ports() const { return b_k.cols(); }
};

/// `held`: nodes held still in addition to the fixed ones (1 = held; the port's own entry does not matter).
SecondOrderSystem second_order_system(const Dynamics& dynamics, const BodyState& state, std::uint32_t port_node,
                                      std::vector<std::uint8_t> held);

/// The body with only its fixed nodes (and `held`) held, under a force lambda at one of its points p = B^T x, B 3 N x 3:
/// M q'' + D q' + K q = B lambda. It is returned in the form above with B_k = B and the rest of the port 0, so that its G(s) is
/// minus the compliance at the point [m/N].
SecondOrderSystem pushed_system(const Dynamics& dynamics, const BodyState& state, const Matrix& b,
                                std::vector<std::uint8_t> held);

/// Galerkin projection q = V y, with the columns of V (n x r) in any scaling; the result has M = I and dense D, K.
SecondOrderSystem project(const SecondOrderSystem& system, const Matrix& v);

/// G(s), with one sparse factorisation per value; the pattern is analysed once. s must not be a pole. `system` must outlive it.
class TransferFunction {
 public:
  explicit TransferFunction(const SecondOrderSystem& system);
  ComplexMatrix operator()(Complex s) const;

 private:
  const SecondOrderSystem* system_;
  DynamicStiffness p_;
};

}  // namespace palpate
