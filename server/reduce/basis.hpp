// A basis V for a local model: rational Krylov directions at the port, orthonormal in the mass matrix (V^T M V = I).
//
// With P = s^2 M + s D + K at the state (x*, v*), the directions are, in the order in which they are worth having,
//     P^-1 B,  v*,  P^-1 F*,  P^-1 M v*,   then their next moments  X <- P^-1 (2 s M + D) X
// which match the response of the whole body to the port, to its own residual force and to its own motion around the frequency s:
// twice the reciprocal of the prediction horizon (shift_for() in frame_model.hpp). Directions that add nothing (nearly dependent)
// are left out. Source: rational Krylov (moment matching) for second-order systems, Bai and Su, SIAM J. Sci. Comput. 26 (2005).
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "server/body/batch_cg.hpp"
#include "server/body/linear_solver.hpp"
#include "server/reduce/nonlinear_subdomain.hpp"

namespace palpate {

/// K and D on the columns of a V: V^T K V and V^T D V.
struct Projection {
  Matrix k, d;
};

/// Where a model is linearised and what it may move.
struct Linearisation {
  const BodyOperator* body = nullptr;               ///< M, K and D
  const std::vector<std::uint8_t>* held = nullptr;  ///< coordinates that the model keeps still
  const WholeBody* part = nullptr;                ///< whose forces are known beyond their tangents: all, or what is near the tool
  const NonlinearSubdomain* subdomain = nullptr;  ///< how that part moves; null: it is all
  CoarseSpace* coarse = nullptr;                  ///< for iterative solves; null: none
  std::span<const CoarseSpace::Node> pieces = {};  ///< where in it each coordinate is

  Linearisation() = default;
  Linearisation(const WholeBody& whole, const std::vector<std::uint8_t>& still) : body(&whole), held(&still), part(&whole) {}

  const Vector& masses() const { return body->masses(); }
  const Vector& velocity() const { return body->velocity(); }
  /// v where nothing is held.
  Vector free_velocity() const {
    Vector v = velocity();
    mask(*held, v);
    return v;
  }
  /// M v where nothing is held.
  Vector free_momentum() const { return masses().cwiseProduct(free_velocity()); }
  Projection projected(const Matrix& v) const {
    Matrix k_v, d_v;
    body->multiply(v, k_v, d_v);
    return {v.transpose() * k_v, v.transpose() * d_v};
  }
  /// How the nodes of the part move, and what forces on them do to the coordinates.
  Matrix moved(Matrix y) const { return subdomain ? subdomain->moved(y) : std::move(y); }
  Vector gathered(Vector forces) const { return subdomain ? subdomain->gathered(forces) : std::move(forces); }
};

/// Solves with P. Where that costs next to nothing it is factorised (linear_solver.hpp); on other bodies all right-hand sides go
/// through the matrix side by side (batch_cg.hpp).
class ShiftedSolver {
 public:
  explicit ShiftedSolver(const Dynamics& dynamics) : small_(WholeBody::factorises(dynamics)), factor_(dynamics.nodes()) {}
  /// P = s^2 M + s D + K; with `clamp` compressed elements do not soften K. False when P turns out not to be positive definite.
  bool prepare(const Linearisation& at, double shift, bool clamp);
  /// x = P^-1 b, rows of held nodes zero; x holds the first guess. `tolerance` matters to the iterative method only.
  /// False when P turns out not to be positive definite: conjugate gradients find that out only by use.
  [[nodiscard]] bool solve(const Linearisation& at, std::span<const SolveColumn> columns, double tolerance);
  [[nodiscard]] bool solve(const Linearisation& at, const Vector& b, double tolerance, Vector& x) {
    const SolveColumn column{&b, &x};
    return solve(at, std::span(&column, 1), tolerance);
  }
  /// The blocks of P's diagonal.
  std::span<const Mat3> diagonal() const { return batch_.matrix().diagonal; }
  /// Of all columns together; 0 for a body that is factorised.
  int iterations() const { return iterations_; }

 private:
  bool small_;
  std::optional<BlockMatrix> matrix_;  // made when first needed: springs have none, nor has every station every kind of solver
  std::uint64_t generation_ = 0;       // of the coordinates that it is for
  LinearSolver factor_;
  BatchConjugateGradients batch_;
  int iterations_ = 0;
};

struct BasisRequest {
  int modes = 11;
  double shift_1_s = 20;
  double tolerance = 1e-2;  ///< of the iterative solves: a Galerkin basis forgives (docs/decisions/0003)
};

/// Warm starts: the responses of the last frame, in order of request.
using BasisMemory = std::vector<Vector>;

/// The body's own loads, F* and M v*, take up to twice the iterations of a port's, and are felt through few directions.
inline constexpr double kOwnLooser = 20;  ///< SolveColumn::looser; measured: `port` the same to 0.1 dB (docs/notebook.md, 30)

/// Of the length of a direction, what must be left of it beside others for it to be one of its own: less is hardly more than
/// rounding.
inline constexpr double kIndependentShare = 1e-6;

/// First directions, already solved for.
struct KrylovStart {
  std::vector<Vector> ports;  ///< P^-1 B
  std::vector<Vector> fine;   ///< M^-1 B, for fast response; may be empty
  Vector residual, motion;    ///< P^-1 F*, P^-1 M v*; the latter may be empty where no more modes are wanted than come before it
};
/// x = P^-1 b for every column. False when P turns out not to be positive definite.
using KrylovSolve = std::function<bool(std::span<const SolveColumn> columns)>;

/// Of so many solves that come one after the other, each frame the same, the next: those of the last frame, from `next` of
/// `memory` on, are where it begins. All must outlive it.
KrylovSolve remembering(const Linearisation& at, ShiftedSolver& solver, double tolerance, std::size_t next, BasisMemory& memory);

/// Columns, at least one, as a matrix.
Matrix side_by_side(std::span<const Vector> columns);

/// What the next moments respond to: (2 s M + D) x.
std::vector<Vector> moment_inputs(const Linearisation& at, double shift_1_s, std::span<const Vector> x);

/// Columns are M-orthonormal; fewer than asked when the body has no more to give; nothing when P is not positive definite.
std::optional<Matrix> krylov_basis(const Linearisation& at, const KrylovStart& start, const KrylovSolve& solve,
                                   const BasisRequest& request);
/// The same from the input directions B_s (3 N each) and the residual force F*.
std::optional<Matrix> krylov_basis(const Linearisation& at, ShiftedSolver& solver, const std::vector<Vector>& ports,
                                   const std::vector<Vector>& fine, const Vector& residual, const BasisRequest& request,
                                   BasisMemory& memory);

/// Lowest eigenvalue of K y = mu M y at rest with the fixed nodes held [1/s^2]: the square of the body's lowest frequency, by
/// inverse iteration (a Rayleigh quotient, never below the true value; within a few per cent). 0 for a body that is not fixed
/// anywhere.
double softest_stiffness(const Dynamics& dynamics);

}  // namespace palpate
