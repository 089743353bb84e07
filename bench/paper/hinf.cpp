#include "bench/paper/hinf.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace palpate {
namespace {

/// Gain at a frequency, fast after one Schur form: A = U T U^H.
class Gain {
 public:
  explicit Gain(const StateSpace& system) : d0_(system.d0.cast<Complex>()) {
    if (system.states() == 0) return;
    const Eigen::ComplexSchur<Matrix> schur(system.a);
    t_ = schur.matrixT();
    b_ = schur.matrixU().adjoint() * system.b;
    c_ = system.c * schur.matrixU();
  }
  Eigen::VectorXcd poles() const { return t_.diagonal(); }
  double operator()(double omega) const {
    if (t_.size() == 0) return largest_singular_value(d0_);
    ComplexMatrix p = -t_;
    p.diagonal().array() += Complex(0, omega);
    return largest_singular_value(c_ * p.triangularView<Eigen::Upper>().solve(b_) + d0_);
  }

 private:
  ComplexMatrix t_, b_, c_, d0_;
};

void raise(PeakGain& peak, double norm, double omega) {
  if (norm > peak.norm) peak = {norm, omega};
}

/// Returns the frequencies at which `gamma` is a singular value, ascending; a few others may be among them.
std::vector<double> crossings(const StateSpace& y, double gamma) {
  const Eigen::Index n = y.states(), p = y.d0.cols();
  const Matrix r = gamma * gamma * Matrix::Identity(p, p) - y.d0.transpose() * y.d0;
  const Eigen::LDLT<Matrix> inverse(r);
  const Matrix a = y.a + y.b * inverse.solve(y.d0.transpose() * y.c);
  // Both off-diagonal blocks are scaled by gamma, which keeps them of similar size.
  Matrix h(2 * n, 2 * n);
  h.topLeftCorner(n, n) = a;
  h.topRightCorner(n, n) = gamma * y.b * inverse.solve(y.b.transpose());
  h.bottomLeftCorner(n, n) = -(y.c.transpose() * (y.c + y.d0 * inverse.solve(y.d0.transpose() * y.c))) / gamma;
  h.bottomRightCorner(n, n) = -a.transpose();
  const Eigen::VectorXcd values = h.eigenvalues();
  // Rounding moves a pair that is about to leave the axis by its square root, and those of a model beside the system that it
  // resembles further. A frequency too many costs one evaluation of the gain, one too few ends the search below the norm.
  constexpr double kOnAxis = 1e-4;
  std::vector<double> omega;
  for (const Complex& value : values)
    if (value.imag() >= 0 && std::abs(value.real()) <= kOnAxis * std::abs(value)) omega.push_back(value.imag());
  std::sort(omega.begin(), omega.end());
  return omega;
}

}  // namespace

double largest_singular_value(const ComplexMatrix& m) {
  return m.size() == 0 ? 0.0 : Eigen::JacobiSVD<ComplexMatrix>(m).singularValues()[0];
}

PeakGain hinf_norm(const StateSpace& system, double tolerance) {
  if (system.d1.size() > 0 && system.d1.norm() > 0)
    throw std::runtime_error("hinf_norm: the force grows with the frequency without limit; the norm is infinite");
  const Gain gain(system);
  PeakGain peak{largest_singular_value(system.d0.cast<Complex>()), std::numeric_limits<double>::infinity()};
  if (system.states() == 0) return peak;
  const Eigen::VectorXcd poles = gain.poles();
  if (!(poles.real().maxCoeff() < 0)) throw std::runtime_error("hinf_norm: a pole is not in the left half-plane");
  raise(peak, gain(0), 0);
  for (const Complex& pole : poles) raise(peak, gain(std::abs(pole)), std::abs(pole));
  for (const Complex& pole : poles) raise(peak, gain(std::abs(pole.imag())), std::abs(pole.imag()));
  if (peak.norm == 0) return peak;

  constexpr int kStepsMax = 40;
  for (int step = 0; step < kStepsMax; ++step) {
    const double gamma = peak.norm * (1 + tolerance);
    const std::vector<double> omega = crossings(system, gamma);
    PeakGain next = peak;
    for (std::size_t i = 0; i < omega.size(); ++i) {
      raise(next, gain(omega[i]), omega[i]);
      if (i + 1 == omega.size()) continue;
      const double middle = 0.5 * (omega[i] + omega[i + 1]);
      raise(next, gain(middle), middle);
    }
    const bool risen = next.norm > gamma;
    peak = next;
    if (!risen) break;
  }
  return peak;
}

StateSpace difference(const StateSpace& a, const StateSpace& b) {
  const Eigen::Index n = a.states(), m = b.states(), p = a.d0.cols();
  StateSpace d;
  d.a = Matrix::Zero(n + m, n + m);
  d.a.topLeftCorner(n, n) = a.a;
  d.a.bottomRightCorner(m, m) = b.a;
  d.b.resize(n + m, p);
  d.b << a.b, b.b;
  d.c.resize(a.c.rows(), n + m);
  d.c << a.c, -b.c;
  d.d0 = a.d0 - b.d0;
  d.d1 = a.d1 - b.d1;
  return d;
}

StateSpace proper(StateSpace system) {
  system.d1.setZero();
  return system;
}

PeakGain sampled_peak(const std::function<ComplexMatrix(Complex)>& transfer, double from_rad_s, double to_rad_s, int points) {
  const auto gain = [&](double omega) { return largest_singular_value(transfer(Complex(0, omega))); };
  PeakGain peak{gain(0), 0};
  const double ratio = std::pow(to_rad_s / from_rad_s, 1.0 / std::max(1, points - 1));
  for (int k = 0; k < points; ++k) {
    const double omega = from_rad_s * std::pow(ratio, k);
    raise(peak, gain(omega), omega);
  }
  if (peak.omega_rad_s == 0) return peak;
  constexpr int kSteps = 40;
  const double golden = 0.5 * (std::sqrt(5.0) - 1);
  double low = peak.omega_rad_s / ratio, high = peak.omega_rad_s * ratio;
  for (int k = 0; k < kSteps; ++k) {
    const double a = high - golden * (high - low), b = low + golden * (high - low);
    const double at_a = gain(a), at_b = gain(b);
    raise(peak, at_a, a);
    raise(peak, at_b, b);
    (at_a > at_b ? high : low) = at_a > at_b ? b : a;
  }
  return peak;
}

ReductionError reduction_error(const BalancedReduction& balanced, const StateSpace& reduced) {
  constexpr double kShare = 1e-3;
  ReductionError error;
  int order = balanced.stable_order(std::min(balanced.states(), static_cast<int>(reduced.states()) + 20));
  for (;;) {
    error.peak = hinf_norm(difference(balanced.truncated(order), reduced));
    error.uncertainty = balanced.error_bound(order);
    if (order == balanced.states() || error.uncertainty <= kShare * error.peak.norm) break;
    while (order < balanced.states() && balanced.error_bound(order) > kShare * error.peak.norm) ++order;
    order = balanced.stable_order(order);
  }
  error.relative = error.peak.norm / hinf_norm(proper(balanced.truncated(order))).norm;
  return error;
}

}  // namespace palpate
