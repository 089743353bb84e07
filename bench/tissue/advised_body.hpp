// First stage of palpate-lab advise, before meshing: placement, size and mass of the surface, the part to fix, and the tip.
#pragma once

#include "bench/tissue/advice.hpp"

namespace palpate {

/// By default the lowest tenth of the volume is fixed, at least 15 % of the height and at most half of it, and the tip has twice
/// the spacing of a lattice of 800 nodes. Throws InputError for an invalid surface or material.
AdvisedBody advised_body(const AdviceRequest& request);

/// Spacing of a lattice with about `nodes` nodes [m], at most the thickness of a thin body.
double spacing_for(const AdvisedBody& body, double nodes);

}  // namespace palpate
