// The laws of elasticity. A new law is a header beside the others, its name in SolidLaw (solid_law.hpp), and its class in
// ElasticLaw (docs/tutorials/your-own-law.md).
#pragma once

#include <optional>
#include <variant>

#include "common/mechanics/corotational.hpp"
#include "common/mechanics/fibres.hpp"
#include "common/mechanics/gent.hpp"
#include "common/mechanics/membrane.hpp"
#include "common/mechanics/neo_hookean.hpp"
#include "common/mechanics/ogden.hpp"
#include "common/mechanics/two_invariants.hpp"

namespace palpate {

using ElasticLaw = std::variant<NeoHookean, Corotational, MooneyRivlin, VerondaWestmann, Ogden, Gent, Membrane>;

/// A law with its parameters, and the fibres that are added to it.
class Elasticity {
 public:
  explicit Elasticity(const LawParameters& of);

  SolidLaw kind() const { return kind_; }
  /// Returns true if add_stress() may be called for floats.
  bool is_single_precision() const { return single_precision_; }

  template <typename L>
  PALPATE_INLINE void energy(const LaneModuli<L>& m, const LaneMatrix<L>& h, L& psi) const {
    visit([&](const auto& law) __attribute__((always_inline)) { law.energy(m, h, psi); });
    if (!fibres_) return;
    L more;
    fibres_->energy(m, h, more);
    psi += more;
  }
  /// p += P
  template <typename L>
  PALPATE_INLINE void add_stress(const LaneModuli<L>& m, const LaneMatrix<L>& h, LaneMatrix<L>& p) const {
    visit([&](const auto& law) __attribute__((always_inline)) {
      if constexpr (std::is_same_v<LaneNumber<L>, double> || std::remove_cvref_t<decltype(law)>::kSinglePrecision)
        law.add_stress(m, h, p);
    });
    if constexpr (std::is_same_v<LaneNumber<L>, double>)
      if (fibres_) fibres_->add_stress(m, h, p);
  }
  /// a += A
  template <typename L>
  PALPATE_INLINE void add_tangent(const LaneModuli<L>& m, const LaneMatrix<L>& h, Tangent<L>& a) const {
    visit([&](const auto& law) __attribute__((always_inline)) { law.add_tangent(m, h, a); });
    if (fibres_) fibres_->add_tangent(m, h, a);
  }

 private:
  /// Calls `of` with the law, inlined: what a loop calls must be compiled for the loop's processor.
  template <typename Of>
  PALPATE_INLINE void visit(const Of& of) const {
    visit(law_, of);
  }
  template <typename Of, typename... Laws>
  PALPATE_INLINE static void visit(const std::variant<Laws...>& law, const Of& of) {
    (void)((std::holds_alternative<Laws>(law) ? (of(*std::get_if<Laws>(&law)), true) : false) || ...);
  }

  ElasticLaw law_;
  std::optional<FibreLaw> fibres_;
  SolidLaw kind_;
  bool single_precision_;
};

}  // namespace palpate
