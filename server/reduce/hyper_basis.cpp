#include "server/reduce/hyper_basis.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "server/reduce/bending.hpp"

namespace palpate {
namespace {

/// W^T M W, W^T K W and W^T D W.
struct Grams {
  Matrix m, k, d;
};

/// W^T [M W, K W, D W] for W, K W and D W in two parts, `ports` and `rest`, one after the other in `w`.
Grams grams(const Vector& masses, const Matrix& w, const Projection& on_ports, const Projection& on_rest) {
  const Eigen::Index first = on_ports.k.cols(), others = on_rest.k.cols();
  const auto whole = [&](const Matrix& of_ports, const Matrix& of_rest) {
    Matrix gram(w.cols(), w.cols());
    gram.rightCols(others).noalias() = w.transpose() * of_rest;
    gram.topLeftCorner(first, first).noalias() = w.leftCols(first).transpose() * of_ports;
    gram.bottomLeftCorner(others, first) = gram.topRightCorner(first, others).transpose();
    return gram;
  };
  return {w.transpose() * (masses.asDiagonal() * w), whole(on_ports.k, on_rest.k), whole(on_ports.d, on_rest.d)};
}

/// The leading directions of W in the energy of P, and those columns of W that come `beside` them, its last, orthonormal in M.
HyperBasis compress(const Vector& masses, const Matrix& w, const Grams& all, Eigen::Index beside, double s, int modes) {
  const Eigen::Index count = w.cols() - beside;
  const Matrix energy = (all.k + s * all.d + s * s * all.m).topLeftCorner(count, count);
  const Eigen::SelfAdjointEigenSolver<Matrix> eigen(energy);
  const double smallest = std::max(0.0, 1e-10 * eigen.eigenvalues().tail<1>()[0]);
  Eigen::Index r = std::min<Eigen::Index>(modes - beside, count);
  while (r > 0 && !(eigen.eigenvalues()[count - r] > smallest)) --r;  // none where nothing moves
  // Of energy 1 each, which leaves their products of masses well conditioned: between one over the square of the body's highest
  // frequency and 1/s^2.
  Matrix made = Matrix::Zero(w.cols(), r);  // directions of columns
  made.topRows(count) = eigen.eigenvectors().rightCols(r).rowwise().reverse() *
                        eigen.eigenvalues().tail(r).reverse().cwiseSqrt().cwiseInverse().asDiagonal();
  Matrix directions = w.leftCols(count) * made.topRows(count);
  if (r > 0) {
    const Eigen::LLT<Matrix> factor(directions.transpose() * (masses.asDiagonal() * directions));
    factor.matrixU().solveInPlace<Eigen::OnTheRight>(directions);
    factor.matrixU().solveInPlace<Eigen::OnTheRight>(made);
  }
  for (Eigen::Index k = count; k < w.cols(); ++k) {
    constexpr double kIndependentShare = 1e-6;  // else the leading ones span it
    Vector x = w.col(k), of_columns = Vector::Unit(w.cols(), k);
    const auto length = [&] { return std::sqrt(x.dot(masses.cwiseProduct(x))); };
    const double before = length();
    for (int again = 0; again < 2; ++again) {
      const Vector along = directions.transpose() * masses.cwiseProduct(x);
      x -= directions * along;
      of_columns -= made * along;
    }
    const double left = length();
    if (!(left > kIndependentShare * before)) continue;
    for (auto& [to, column] : {std::pair{&directions, &x}, std::pair{&made, &of_columns}}) {
      to->conservativeResize(Eigen::NoChange, to->cols() + 1);
      to->rightCols<1>() = *column / left;
    }
  }
  HyperBasis basis;
  basis.coordinates = made.transpose() * all.m.leftCols(count);
  basis.at_shapes = {made.transpose() * all.k * made, made.transpose() * all.d * made};
  basis.shapes = std::move(directions);
  return basis;
}

constexpr double kNegligibleLoads = 0.03;  // of the loads' squares
constexpr double kSecondOrderLooser = 3;   // what is of second order is needed less exactly than the port responses

/// Loads but the smallest, whose squares are together no more than kNegligibleLoads of those of all.
void add_those_that_matter(const std::vector<Vector>& loads, Vector* responses, std::vector<SolveColumn>& columns) {
  std::vector<double> squares;
  for (const Vector& b : loads) squares.push_back(b.squaredNorm());
  std::vector<std::size_t> order(loads.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t i, std::size_t j) { return squares[i] < squares[j]; });
  const double all = std::accumulate(squares.begin(), squares.end(), 0.0);
  double left_out = 0;
  for (const std::size_t k : order)
    if ((left_out += squares[k]) > kNegligibleLoads * all) columns.push_back({&loads[k], &responses[k], kSecondOrderLooser});
}

/// Second-order forces of what acts together: the port's shapes and the body's own motion.
std::vector<Vector> bending(const Linearisation& at, std::span<const Vector> ports, const Matrix& prescribed, double horizon_s) {
  std::vector<Vector> acting(ports.begin(), ports.end());
  for (Eigen::Index i = 0; i < prescribed.cols(); ++i) acting[static_cast<std::size_t>(i)] += prescribed.col(i);
  acting.push_back(horizon_s * at.velocity());
  const Linearisation part = at.bending();
  std::vector<Vector> forces = second_order_forces(*part.dynamics, *part.state, at.moved(side_by_side(acting)));
  for (Vector& f : forces) f = at.gathered(f);
  return forces;
}

}  // namespace

