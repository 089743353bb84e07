// A basis V for a local model: rational Krylov directions at the port, orthonormal in the mass matrix (V^T M V = I).
//
// With P = s^2 M + s D + K at the state (x*, v*), the directions are, in order of importance,
//     P^-1 B,  v*,  P^-1 F*,  P^-1 M v*,   then their next moments  X <- P^-1 (2 s M + D) X
// which match the response of the whole body to the port, to its own residual force and to its own motion around the frequency s,
// twice the reciprocal of the prediction horizon (shift_for() in frame_model.hpp). Nearly dependent directions are dropped.
// Source: rational Krylov (moment matching) for second-order systems, Bai and Su, SIAM J. Sci. Comput. 26 (2005).
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "server/body/batch_cg.hpp"
#include "server/operators/nonlinear_subdomain.hpp"
#include "server/solve/linear_solver.hpp"

namespace palpate {

/// K and D projected onto the columns of a V: V^T K V and V^T D V.
struct Projection {
  Matrix k, d;
};

/// Operators and constraints of a linearised model.
struct Linearisation {
  const BodyOperator* body = nullptr;               ///< M, K and D
  const std::vector<std::uint8_t>* held = nullptr;  ///< coordinates that the model keeps still
  const WholeBody* part = nullptr;                  ///< with forces beyond their tangents: all, or the part near the tool
  const NonlinearSubdomain* subdomain = nullptr;    ///< motion of that part; null: it is the whole body
  CoarseSpace* coarse = nullptr;                    ///< for iterative solves; null: none
  std::span<const CoarseSpace::Node> pieces = {};   ///< piece in it of each coordinate

  Linearisation() = default;
  Linearisation(const WholeBody& whole, const std::vector<std::uint8_t>& still) : body(&whole), held(&still), part(&whole) {}

  const Vector& masses() const { return body->masses(); }
  const Vector& velocity() const { return body->velocity(); }
  /// Returns v with zeros at held nodes.
  Vector free_velocity() const {
    Vector v = velocity();
    mask(*held, v);
    return v;
  }
  /// Returns M v with zeros at held nodes.
  Vector free_momentum() const { return masses().cwiseProduct(free_velocity()); }
  Projection projected(const Matrix& v) const {
    Matrix k_v, d_v;
    body->multiply(v, k_v, d_v);
    return {v.transpose() * k_v, v.transpose() * d_v};
  }
  /// Return the motion of the part's nodes, and the loads on the coordinates from forces on these nodes.
  Matrix moved(Matrix y) const { return subdomain ? subdomain->moved(y) : std::move(y); }
  Vector gathered(Vector forces) const { return subdomain ? subdomain->gathered(forces) : std::move(forces); }
};

/// Solves with P. If the factorisation is cheap, P is factorised (linear_solver.hpp); for other bodies all right-hand sides are
/// iterated together (batch_cg.hpp).
class ShiftedSolver {
 public:
  explicit ShiftedSolver(const Dynamics& dynamics) : small_(WholeBody::factorises(dynamics)), factor_(dynamics.nodes()) {}
  /// Sets P = s^2 M + s D + K; with `clamp` compressed elements do not soften K. Returns false if P is found not to be positive
  /// definite.
  bool prepare(const Linearisation& at, double shift, bool clamp);
  /// Solves x = P^-1 b with zero rows for held nodes; x holds the first guess. `tolerance` applies to the iterative method only.
  /// Returns false if P is found not to be positive definite: conjugate gradients discover that only while iterating.
  [[nodiscard]] bool solve(const Linearisation& at, std::span<const SolveColumn> columns, double tolerance);
  [[nodiscard]] bool solve(const Linearisation& at, const Vector& b, double tolerance, Vector& x) {
    const SolveColumn column{&b, &x};
    return solve(at, std::span(&column, 1), tolerance);
  }
  /// Diagonal blocks of P.
  std::span<const Mat3> diagonal() const { return batch_.matrix().diagonal; }
  /// Number of iterations over all columns; 0 for a body that is factorised.
  int iterations() const { return iterations_; }

 private:
  bool small_;
  std::optional<BlockMatrix> matrix_;  // created on demand: springs need none, and not every station needs every solver
  std::uint64_t generation_ = 0;       // generation of its coordinates
  LinearSolver factor_;
  BatchConjugateGradients batch_;
  int iterations_ = 0;
};

struct BasisRequest {
  int modes = 11;
  double shift_1_s = 20;
};

/// Solves for the body's own loads, F* and M v*, take up to twice the iterations of a port's, and affect few directions.
inline constexpr double kOwnToleranceFactor =
    20;  ///< SolveColumn::tolerance_factor; measured: `port` is the same to 0.1 dB (docs/notebook.md, 30)

/// Share of a direction's length that must be independent of the others for it to be added: less is hardly more than rounding.
inline constexpr double kIndependentShare = 1e-6;

/// First directions, already solved for.
struct KrylovStart {
  std::vector<Vector> ports;  ///< P^-1 B
  std::vector<Vector> fine;   ///< M^-1 B, for fast response, and for `hyper` responses that have little energy; may be empty
  Vector residual, motion;    ///< P^-1 F*, P^-1 M v*; the latter may be empty if no more modes are needed than come before it
};
/// Solves x = P^-1 b for every column. Returns false if P is found not to be positive definite.
using KrylovSolve = std::function<bool(std::span<const SolveColumn> columns)>;

/// Returns columns, at least one, as a matrix.
Matrix side_by_side(std::span<const Vector> columns);

/// Returns the loads of the next moments: (2 s M + D) x.
std::vector<Vector> moment_inputs(const Linearisation& at, double shift_1_s, std::span<const Vector> x);

/// Returns M-orthonormal columns, fewer than requested if the body has no more independent directions, none if P is not positive
/// definite.
std::optional<Matrix> krylov_basis(const Linearisation& at, const KrylovStart& start, const KrylovSolve& solve,
                                   const BasisRequest& request);
/// Returns the lowest eigenvalue of K y = mu M y at rest with the fixed nodes held [1/s^2], the square of the body's lowest
/// frequency, by inverse iteration (a Rayleigh quotient, never below the true value; within a few per cent). Returns 0 for a body
/// that is not fixed anywhere.
double softest_stiffness(const Dynamics& dynamics);

}  // namespace palpate
