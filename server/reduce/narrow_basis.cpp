#include "server/reduce/narrow_basis.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

constexpr double kSpeedUpM_s = 0.02;
constexpr double kOwnShare = 0.3;  // of free motion and residual force: the Krylov basis has more of them than of the rest
constexpr int kHorizonSteps = 24;  // of the prediction horizon; 100 change nothing

/// The wide system in the eigenvectors U of its stiffness.
struct SmallSystem {
  Matrix modes;       ///< W U
  Vector stiffness;   ///< as it is
  Vector energy;      ///< |stiffness|, nowhere next to nothing
  Matrix damping;     ///< U^T D U
  Matrix ports;       ///< one column each
  Vector load, rate;  ///< g and y'(0)
};

SmallSystem small_system(const Linearisation& at, const Matrix& wide, const std::vector<Vector>& ports, const Vector& residual) {
  Matrix k_w, d_w;
  at.multiply(wide, k_w, d_w);
  const Matrix k = wide.transpose() * k_w, d = wide.transpose() * d_w;
  const Eigen::SelfAdjointEigenSolver<Matrix> eigen(0.5 * (k + k.transpose()));
  const Matrix& u = eigen.eigenvectors();
  SmallSystem y;
  y.modes = wide * u;
  y.stiffness = eigen.eigenvalues();
  constexpr double kSoftest = 1e-6;
  y.energy = y.stiffness.cwiseAbs().cwiseMax(kSoftest * y.stiffness.cwiseAbs().maxCoeff());
  y.damping = 0.5 * u.transpose() * (d + d.transpose()) * u;
  y.ports.resize(wide.cols(), static_cast<Eigen::Index>(ports.size()));
  for (std::size_t k_port = 0; k_port < ports.size(); ++k_port)
    y.ports.col(static_cast<Eigen::Index>(k_port)) = y.modes.transpose() * ports[k_port];
  Vector motion = at.velocity();
  mask(*at.held, motion);
  y.rate = y.modes.transpose() * at.masses().cwiseProduct(motion);
  y.load = y.modes.transpose() * residual + y.damping * y.rate;
  return y;
}

/// y_j(t) by the trapezoidal rule, weighted; a block of columns for each step.
Matrix responses(const SmallSystem& y, double horizon_s) {
  const Eigen::Index n = y.load.size(), p = y.ports.cols(), inputs = p + 3;
  const double h = horizon_s / kHorizonSteps;
  Matrix step = 0.5 * h * y.damping;
  step.diagonal() += Vector::Ones(n) + 0.25 * h * h * y.energy;
  const Eigen::LLT<Matrix> solver(step);
  Matrix q = Matrix::Zero(n, inputs), v = q, u = q, all(n, kHorizonSteps * inputs);
  v.col(p) = v.col(p + 2) = kOwnShare * y.rate;
  u.col(p + 1) = u.col(p + 2) = kOwnShare * y.load;
  for (int k = 0; k < kHorizonSteps; ++k) {
    const double t = (k + 0.5) * h;
    u.leftCols(p) = 0.5 * kSpeedUpM_s / horizon_s * t * t * y.ports;
    const Matrix mean = solver.solve(v + 0.5 * h * (u - y.energy.asDiagonal() * q));
    q += h * mean;
    v = 2 * mean - v;
    all.middleCols(k * inputs, inputs) = std::sqrt((1 - (k + 1.0) / kHorizonSteps) / kHorizonSteps) * q;
  }
  return all;
}

/// Of the columns of x: the eigenvectors of x x^T, the largest first, without those that are rounding.
Matrix leading(const Matrix& x, Eigen::Index most) {
  const Eigen::SelfAdjointEigenSolver<Matrix> eigen(x * x.transpose());
  constexpr double kRounding = 1e-13;
  const Eigen::Index usable = (eigen.eigenvalues().array() > kRounding * eigen.eigenvalues().maxCoeff()).count();
  return eigen.eigenvectors().rightCols(std::min(usable, most)).rowwise().reverse();
}

}  // namespace

Matrix narrowed(const Linearisation& at, const Matrix& wide, const std::vector<Vector>& ports, const Vector& residual,
                const NarrowRequest& request) {
  if (wide.cols() <= request.modes) return wide;
  const SmallSystem y = small_system(at, wide, ports, residual);
  const double s = request.shift_1_s;
  Matrix p = s * y.damping;
  p.diagonal() += y.stiffness + Vector::Constant(y.load.size(), s * s);
  const Vector root = y.energy.cwiseSqrt();  // to coordinates in which the energy is the square
  const Matrix at_shift = leading(root.asDiagonal() * p.ldlt().solve(y.ports), request.modes);
  const Matrix rest = root.asDiagonal() * responses(y, request.horizon_s);
  const Matrix over_time = leading(rest - at_shift * (at_shift.transpose() * rest), request.modes - at_shift.cols());
  Matrix chosen(y.load.size(), at_shift.cols() + over_time.cols());
  chosen << at_shift, over_time;
  const Eigen::HouseholderQR<Matrix> qr(root.cwiseInverse().asDiagonal() * chosen);
  return y.modes * (qr.householderQ() * Matrix::Identity(chosen.rows(), chosen.cols()));
}

}  // namespace palpate