std::optional<HyperBasis> hyper_basis(const Linearisation& at, const KrylovStart& start, const KrylovSolve& solve,
                                      const Matrix& prescribed, std::span<const Vector> indentations, const Matrix& snapshots,
                                      const HyperBasisRequest& request, BasisMemory& memory) {
  const double s = request.shift_1_s;
  const Matrix ports = side_by_side(start.ports);
  Matrix k_ports, d_ports;
  at.multiply(ports, k_ports, d_ports);
  std::vector<Vector> moments, bends;
  for (Eigen::Index k = 0; k < ports.cols(); ++k)
    moments.emplace_back(s * (2 * s * at.masses().cwiseProduct(ports.col(k)) + d_ports.col(k)));
  if (indentations.empty()) bends = bending(at, start.ports, prescribed, request.horizon_s);
  memory.resize(moments.size() + bends.size());
  std::vector<SolveColumn> solves;
  add_those_that_matter(moments, memory.data(), solves);
  add_those_that_matter(bends, memory.data() + moments.size(), solves);
  if (!solve(solves)) return std::nullopt;

  Vector motion = request.horizon_s * at.velocity();
  mask(*at.held, motion);
  std::vector<Vector> others{motion, start.residual, s * start.motion};
  for (const SolveColumn& column : solves) others.push_back(*column.x);
  for (const auto& snapshot : snapshots.colwise()) {
    others.emplace_back(snapshot);
    mask(*at.held, others.back());
  }
  others.insert(others.end(), indentations.begin(), indentations.end());
  const auto beside = std::min<std::size_t>(start.fine.size(), static_cast<std::size_t>(request.modes - 1));
  others.insert(others.end(), start.fine.begin(), start.fine.begin() + static_cast<std::ptrdiff_t>(beside));
  const Matrix rest = side_by_side(others);
  Matrix k_rest, d_rest, w(ports.rows(), ports.cols() + rest.cols());
  at.multiply(rest, k_rest, d_rest);
  w << ports, rest;
  HyperBasis basis = compress(
      at.masses(), w, grams(at.masses(), w, {std::move(k_ports), std::move(d_ports)}, {std::move(k_rest), std::move(d_rest)}),
      static_cast<Eigen::Index>(beside), s, request.modes);
  basis.indentations = static_cast<int>(indentations.size());
  return basis;
}

}  // namespace palpate
