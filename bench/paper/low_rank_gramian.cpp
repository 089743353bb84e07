#include "bench/paper/low_rank_gramian.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <cmath>
#include <stdexcept>

namespace palpate {
namespace {

/// Columns of displacements above columns of velocities.
struct Block {
  Matrix q, v;
};

Matrix energy_product(const SecondOrderSystem& y, const Block& a, const Block& b) {
  return a.q.transpose() * (y.stiffness * b.q) + a.v.transpose() * b.v;
}

/// Joins the columns and orthonormalises them in the energy; dependent ones are dropped.
Block orthonormal(const SecondOrderSystem& y, const std::vector<const Block*>& parts) {
  Eigen::Index columns = 0;
  for (const Block* b : parts) columns += b->q.cols();
  Block u{Matrix(y.size(), columns), Matrix(y.size(), columns)};
  columns = 0;
  for (const Block* b : parts) {
    u.q.middleCols(columns, b->q.cols()) = b->q;
    u.v.middleCols(columns, b->q.cols()) = b->v;
    columns += b->q.cols();
  }
  constexpr double kDependent = 1e-10;
  for (int pass = 0; pass < 2; ++pass) {
    const Vector scale = energy_product(y, u, u).diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
    u = {u.q * scale.asDiagonal(), u.v * scale.asDiagonal()};
    const Eigen::SelfAdjointEigenSolver<Matrix> gram(energy_product(y, u, u));
    const Eigen::Index keep = (gram.eigenvalues().array() > kDependent).count();
    const Matrix turn =
        gram.eigenvectors().rightCols(keep) * gram.eigenvalues().tail(keep).cwiseSqrt().cwiseInverse().asDiagonal();
    u = {u.q * turn, u.v * turn};
  }
  return u;
}

/// Returns s = -p of the ADI step that makes the projected W smallest; its imaginary part is never negative.
Complex next_shift(const SecondOrderSystem& y, const Block& w, const std::vector<Block>& recent) {
  std::vector<const Block*> parts{&w};
  for (const Block& b : recent) parts.push_back(&b);
  const Block u = orthonormal(y, parts);
  // H A = [[0, K], [-K, -D]]
  const Matrix k_v = u.q.transpose() * (y.stiffness * u.v);
  const Matrix t = k_v - k_v.transpose() - u.v.transpose() * (y.damping * u.v);
  const ComplexMatrix right = energy_product(y, u, w).cast<Complex>();
  const ComplexMatrix a = t.cast<Complex>(), one = ComplexMatrix::Identity(t.rows(), t.cols());
  const Eigen::VectorXcd ritz = t.eigenvalues();
  Complex best = 0;
  double least = 1e300;
  for (const Complex& value : ritz) {
    if (value.imag() < 0 || !(value.real() < 0)) continue;
    const Complex p = value;
    ComplexMatrix left = (a - std::conj(p) * one) * (a + p * one).partialPivLu().solve(right);
    if (p.imag() > 0) left = (a - p * one) * (a + std::conj(p) * one).partialPivLu().solve(left);
    // A pair costs no more than a real shift: it needs one factorisation.
    const double norm = left.norm();
    if (norm < least) {
      least = norm;
      best = -std::conj(p);
    }
  }
  return best;
}

bool is_real(Complex s) { return std::abs(s.imag()) < 1e-8 * std::abs(s); }

}  // namespace

SecondOrderSystem mass_scaled(const SecondOrderSystem& system) {
  SecondOrderSystem s = system;
  const Vector scale = system.mass.cwiseSqrt().cwiseInverse();
  s.mass = Vector::Ones(system.size());
  s.stiffness = scale.asDiagonal() * system.stiffness * scale.asDiagonal();
  s.damping = scale.asDiagonal() * system.damping * scale.asDiagonal();
  s.b_k = scale.asDiagonal() * system.b_k;
  s.b_d = scale.asDiagonal() * system.b_d;
  return s;
}

namespace {

/// State of the iteration: the residual factor W, and Z so far, one block of columns per step.
struct Iteration {
  const SecondOrderSystem& y;
  Block w;
  std::vector<Block> z, recent;

