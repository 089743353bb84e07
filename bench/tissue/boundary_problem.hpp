// A body at rest under what is prescribed at its nodes, component by component:
//
//     F(x)_c + p_c = 0 where component c of a node is free,     x_c = X_c + u_c where it is held
//
// F: forces of the elements and gravity [N] (server/body/dynamics.hpp), p: dead loads [N], u: prescribed displacements [m].
// Scenes hold nodes whole; planes of symmetry, sliding ends and frictionless punches hold one component, so the closed forms of
// elasticity need this.
//
// Solved by Newton's method with the exact tangent, from where the body is to what is prescribed in equal shares. Within a share
// the first step moves the held components, the others are cut until the energy falls; a share that fails is halved.
#pragma once

#include <vector>

#include "server/body/dynamics.hpp"
#include "server/body/linear_solver.hpp"

namespace palpate {

class BoundaryProblem {
 public:
  /// `body` must outlive it. What it fixes is held where it is.
  explicit BoundaryProblem(const LumpedBody& body);

  void hold(std::uint32_t node, int axis, double displacement_m = 0);
  void hold(std::uint32_t node, const Vec3& displacement_m);
  void release(std::uint32_t node, int axis);
  bool holds(std::uint32_t node, int axis) const { return held_[component(node, axis)] != 0; }
  /// Adds a load.
  void push(std::uint32_t node, const Vec3& force_n);

  /// Throws std::runtime_error where no equilibrium is found.
  void solve(int shares = 1);

  const Vector& x() const { return state_.x; }
  Vec3 displacement(std::uint32_t node) const { return at_node(state_.x, node) - dynamics_.body().nodes[node]; }
  /// What holds a node: the force on the body [N]; 0 where it is free.
  Vec3 reaction(std::uint32_t node) const { return -at_node(residual_, node); }

 private:
  static std::size_t component(std::uint32_t node, int axis) { return 3 * std::size_t{node} + static_cast<std::size_t>(axis); }
  /// From `x0`, `p0` to `x1`, `p1`, halved at most `halvings` times.
  bool advance(const Vector& u0, const Vector& p0, const Vector& u1, const Vector& p1, int halvings);
  bool newton(const Vector& u, const Vector& p);
  bool step(const Vector& held_change, bool clamp);
  bool descend();
  void take_residual();
  void mask_matrix();
  /// Largest force out of balance on a free component, and the sum of what holds and loads the body.
  double out_of_balance() const;
  double load() const;
  double potential() const;

  Dynamics dynamics_;
  LinearSolver solver_;
  BlockMatrix matrix_;
  BodyState state_;
  std::vector<std::uint8_t> held_, none_;
  Vector target_, asked_load_;      // u of held components, p
  Vector applied_;                  // p as it is now
  Vector residual_, right_, step_;  // F + p; of the linear system; its answer
};

}  // namespace palpate
