// The equations of motion of a body of lumped masses that are joined by springs or carried by finite elements,
//
//     M x'' = F(x, x') + B lambda,       K = -dF/dx,   D = -dF/dx'
//
// x, v: 3 N (node 0 x, y, z, node 1 x, ...) [m], [m/s]; F: internal forces and gravity [N]; M: lumped masses [kg].
// Held nodes (fixed for good, or by a tool) have prescribed x and v: their rows and columns of a system matrix become those of
// the identity, and the force on them is the reaction that holds them.
#pragma once

#include <cstdint>
#include <vector>

#include "server/body/contacts.hpp"
#include "server/body/relaxation.hpp"
#include "server/body/sutures.hpp"
#include "server/elements/elements.hpp"

namespace palpate {

class Dynamics {
 public:
  /// `body` is at its rest shape (unload.hpp) and must outlive it.
  explicit Dynamics(const LumpedBody& body);
  Dynamics(const Dynamics&) = delete;
  Dynamics& operator=(const Dynamics&) = delete;

  std::uint32_t nodes() const { return static_cast<std::uint32_t>(body_->nodes.size()); }
  const LumpedBody& body() const { return *body_; }
  const Vector& masses() const { return masses_; }  ///< 3 N, each node's mass three times [kg]
  BodyState rest_state() const;
  const Springs& springs() const { return springs_; }
  const Tetrahedra& tetrahedra() const { return tetrahedra_; }
  const Hexahedra& hexahedra() const { return hexahedra_; }
  const Relaxation& relaxation() const { return relaxation_; }
  const Contacts& contacts() const { return contacts_; }
  const Sutures& sutures() const { return sutures_; }
  /// Moves what contacts and threads remember on, at the end of a step.
  void follow(BodyState& state) const {
    contacts_.follow(state);
    sutures_.follow(state);
  }

  /// Computes F(x, v): element forces and gravity, without the relaxed stress, contacts and threads.
  void forces(const Vector& x, const Vector& v, Vector& f) const;
  /// Computes all of F, with contacts, threads and the traction across a fresh cut.
  void forces(const BodyState& state, Vector& f) const {
    forces(state.x, state.v, f);
    relaxation_.add_forces(state, f);
    contacts_.add_forces(state, f);
    sutures_.add_forces(state, f);
    if (state.traction) f += state.traction->at(state.time_s);
  }
  /// Returns the force of the elements, contacts and threads on one node: what a tool that holds it feels (without the node's own
  /// weight and inertia).
  Vec3 element_force(const BodyState& state, std::uint32_t node) const;

  /// Returns an empty matrix on the body's pattern.
  BlockMatrix make_matrix() const;
  /// Assembles A = c_m M + c_d D + c_k K with the symmetric part of K; see ElementLoops for `clamp`. Rows and
  /// columns of held nodes become those of the identity. The pattern is widened by contacts between bodies and by threads.
  void assemble(const BodyState& state, double c_m, double c_d, double c_k, const std::vector<std::uint8_t>& held, bool clamp,
                BlockMatrix& a) const;
  /// Computes the products K y and D y with the unmasked symmetric tangents at a state, element by element. For many products see
  /// tangents.hpp.
  void multiply_tangents(const BodyState& state, const Vector& y, Vector& k_y, Vector& d_y) const;
  /// Returns the kinetic, elastic and gravitational energy [J].
  double energy(const BodyState& state) const;

 private:
  void add_contacts(const BodyState& state, double c_d, double c_k, const std::vector<std::uint8_t>& held, BlockMatrix& a) const;

  const LumpedBody* body_;
  Vector masses_;
  BlockMatrix pattern_;
  Springs springs_;
  Tetrahedra tetrahedra_;
  Hexahedra hexahedra_;
  Relaxation relaxation_;
  Contacts contacts_;
  Sutures sutures_;
};

/// Sets the rows of held nodes to zero.
void mask(const std::vector<std::uint8_t>& held, Vector& y);

}  // namespace palpate
