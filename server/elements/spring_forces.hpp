// Forces of all springs of a body at a state, in single precision (spring_blocks.hpp): accurate to 1e-6 of the largest spring's.
#pragma once

#include "server/elements/body_state.hpp"
#include "server/elements/spring_blocks.hpp"

namespace palpate {

class SpringForces {
 public:
  /// `body` must outlive it. SpringBlocks::covers() it.
  explicit SpringForces(const LumpedBody& body)
      : body_(&body), blocks_(body), u_(body.nodes.size()), v_(body.nodes.size()), f_(body.nodes.size()) {}
  /// Returns the forces on the nodes without their weight; valid until the next call.
  const NodeArrays& at(const Vector& x, const Vector& v) {
    for (std::uint32_t i = 0; i < body_->nodes.size(); ++i) {
      u_.set(i, at_node(x, i) - body_->nodes[i]);
      v_.set(i, at_node(v, i));
      f_.set(i, Vec3::Zero());
    }
    for (const auto& slabs : {blocks_.even_slabs(), blocks_.odd_slabs()})
      for (const SpringBlocks::Slab& slab : slabs) blocks_.add_forces(slab, u_, v_, f_);
    return f_;
  }

 private:
  const LumpedBody* body_;
  SpringBlocks blocks_;
  NodeArrays u_, v_, f_;
};

}  // namespace palpate
