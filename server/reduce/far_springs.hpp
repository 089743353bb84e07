// The springs of a body, for FarTangents: of one between nodes a and b, with w = N(X_a) - N(X_b),
//
//     N^T k_e N = w w^T (x) k,     N^T d_e N = w w^T (x) d,     k, d: tangents of element_kernel.hpp
#pragma once

#include <array>

#include "server/body/element_kernel.hpp"
#include "server/reduce/far_tangents.hpp"

namespace palpate {

class FarSprings {
 public:
  static constexpr int kNumbers = 6;
  static constexpr std::size_t kAFrame = 6000;
  using Pair = SpringMatrices::Pair;

  FarSprings(const Dynamics& dynamics, const FarField& field) : body_(&dynamics.body()), field_(&field) {}

  std::uint32_t count() const { return static_cast<std::uint32_t>(body_->elements.size()); }
  std::array<std::uint32_t, 2> nodes_of(std::uint32_t e) const { return {body_->elements[e].a, body_->elements[e].b}; }
  using Bunch = std::vector<std::uint32_t>;
  Bunch bunch(const std::vector<std::uint32_t>& elements, std::uint32_t) const { return elements; }
  void add(const Bunch& bunch, std::uint32_t cell, const BodyState& state, CornerTangent<kNumbers>& to) const;

  /// k and d of one spring.
  static Pair tangents(const Element& element, const ElementState& s);
  /// What k gains where the softening of a compressed spring is left out.
  static Pair clamping(const ElementState& s);

 private:
  const LumpedBody* body_;
  const FarField* field_;
};

}  // namespace palpate