  explicit Iteration(const SecondOrderSystem& system) : y(system), w{y.b_d, y.b_k - y.damping * y.b_d} {}
  double lack() const { return energy_product(y, w, w).norm(); }
  void step(Complex s, const DynamicStiffness::At& at);
};

void Iteration::step(Complex s, const DynamicStiffness::At& at) {
  const ComplexMatrix x = at.solve(-(s * w.q + y.damping * w.q + w.v).cast<Complex>());
  const ComplexMatrix x_v = w.q + s * x;
  const Eigen::Index n = y.size(), p = y.ports();
  if (is_real(s)) {
    const double gamma = std::sqrt(2 * s.real());
    z.push_back({gamma * x.real(), gamma * x_v.real()});
    w.q += gamma * z.back().q;
    w.v += gamma * z.back().v;
  } else {
    const double gamma = 2 * std::sqrt(s.real()), delta = s.real() / s.imag(), beta = gamma * std::sqrt(delta * delta + 1);
    const Matrix sum_q = x.real() + delta * x.imag(), sum_v = x_v.real() + delta * x_v.imag();
    z.push_back({Matrix(n, 2 * p), Matrix(n, 2 * p)});
    z.back().q << gamma * sum_q, beta * x.imag();
    z.back().v << gamma * sum_v, beta * x_v.imag();
    w.q += gamma * gamma * sum_q;
    w.v += gamma * gamma * sum_v;
  }
  constexpr std::size_t kRecent = 3;
  if (recent.size() == kRecent) recent.erase(recent.begin());
  recent.push_back(z.back());
}

LowRankGramian joined(const SecondOrderSystem& y, const std::vector<Block>& z) {
  Eigen::Index columns = 0;
  for (const Block& b : z) columns += b.q.cols();
  LowRankGramian all;
  all.displacement.resize(y.size(), columns);
  all.velocity.resize(y.size(), columns);
  columns = 0;
  for (const Block& b : z) {
    all.displacement.middleCols(columns, b.q.cols()) = b.q;
    all.velocity.middleCols(columns, b.q.cols()) = b.v;
    columns += b.q.cols();
  }
  return all;
}

}  // namespace

LowRankGramian low_rank_gramian(const SecondOrderSystem& y, const BalanceOptions& options, ShiftMemory* memory) {
  Iteration adi(y);
  const double start = adi.lack();
  double residual = 1;
  int factorisations = 0;
  if (memory && !memory->empty()) {
    for (const auto& [s, at] : *memory) adi.step(s, at);
    residual = adi.lack() / start;
  } else {
    const DynamicStiffness dynamic(y.mass, y.damping, y.stiffness);
    const auto still = dynamic.at(0);
    ++factorisations;
    if (!(still.pivots().real().minCoeff() > 0))
      throw std::runtime_error("balance: the stiffness is not positive definite, so the system is not stable");
    // A^-1 B is in the first projection: the slow part of the response.
    adi.recent.push_back({still.solve((-(y.damping * adi.w.q) - adi.w.v).cast<Complex>()).real(), adi.w.q});
    Eigen::Index columns = 0;
    while (residual > options.residual && columns + 2 * y.ports() <= options.columns_max) {
      const Complex s = next_shift(y, adi.w, adi.recent);
      if (!(s.real() > 0)) throw std::runtime_error("balance: no stable shift is left; the system is not damped");
      const auto at = dynamic.at(s);
      ++factorisations;
      adi.step(s, at);
      if (memory) memory->emplace_back(s, at);
      columns += adi.z.back().q.cols();
      const double now = adi.lack() / start;
      constexpr double kRounding = 1e-3;
      if (!(now < (1 + kRounding) * residual)) throw std::runtime_error("balance: energy grows; the system is not stable");
      residual = now;
    }
  }
  LowRankGramian z = joined(y, adi.z);
  z.residual = residual;
  z.factorisations = factorisations;
  return z;
}

}  // namespace palpate
