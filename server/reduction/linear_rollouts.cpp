#include "server/reduction/linear_rollouts.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <cassert>

namespace palpate {
namespace {

constexpr int kRolloutSteps = 30;       // per tau; the error of the trapezoidal rule is then below that of the candidates
constexpr double kPushedM = 0.007;      // a typical press of a hand; 3 to 15 mm give the same within a decibel
constexpr Eigen::Index kFirstStep = 1;  // after the body's own motion

/// Trajectories side by side, one per column, under constant or growing loads.
class Trajectories {
 public:
  Trajectories(const Matrix& k, const Matrix& d, const RolloutLoads& loads, double tau_s)
      : k_(k), d_(d), step_s_(tau_s / kRolloutSteps) {
    const auto c = k.rows(), pushes = loads.port.cols(), n = kFirstStep + 2 * pushes + loads.slides.cols();
    constant_ = ramp_ = q_ = v_ = Matrix::Zero(c, n);
    v_.col(0) = loads.velocity;
    constant_.col(0) = loads.own + d * loads.velocity;
    constant_.middleCols(kFirstStep, pushes) = loads.port;
    ramp_.middleCols(kFirstStep + pushes, pushes) = loads.port;
    ramp_.rightCols(loads.slides.cols()) = loads.slides;
    factor_.compute(Matrix::Identity(c, c) + 0.5 * step_s_ * d + 0.25 * step_s_ * step_s_ * k);
    a_ = constant_ - d * v_;
  }
  void advance(int to_step) {
    const double share = static_cast<double>(to_step) / kRolloutSteps;
    q_ += step_s_ * v_ + 0.25 * step_s_ * step_s_ * a_;
    v_ += 0.5 * step_s_ * a_;
    a_ = factor_.solve(constant_ + share * ramp_ - d_ * v_ - k_ * q_);
    q_ += 0.25 * step_s_ * step_s_ * a_;
    v_ += 0.5 * step_s_ * a_;
  }
  const Matrix& q() const { return q_; }

 private:
  const Matrix &k_, &d_;
  double step_s_;
  Matrix constant_, ramp_, q_, v_, a_;
  Eigen::LLT<Matrix> factor_;
};

/// Returns the scale of each trajectory: pushes are scaled to kPushedM, the others are kept.
Vector scales(const Matrix& end, const RolloutLoads& loads) {
  Vector scale = Vector::Ones(end.cols());
  const auto pushes = loads.port.cols();
  for (Eigen::Index push = 0; push < pushes; ++push)
    for (const Eigen::Index first : {kFirstStep, kFirstStep + pushes}) {
      const double moved_m = loads.port.col(push).dot(end.col(first + push));
      scale[first + push] = moved_m > 0 ? std::min(kPushedM, loads.most_m[push]) / moved_m : 0;  // 0 if the body is fixed
    }
  return scale;
}

/// Returns the mean of q q^T over all steps.
Matrix covariance(const Matrix& k, const Matrix& d, const RolloutLoads& loads, double tau_s) {
  Trajectories all(k, d, loads, tau_s);
  std::vector<Matrix> states;
  for (int step = 1; step <= kRolloutSteps; ++step) {
    all.advance(step);
    states.push_back(all.q());
  }
  const Vector scale = scales(all.q(), loads);
  Matrix mean = Matrix::Zero(k.rows(), k.rows());
  for (const Matrix& q : states) {
    const Matrix scaled = q * scale.asDiagonal();
    mean += scaled * scaled.transpose() / kRolloutSteps;
  }
  return mean;
}

}  // namespace

Matrix dominant_directions(const Projection& on_candidates, const RolloutLoads& loads, double shift_1_s, Eigen::Index count) {
  const auto c = on_candidates.k.rows(), r = std::min(count, c);
  assert(shift_1_s > 0 && count > 0 && loads.port.rows() == c && loads.velocity.size() == c);
  const Eigen::SelfAdjointEigenSolver<Matrix> eigen(0.5 * (on_candidates.k + on_candidates.k.transpose()));
  const Matrix k = eigen.eigenvectors() * eigen.eigenvalues().cwiseAbs().asDiagonal() * eigen.eigenvectors().transpose();
  const Matrix d = 0.5 * (on_candidates.d + on_candidates.d.transpose());
  const Matrix moved = covariance(k, d, loads, 2 / shift_1_s);
  const Eigen::LLT<Matrix> energy(k + shift_1_s * d + shift_1_s * shift_1_s * Matrix::Identity(c, c));
  const Matrix l = energy.matrixL();
  const Eigen::SelfAdjointEigenSolver<Matrix> leading(l.transpose() * moved * l);
  Matrix y = leading.eigenvectors().rightCols(r).rowwise().reverse();
  energy.matrixU().solveInPlace(y);
  return Eigen::HouseholderQR<Matrix>(y).householderQ() * Matrix::Identity(c, r);
}

}  // namespace palpate
