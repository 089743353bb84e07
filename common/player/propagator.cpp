#include "common/player/propagator.hpp"

#include <Eigen/Cholesky>
#include <cassert>
#include <unsupported/Eigen/MatrixFunctions>

namespace palpate {

Propagator make_propagator(const ModeVector& stiffness, const ModeMatrix& damping, const ModeMatrix& added_mass, double dt_s) {
  const auto r = stiffness.size();
  assert(damping.rows() == r && dt_s > 0 && (added_mass.size() == 0 || added_mass.rows() == r));
  Propagator p;
  if (r == 0) return p;
  ModeMatrix inverse = ModeMatrix::Identity(r, r);  // inverse of the mass
  if (added_mass.size() > 0) inverse = ModeMatrix(inverse + added_mass).llt().solve(ModeMatrix::Identity(r, r));
  // In the time unit of a tick and with velocities in q per tick the matrix is well scaled.
  Eigen::MatrixXd m = Eigen::MatrixXd::Zero(4 * r, 4 * r);
  m.block(0, r, r, r).setIdentity();
  m.block(r, 0, r, r) = -dt_s * dt_s * inverse * stiffness.asDiagonal();
  m.block(r, r, r, r) = -dt_s * inverse * damping;
  m.block(r, 2 * r, r, r) = dt_s * dt_s * inverse;
  m.block(2 * r, 3 * r, r, r).setIdentity();
  const Eigen::MatrixXd e = m.exp();
  p.phi = e.topLeftCorner(2 * r, 2 * r);
  p.phi.topRightCorner(r, r) *= dt_s;
  p.phi.bottomLeftCorner(r, r) /= dt_s;
  p.psi0 = e.block(0, 2 * r, 2 * r, r);
  p.psi1 = e.block(0, 3 * r, 2 * r, r);
  p.psi0.bottomRows(r) /= dt_s;
  p.psi1.bottomRows(r) /= dt_s;
  return p;
}

}  // namespace palpate
