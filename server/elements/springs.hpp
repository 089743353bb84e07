// All springs of a body: spring_kernel.hpp summed over its lumped elements. Signs and symbols as in dynamics.hpp.
#pragma once

#include <vector>

#include "server/elements/body_state.hpp"
#include "server/elements/spring_kernel.hpp"
#include "server/elements/spring_lanes.hpp"

namespace palpate {

class Springs {
 public:
  /// `body` must outlive it. `pattern` has a block for every pair of nodes that an element joins.
  Springs(const LumpedBody& body, const BlockMatrix& pattern);

  bool empty() const { return body_->elements.empty(); }
  /// Adds the forces of the elements to f.
  void add_forces(const Vector& x, const Vector& v, Vector& f) const;
  Vec3 force_on(const BodyState& state, std::uint32_t node) const;
  /// Adds c_d D + c_k K (symmetric part) to A, except rows and columns of held nodes; see SpringKernel for `clamp`.
  void add_tangents(const BodyState& state, double c_d, double c_k, const std::vector<std::uint8_t>& held, bool clamp,
                    BlockMatrix& a) const;
  /// Computes k_y += K y, d_y += D y.
  void add_products(const BodyState& state, const Vector& y, Vector& k_y, Vector& d_y) const;
  /// Returns the elastic energy [J].
  double energy(const Vector& x) const;

 private:
  ElementState element_state(const Element& e, const Vector& x, const Vector& v) const;

  struct Entries {
    std::uint32_t aa, ab, ba, bb;
  };
  const LumpedBody* body_;
  SpringKernel kernel_;
  std::vector<SpringGroup> groups_;
  std::vector<Entries> entries_;
  std::vector<std::uint32_t> first_, incident_;  // elements of each node
};

}  // namespace palpate
