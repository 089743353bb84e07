#include "server/reduce/cubic_basis.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <numeric>

#include "server/reduce/expansion.hpp"

namespace palpate {
namespace {

/// W^T P W.
Matrix energy_of(const Linearisation& at, const Matrix& w, double s) {
  Matrix p_w;
  at.multiply_sum(w, 1, s, p_w);
  p_w += s * s * at.masses().asDiagonal() * w;
  return w.transpose() * p_w;
}

/// The leading directions of W in the energy of P, and `fine` beside them, orthonormal in M.
CubicBasis compress(const Linearisation& at, const Matrix& w, std::span<const Vector> fine, double s, int modes) {
  const Matrix energy = energy_of(at, w, s);
  const Eigen::SelfAdjointEigenSolver<Matrix> eigen(0.5 * (energy + energy.transpose()));
  const Vector root = at.masses().cwiseSqrt();
  const double smallest = 1e-10 * eigen.eigenvalues().tail<1>()[0];
  const auto beside = std::min<Eigen::Index>(static_cast<Eigen::Index>(fine.size()), modes - 1);
  Eigen::Index r = std::min<Eigen::Index>(modes - beside, w.cols());
  while (r > 1 && !(eigen.eigenvalues()[w.cols() - r] > smallest)) --r;
  const Matrix leading = root.asDiagonal() * (w * eigen.eigenvectors().rightCols(r).rowwise().reverse());
  const Eigen::HouseholderQR<Matrix> qr(leading);
  Matrix directions = qr.householderQ() * Matrix::Identity(w.rows(), r);
  for (const Vector& shape : fine.first(static_cast<std::size_t>(beside))) {
    constexpr double kOfItsOwn = 1e-6;  // else the leading ones span it
    Vector x = root.cwiseProduct(shape);
    const double size = x.norm();
    for (int again = 0; again < 2; ++again) x -= directions * (directions.transpose() * x);
    if (!(x.norm() > kOfItsOwn * size)) continue;
    directions.conservativeResize(Eigen::NoChange, directions.cols() + 1);
    directions.rightCols<1>() = x.normalized();
  }
  CubicBasis basis;
  basis.shapes = root.cwiseInverse().asDiagonal() * directions;
  basis.coordinates = basis.shapes.transpose() * at.masses().asDiagonal() * w;
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
  std::vector<Vector> moments = moment_inputs(at, s, start.ports), bends;
  for (Vector& b : moments) b *= s;
  if (dents.empty()) bends = bending(at, start.ports, prescribed, request.bridge_s);
  memory.resize(moments.size() + bends.size());
  std::vector<SolveColumn> solves;
  add_those_that_matter(moments, memory.data(), solves);
  add_those_that_matter(bends, memory.data() + moments.size(), solves);
  if (!solve(solves)) return std::nullopt;

  std::vector<Vector> candidates = start.ports;
  Vector motion = request.bridge_s * at.velocity();
  mask(*at.held, motion);
  candidates.insert(candidates.end(), {motion, start.imbalance, s * start.motion});
  for (const SolveColumn& column : solves) candidates.push_back(*column.x);
  for (const auto& way : ways.colwise()) {
    candidates.emplace_back(way);
    mask(*at.held, candidates.back());
  }
  candidates.insert(candidates.end(), dents.begin(), dents.end());
  CubicBasis basis = compress(at, side_by_side(candidates), start.fine, s, request.modes);
  basis.dents = static_cast<int>(dents.size());
  return basis;
}

}  // namespace palpate
