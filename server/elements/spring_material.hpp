// The law of a body's springs (common/mechanics/spring_law.hpp).
#pragma once

#include "common/mechanics/spring_law.hpp"
#include "server/scene/scene.hpp"

namespace palpate {

struct SpringMaterial {
  SpringLaw law = SpringLaw::linear;
  double stiffening = 0;
  bool planar = false;  ///< true: there is no motion across the plane, and no stiffness

  explicit SpringMaterial(const LumpedBody& body) : SpringMaterial(body.law, body.stiffening, body.planar) {}
  SpringMaterial(SpringLaw of, double c, bool in_plane)
      : law(of), stiffening(of == SpringLaw::stiffening ? c : 0), planar(in_plane) {}

  /// Computes T and T' at elongation e.
  template <typename L>
  PALPATE_INLINE void respond(const L& k, const L& rest, const L& e, L& tension, L& slope) const {
    if (law == SpringLaw::thigh_skin)
      ThighSkinSpring{}.respond(k, e, tension, slope);
    else
      StiffeningSpring{stiffening}.respond(k, rest, e, tension, slope);
  }
  double energy(double k, double rest, double e) const {
    return law == SpringLaw::thigh_skin ? ThighSkinSpring{}.energy(k, e) : StiffeningSpring{stiffening}.energy(k, rest, e);
  }
};

}  // namespace palpate
