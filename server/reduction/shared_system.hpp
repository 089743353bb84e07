// P = s^2 M + s D + K of a linearised body at one shift, ready to solve with, and the body's responses in this frame: to its own
// loads, and to its ports.
//
// A port is where a tool acts on the body, of one of two kinds; its three input columns U are
//
//     a point of the surface (touch)   U = B, the force of the tool on the nodes around it
//     a held node (grasp)              U = -(K_t + s D_t), the force on the other nodes as the tool moves its own; K_t, D_t the
//                                      columns of K and D of that node
//
// with responses X = P^-1 U and the port's compliance U^T X (for a grasp at s = 0: the stiffness K_ft^T K_ff^-1 K_ft by which the
// other nodes yield). Shapes: U, X 3 n x 3, n coordinates (body_operator.hpp).
#pragma once

#include <array>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "server/dynamics/integrator.hpp"
#include "server/reduction/basis.hpp"

namespace palpate {

struct Port {
  NodeWeights b;                                      ///< touch: B
  std::array<Vector, 3> k, d;                         ///< grasp: K_t and D_t, zero for held nodes
  Mat3 k_port = Mat3::Zero(), d_port = Mat3::Zero();  ///< grasp: K and D of its own node
  std::array<Vector, 3> input, response;              ///< U, X
  Mat3 compliance = Mat3::Zero();                     ///< U^T X
  std::vector<Vector> slides;                         ///< P^-1 of the loads of a sliding tool; empty if not requested
};

/// Parameters of P: its shift s and the nodes that it holds; with `clamp` compressed elements do not soften it.
struct SystemKey {
  double shift_1_s = 0;
  bool clamp = false;
  std::vector<std::uint8_t> held;
  bool operator==(const SystemKey&) const = default;
};

class SharedSystem {
 public:
  explicit SharedSystem(const Dynamics& dynamics) : solver_(dynamics) {}
  SharedSystem(const SharedSystem&) = delete;
  /// Starts a new frame. `tolerance`: of solves. Returns false if P is found not to be positive definite.
  bool prepare(const Linearisation& at, SystemKey key, double tolerance);
  const SystemKey& key() const { return key_; }
  const Linearisation& at() const { return at_; }
  bool is_definite() const { return definite_; }

  /// Adds a point of the surface, or a held node, as port k, unless it is known; respond() computes its responses.
  void add_touch(std::size_t k, NodeWeights b);
  void add_grasp(std::size_t k, std::uint32_t coordinate);
  bool knows(std::size_t k) const { return ports_.contains(k); }
  /// Loads whose responses are requested: of port k if its tool slides; the residual force and M v* of the body, null if not.
  struct Loads {
    std::map<std::size_t, std::vector<Vector>> slides = {};
    const Vector *residual = nullptr, *motion = nullptr;
  };
  /// Computes, together, all responses that are not known in this frame. Returns false if P is found not to be positive definite.
  bool respond(const Loads& loads);
  const Port& port(std::size_t k) const { return ports_.at(k); }
  const Vector& residual() const { return residual_; }
  const Vector& motion() const { return motion_; }
  bool solve(std::span<const SolveColumn> columns) { return solver_.solve(at_, columns, tolerance_); }
  /// Diagonal blocks of P.
  std::span<const Mat3> diagonal() const { return solver_.diagonal(); }
  double shift() const { return key_.shift_1_s; }
  int iterations() const { return solver_.iterations(); }

 private:
  ShiftedSolver solver_;
  Linearisation at_;
  SystemKey key_;
  double tolerance_ = 0;
  bool definite_ = false;
  std::map<std::size_t, Port> ports_;
  Vector residual_, motion_;
};

}  // namespace palpate
