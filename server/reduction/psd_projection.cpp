#include "server/reduction/psd_projection.hpp"

#include <Eigen/Eigenvalues>
#include <cassert>
#include <cmath>

#include "common/patch/nonlinear_terms.hpp"

namespace palpate {
namespace {

using Joint = Eigen::MatrixXd;

/// Rotates to modes q = U q~ that make `k` diagonal; the port's b_k is already that of `k`.
Joint turn_modes(Patch& p, const Joint& k) {
  assert(k.rows() == p.modes() && k.cols() == p.modes());
  const Eigen::SelfAdjointEigenSolver<Joint> eigen(k);
  const Joint& u = eigen.eigenvectors();
  p.stiffness = eigen.eigenvalues().cwiseMax(0.0);
  const Joint d = u.transpose() * p.damping * u;
  p.damping = 0.5 * (d + d.transpose());
  p.b_k = (u.transpose() * p.b_k).eval();
  p.b_d = (u.transpose() * p.b_d).eval();
  p.g = (u.transpose() * p.g).eval();
  p.q_rate = (u.transpose() * p.q_rate).eval();
  if (p.load_rate.size() > 0) p.load_rate = (u.transpose() * p.load_rate).eval();
  for (PatchBranch& branch : p.fading.branches())
    branch.pull.tail(p.modes()) = (u.transpose() * branch.pull.tail(p.modes())).eval();
  return u;
}

}  // namespace

double project_grasp(Patch& patch, double node_mass_kg, Eigen::MatrixXd* rotation) {
  assert(node_mass_kg > 0 && patch.contact == ContactKind::attach);
  const double scale = std::sqrt(node_mass_kg);
  const auto r = patch.modes();
  if (rotation) rotation->setIdentity(r, r);
  Joint joint = joint_stiffness(patch, patch.stiffness);
  joint.topRows<3>() /= scale;
  joint.leftCols<3>() /= scale;
  if (!joint.allFinite()) return 0;
  assert(joint.isApprox(joint.transpose(), 1e-9));
  const Eigen::SelfAdjointEigenSolver<Joint> eigen(joint);
  constexpr double kEigenvalueRounding = 1e-12;  // of the largest: the eigensolver is accurate to some 1e-16 times 19 rows
  if (eigen.info() != Eigen::Success || eigen.eigenvalues()[0] >= -kEigenvalueRounding * eigen.eigenvalues()[r + 2]) return 0;
  const Joint projected =
      eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0.0).asDiagonal() * eigen.eigenvectors().transpose();
  const Mat3 k_port = scale * scale * projected.topLeftCorner<3, 3>();
  patch.k_port = 0.5 * (k_port + k_port.transpose());
  if (r > 0) {
    patch.b_k = -scale * projected.bottomLeftCorner(r, 3);
    const Joint u = turn_modes(patch, projected.bottomRightCorner(r, r));
    if (rotation) *rotation = u;
  }
  return -eigen.eigenvalues()[0];
}

}  // namespace palpate
