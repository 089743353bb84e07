// K and D of a locally refined body of springs.
#pragma once

#include "server/body/spring_forces.hpp"
#include "server/reduce/far_springs.hpp"
#include "server/reduce/refined_elements.hpp"

namespace palpate {

class RefinedSprings final : public RefinedElements<FarSprings> {
 public:
  /// `body` must outlive it.
  explicit RefinedSprings(const RefinedBody& body);
  void lay_out() override;
  void take(const BodyState& state) override;
  const NodeArrays& forces(const BodyState& state) override { return forces_.at(state.x, state.v); }
  void assemble(double c_d, double c_k, bool clamp, BlockMatrix& a) const override;

 private:
  /// A spring with a near node a. Where b is far, the spring adds to the blocks of a and the corners of b's cell, and what it
  /// adds to those of the corners goes by way of a sum over all springs that end in b.
  struct Spring {
    Element numbers;                                     // a near
    std::uint32_t a_a = 0;                               // entry of a
    std::uint32_t b_b = 0, a_b = 0;                      // entries where b is near
    std::uint32_t end = RefinedBody::kNone, border = 0;  // b among ends_, and with a among the borders; none: it is near
  };
  /// A far node that such springs end in.
  struct End {
    std::uint32_t cell = 0;
    FarField::Shape shape;
  };
  /// Springs with a near node, which comes first in them.
  void take_springs();
  /// Of all springs with a near node, tangent(k) that of the k-th.
  template <typename Tangents>
  void add_near(const Tangents& tangents, SpringMatrices& to) const;

  SpringForces forces_;
  std::vector<Spring> springs_;
  std::vector<ElementState> states_;  // parallel to springs_
  std::vector<End> ends_;
};

}  // namespace palpate
