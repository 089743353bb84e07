// K and D of a locally refined body, as far as it does not matter what it is made of: `Elements` are those of far_tangents.hpp.
#pragma once

#include "server/reduce/refined_body.hpp"

namespace palpate {

template <class Elements>
class RefinedElements : public RefinedTangents {
 public:
  /// `body` must outlive it.
  explicit RefinedElements(const RefinedBody& body) : body_(&body), far_(body.dynamics(), body.far()) {}
  std::vector<std::uint32_t> near_elements() const final { return far_.elements_at(body_->near()); }
  const BlockPattern& pattern() const final { return tangents_.pattern(); }
  void multiply(const Matrix& y, Matrix& k_y, Matrix& d_y) const final { tangents_.multiply(y, k_y, d_y); }
  void multiply_sum(const Matrix& y, double c_k, double c_d, Matrix& sum) const final {
    tangents_.multiply_sum(y, c_k, c_d, sum);
  }

 protected:
  const RefinedBody* body_;
  FarTangents<Elements> far_;
  RefinedPattern pattern_;
  TangentMatrices<Elements::kNumbers> tangents_;
};

}  // namespace palpate
