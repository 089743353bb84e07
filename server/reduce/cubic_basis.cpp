#include "server/reduce/cubic_basis.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <numeric>

#include "server/reduce/expansion.hpp"

namespace palpate {
namespace {

/// W^T Y for W and Y in two parts, one after the other.
Matrix gram(const Matrix& w_1, const Matrix& w_2, const Matrix& y_1, const Matrix& y_2) {
  const Eigen::Index first = w_1.cols();
  Matrix g(first + w_2.cols(), first + w_2.cols());
  g.topLeftCorner(first, first).noalias() = w_1.transpose() * y_1;
  g.bottomLeftCorner(w_2.cols(), first).noalias() = w_2.transpose() * y_1;
  g.bottomRightCorner(w_2.cols(), w_2.cols()).noalias() = w_2.transpose() * y_2;
  g.topRightCorner(first, w_2.cols()) = g.bottomLeftCorner(w_2.cols(), first).transpose();
  return g;
}

/// The leading directions of W in the energy of P, and those columns of W that come `beside` them, its last, orthonormal in M.
/// `all`: K and D on W.
CubicBasis compress(const Vector& masses, Matrix w, const Projection& all, Eigen::Index beside, double s, int modes) {
  const Vector root = masses.cwiseSqrt();
  w = root.asDiagonal() * w;
  const Eigen::Index count = w.cols() - beside;
  const auto candidates = w.leftCols(count);
  const Matrix energy = (all.k + s * all.d).topLeftCorner(count, count) + s * s * Matrix(candidates.transpose() * candidates);
  const Eigen::SelfAdjointEigenSolver<Matrix> eigen(energy);
  const double smallest = 1e-10 * eigen.eigenvalues().tail<1>()[0];
  Eigen::Index r = std::min<Eigen::Index>(modes - beside, count);
  while (r > 1 && !(eigen.eigenvalues()[count - r] > smallest)) --r;
  const Matrix leading = eigen.eigenvectors().rightCols(r).rowwise().reverse();
  const Eigen::HouseholderQR<Matrix> qr(candidates * leading);
  Matrix directions = qr.householderQ() * Matrix::Identity(w.rows(), r);
  Matrix made = Matrix::Zero(w.cols(), r);  // directions of columns
  made.topRows(count) =
      qr.matrixQR().topRows(r).triangularView<Eigen::Upper>().transpose().solve(leading.transpose()).transpose();
  for (Eigen::Index k = count; k < w.cols(); ++k) {
    constexpr double kOfItsOwn = 1e-6;  // else the leading ones span it
    Vector x = w.col(k), of_columns = Vector::Unit(w.cols(), k);
    for (int again = 0; again < 2; ++again) {
      const Vector along = directions.transpose() * x;
      x -= directions * along;
      of_columns -= made * along;
    }
    const double left = x.norm();
    if (!(left > kOfItsOwn * w.col(k).norm())) continue;
    for (auto& [to, column] : {std::pair{&directions, &x}, std::pair{&made, &of_columns}}) {
      to->conservativeResize(Eigen::NoChange, to->cols() + 1);
      to->rightCols<1>() = *column / left;
    }
  }
  CubicBasis basis;
  basis.shapes = root.cwiseInverse().asDiagonal() * directions;
  basis.coordinates = directions.transpose() * candidates;
  basis.at_shapes = {made.transpose() * all.k * made, made.transpose() * all.d * made};
  return basis;
}

constexpr double kNegligible = 0.03;  // of the loads' squares

/// Loads but the smallest, whose squares are together no more than kNegligible of those of all.
void add_those_that_matter(const std::vector<Vector>& loads, Vector* answers, std::vector<SolveColumn>& columns) {
  std::vector<double> squares;
  for (const Vector& b : loads) squares.push_back(b.squaredNorm());
  std::vector<std::size_t> order(loads.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t i, std::size_t j) { return squares[i] < squares[j]; });
  const double all = std::accumulate(squares.begin(), squares.end(), 0.0);
  double left_out = 0;
  for (const std::size_t k : order)
    if ((left_out += squares[k]) > kNegligible * all) columns.push_back({&loads[k], &answers[k]});
}

/// Second-order forces of what acts together: the port's shapes and the body's own motion.
std::vector<Vector> bending(const Linearisation& at, std::span<const Vector> ports, const Matrix& prescribed, double bridge_s) {
  std::vector<Vector> acting(ports.begin(), ports.end());
  for (Eigen::Index i = 0; i < prescribed.cols(); ++i) acting[static_cast<std::size_t>(i)] += prescribed.col(i);
  acting.push_back(bridge_s * at.velocity());
  const Linearisation part = at.bending();
  std::vector<Vector> forces = second_order_forces(*part.dynamics, *part.state, at.moved(side_by_side(acting)));
  for (Vector& f : forces) f = at.gathered(f);
  return forces;
}

}  // namespace

std::optional<CubicBasis> cubic_basis(const Linearisation& at, const KrylovStart& start, const KrylovSolve& solve,
                                      const Matrix& prescribed, std::span<const Vector> dents, const Matrix& ways,
                                      const CubicBasisRequest& request, BasisMemory& memory) {
  const double s = request.shift_1_s;
  const Matrix ports = side_by_side(start.ports);
  Matrix k_ports, d_ports;
  at.multiply(ports, k_ports, d_ports);
  std::vector<Vector> moments, bends;
  for (Eigen::Index k = 0; k < ports.cols(); ++k)
    moments.emplace_back(s * (2 * s * at.masses().cwiseProduct(ports.col(k)) + d_ports.col(k)));
  if (dents.empty()) bends = bending(at, start.ports, prescribed, request.bridge_s);
  memory.resize(moments.size() + bends.size());
  std::vector<SolveColumn> solves;
  add_those_that_matter(moments, memory.data(), solves);
  add_those_that_matter(bends, memory.data() + moments.size(), solves);
  if (!solve(solves)) return std::nullopt;

  Vector motion = request.bridge_s * at.velocity();
  mask(*at.held, motion);
  std::vector<Vector> others{motion, start.imbalance, s * start.motion};
  for (const SolveColumn& column : solves) others.push_back(*column.x);
  for (const auto& way : ways.colwise()) {
    others.emplace_back(way);
    mask(*at.held, others.back());
  }
  others.insert(others.end(), dents.begin(), dents.end());
  const auto beside = std::min<std::size_t>(start.fine.size(), static_cast<std::size_t>(request.modes - 1));
  others.insert(others.end(), start.fine.begin(), start.fine.begin() + static_cast<std::ptrdiff_t>(beside));
  const Matrix rest = side_by_side(others);
  Matrix k_rest, d_rest, w(ports.rows(), ports.cols() + rest.cols());
  at.multiply(rest, k_rest, d_rest);
  w << ports, rest;
  CubicBasis basis = compress(at.masses(), std::move(w), {gram(ports, rest, k_ports, k_rest), gram(ports, rest, d_ports, d_rest)},
                              static_cast<Eigen::Index>(beside), s, request.modes);
  basis.dents = static_cast<int>(dents.size());
  return basis;
}

}  // namespace palpate
