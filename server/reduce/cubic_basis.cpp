#include "server/reduce/cubic_basis.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>

#include "server/reduce/expansion.hpp"

namespace palpate {
namespace {

/// Grows the list of candidates; remembers whether every solve went well.
class Candidates {
 public:
  Candidates(const Linearisation& at, ShiftedSolver& solver, double tolerance, BasisMemory& memory)
      : at_(at), solver_(solver), tolerance_(tolerance), memory_(memory) {}

  /// The answers to these, side by side.
  void solve(const std::vector<Vector>& inputs) {
    memory_.resize(inputs.size());
    std::vector<SolveColumn> columns;
    for (std::size_t k = 0; k < inputs.size(); ++k) columns.push_back({&inputs[k], &memory_[k]});
    definite_ = definite_ && solver_.solve(at_, columns, tolerance_);
    for (const Vector& x : memory_) add(x);
  }
  void add(const Vector& w) { columns_.push_back(w); }
  bool definite() const { return definite_; }
  Matrix take() const {
    Matrix w(columns_.front().size(), static_cast<Eigen::Index>(columns_.size()));
    for (std::size_t c = 0; c < columns_.size(); ++c) w.col(static_cast<Eigen::Index>(c)) = columns_[c];
    return w;
  }

 private:
  const Linearisation& at_;
  ShiftedSolver& solver_;
  double tolerance_;
  BasisMemory& memory_;
  std::vector<Vector> columns_;
  bool definite_ = true;
};

/// The leading directions of W in the energy of P, orthonormal in M.
CubicBasis compress(const Linearisation& at, const ShiftedSolver& solver, const Matrix& w, int modes) {
  const Matrix energy = w.transpose() * solver.multiply(w);
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

std::optional<CubicBasis> cubic_basis(const Linearisation& at, ShiftedSolver& solver, const std::vector<Vector>& ports,
                                      const Matrix& prescribed, const Vector& imbalance, const ShapeHistory& history,
                                      const CubicBasisRequest& request, BasisMemory& memory) {
  const Vector& masses = at.dynamics->masses();
  const double s = request.shift_1_s;
  Candidates candidates(at, solver, request.tolerance, memory);
  Vector motion = at.state->v;
  mask(*at.held, motion);

  // What acts together, to second order: the port's three shapes and the body's own motion.
  Matrix acting(masses.size(), static_cast<Eigen::Index>(ports.size()) + 1);
  for (std::size_t i = 0; i < ports.size(); ++i)
    acting.col(static_cast<Eigen::Index>(i)) = ports[i] + prescribed.col(static_cast<Eigen::Index>(i));
  acting.rightCols<1>() = request.bridge_s * at.state->v;

  for (const Vector& x : ports) candidates.add(x);
  candidates.add(request.bridge_s * motion);
  std::vector<Vector> inputs{imbalance, s * masses.cwiseProduct(motion)};
  for (const Vector& b : moment_inputs(at, s, ports)) inputs.push_back(s * b);
  for (Vector& f : second_order_forces(*at.dynamics, *at.state, acting)) inputs.push_back(std::move(f));
  candidates.solve(inputs);
  for (const BodyState& before : history.states()) {
    Vector shape = before.x - at.state->x;
    mask(*at.held, shape);
    candidates.add(shape);
  }
  if (!candidates.definite()) return std::nullopt;
  return compress(at, solver, candidates.take(), request.modes);
}

}  // namespace palpate
