// Meetings of several bodies in one LumpedBody (its members) with each other, and of one with itself.
//
// A node at x is in a cell of another member if x = sum_a w_a(xi) x_a over the cell's nodes, w_a its trilinear (tetrahedra:
// linear) shape functions at xi. There the other body is at its rest point X = sum_a w_a X_a, at the signed distance phi(X) from
// its surface at rest (distance_grid.hpp):
//
//     depth d = -phi(X),   g = F^-T grad phi(X),   F = sum_a w_a F_a,   F_a the mean of dx/dX at the centres of the cells of node
//     a velocity v_i - sum_a w_a v_a,   way from the anchor A (a rest point of the other body) F (X - A)
//
// contact_spring.hpp makes of it a force f on the node; the cell's nodes get -w_a f, so linear and angular momentum are kept.
// f is continuous; it is the gradient of k d^2 / 2 where cells deform alike. Its tangents are w w^T (x) K over the node (w = 1)
// and the cell's nodes (w = -w_a), without what g turns by.
//
//     k = kStiffnessRatio / (1 / K_ii + 1 / K),   c = t k,   mu = sqrt(mu_1 mu_2)
//
// K_ii is the node's own stiffness (contacts.hpp), K the mean of that of the other's surface. Nodes of both bodies are tested, so
// that two equal meshes press on each other with twice k a node. In itself a body meets only cells that are kApartEdges mean
// edges from the node at rest.
//
// Shapes: x, v, X, A, grad phi, g 3, in frame W; F 3 x 3; xi of the cell, 0 to 1.
// What can go wrong: a node beyond the middle of a body is pushed out at its other side; a body's edges and corners pass between
// the nodes and into the faces of the other. Cells are extrapolated by kBeyond of their size, as faces of four corners are not
// planar.
// Source: contact of finite elements by the distance in the material, Hirota, Fisher, State, Lee and Fuchs, Computer Animation
// (2001).
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "server/scene/scene.hpp"

namespace palpate {

class BodyContacts {
 public:
  static constexpr double kStiffnessRatio = 2, kApartEdges = 3, kBeyond = 0.1;

  /// A node in a cell of another member, or in a distant one of its own.
  struct Meeting {
    std::uint32_t node = 0, member = 0;  ///< of the cell
    std::array<std::uint32_t, 8> corners{};
    std::array<double, 8> weights{};  ///< sum 1; those of a tetrahedron come first, the others are 0
    double depth_m = 0;
    Vec3 gradient, rest;  ///< g, X
    Mat3 deformation;     ///< F
  };
  using OfNode = std::function<Vec3(std::uint32_t)>;

  /// `body` must outlive it.
  explicit BodyContacts(const LumpedBody& body);
  bool empty() const { return !sides_; }
  /// Sets K_ii of all nodes [N/m].
  void set_stiffness(const std::vector<double>& own_n_m);
  /// Meetings at these positions, by member, then by node.
  std::vector<Meeting> at(const OfNode& position) const;
  double stiffness_n_m(const Meeting& meeting) const;
  double friction(const Meeting& meeting) const;
  /// Upper bound of the eigenvalues that meetings add to M^-1 K [1/s^2], as long as no node of a member has more than twice
  /// as many nodes of another upon it as at rest.
  double most_w2() const;

 private:
  struct Sides;
  std::shared_ptr<Sides> sides_;  // null: no members
};

}  // namespace palpate
