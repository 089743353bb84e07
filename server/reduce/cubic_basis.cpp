#include "server/reduce/cubic_basis.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>

#include "server/reduce/expansion.hpp"

namespace palpate {
namespace {

Matrix side_by_side(const std::vector<Vector>& columns) {
  Matrix w(columns.front().size(), static_cast<Eigen::Index>(columns.size()));
  for (std::size_t c = 0; c < columns.size(); ++c) w.col(static_cast<Eigen::Index>(c)) = columns[c];
  return w;
}

/// W^T P W.
Matrix energy_of(const Linearisation& at, const Matrix& w, double s) {
  Matrix p_w, d_w;
  at.tangents->multiply(w, p_w, d_w);
  p_w += s * d_w + s * s * at.dynamics->masses().asDiagonal() * w;
  return w.transpose() * p_w;
}

/// The leading directions of W in the energy of P, orthonormal in M.
CubicBasis compress(const Linearisation& at, const Matrix& w, double s, int modes) {
  const Matrix energy = energy_of(at, w, s);
  const Eigen::SelfAdjointEigenSolver<Matrix> eigen(0.5 * (energy + energy.transpose()));
  const Vector root = at.dynamics->masses().cwiseSqrt();
  const double smallest = 1e-10 * eigen.eigenvalues().tail<1>()[0];
  Eigen::Index r = std::min<Eigen::Index>(modes, w.cols());
  while (r > 1 && !(eigen.eigenvalues()[w.cols() - r] > smallest)) --r;
  const Matrix leading = root.asDiagonal() * (w * eigen.eigenvectors().rightCols(r).rowwise().reverse());
  const Eigen::HouseholderQR<Matrix> qr(leading);
  CubicBasis basis;
  basis.shapes = root.cwiseInverse().asDiagonal() * Matrix(qr.householderQ() * Matrix::Identity(w.rows(), r));
  basis.coordinates = basis.shapes.transpose() * at.dynamics->masses().asDiagonal() * w;
  return basis;
}

}  // namespace

void ShapeHistory::add(const BodyState& state) {
  if (!states_.empty() && state.time_s - states_.back().time_s < kApartS) return;
  if (states_.size() == kShapes) states_.pop_front();
  states_.push_back(state);
}

std::optional<CubicBasis> cubic_basis(const Linearisation& at, const KrylovStart& start, const KrylovSolve& solve,
                                      const Matrix& prescribed, const ShapeHistory& history, const CubicBasisRequest& request,
                                      BasisMemory& memory) {
  const double s = request.shift_1_s;
  // What acts together, to second order: the port's three shapes and the body's own motion.
  std::vector<Vector> acting = start.ports;
  for (Eigen::Index i = 0; i < prescribed.cols(); ++i) acting[static_cast<std::size_t>(i)] += prescribed.col(i);
  acting.push_back(request.bridge_s * at.state->v);

  std::vector<Vector> inputs;
  for (const Vector& b : moment_inputs(at, s, start.ports)) inputs.push_back(s * b);
  for (Vector& f : second_order_forces(*at.dynamics, *at.state, side_by_side(acting))) inputs.push_back(std::move(f));
  // Of unit size, so that the answers of the frame before are a first guess whatever the tool's speed has become.
  std::vector<double> sizes;
  for (Vector& b : inputs) {
    sizes.push_back(b.norm());
    if (sizes.back() > 0) b /= sizes.back();
  }
  memory.resize(inputs.size());
  std::vector<SolveColumn> solves;
  for (std::size_t k = 0; k < inputs.size(); ++k) solves.push_back({&inputs[k], &memory[k]});
  if (!solve(solves)) return std::nullopt;

  std::vector<Vector> candidates = start.ports;
  Vector motion = request.bridge_s * at.state->v;
  mask(*at.held, motion);
  candidates.insert(candidates.end(), {motion, start.imbalance, s * start.motion});
  for (std::size_t k = 0; k < inputs.size(); ++k) candidates.push_back(sizes[k] * memory[k]);
  for (const BodyState& before : history.states()) {
    candidates.push_back(before.x - at.state->x);
    mask(*at.held, candidates.back());
  }
  return compress(at, side_by_side(candidates), s, request.modes);
}

}  // namespace palpate
