// A body at rest under prescribed displacements and loads at its nodes, component by component:
//
//     F(x)_c + p_c = 0 where component c of a node is free,     x_c = X_c + u_c where it is held
//
// F: forces of the elements and gravity [N] (server/body/dynamics.hpp), p: dead loads [N], u: prescribed displacements [m].
// Scenes fix whole nodes; planes of symmetry, sliding ends and frictionless punches hold one component, as the closed forms of
// elasticity require.
//
// Solved by Newton's method with the exact tangent, in equal increments from the present state to the prescribed one. Within an
// increment the first step moves the held components; later steps are cut until the energy falls. An increment that fails is
// halved.
#pragma once

#include <vector>

#include "server/body/dynamics.hpp"
#include "server/solve/linear_solver.hpp"

namespace palpate {

class BoundaryProblem {
 public:
  /// `body` must outlive this object. Its fixed nodes are held at their positions.
  explicit BoundaryProblem(const LumpedBody& body);

  void hold(std::uint32_t node, int axis, double displacement_m = 0);
  void hold(std::uint32_t node, const Vec3& displacement_m);
  void release(std::uint32_t node, int axis);
  bool holds(std::uint32_t node, int axis) const { return held_[component(node, axis)] != 0; }
  /// Adds a load.
  void push(std::uint32_t node, const Vec3& force_n);

  /// Solves in `shares` increments. Throws std::runtime_error if no equilibrium is found.
  void solve(int shares = 1);

  const Vector& x() const { return state_.x; }
  Vec3 displacement(std::uint32_t node) const { return at_node(state_.x, node) - dynamics_.body().nodes[node]; }
  /// Force on the body that holds a node [N]; 0 where it is free.
  Vec3 reaction(std::uint32_t node) const { return -at_node(residual_, node); }

 private:
  static std::size_t component(std::uint32_t node, int axis) { return 3 * std::size_t{node} + static_cast<std::size_t>(axis); }
  /// Advances from `x0`, `p0` to `x1`, `p1`, with at most `halvings` halvings.
  bool advance(const Vector& u0, const Vector& p0, const Vector& u1, const Vector& p1, int halvings);
  bool newton(const Vector& u, const Vector& p);
  bool step(const Vector& held_change, bool clamp);
  bool descend();
  void take_residual();
  void mask_matrix();
  /// Largest residual force on a free component, and the sum of holding and loading forces.
  double out_of_balance() const;
  double load() const;
  double potential() const;

  Dynamics dynamics_;
  LinearSolver solver_;
  BlockMatrix matrix_;
  BodyState state_;
  std::vector<std::uint8_t> held_, none_;
  Vector target_, asked_load_;      // u of held components, p
  Vector applied_;                  // p at present
  Vector residual_, right_, step_;  // F + p; right-hand side of the linear system; its solution
};

}  // namespace palpate
