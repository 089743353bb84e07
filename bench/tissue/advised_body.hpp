// What palpate-lab advise says of a surface before any mesh: where it is put, how large and heavy it is, what to hold and which
// tip.
#pragma once

#include "bench/tissue/advice.hpp"

namespace palpate {

/// Where nothing is asked for, the lowest tenth of the volume is held, at least 15 % of the height and at most half of it, and
/// the tip has twice the spacing of a lattice of 800 nodes. Throws InputError for a surface or a material that is none.
AdvisedBody advised_body(const AdviceRequest& request);

/// Of a lattice with so many nodes, about [m]; no wider than what is thin.
double spacing_for(const AdvisedBody& body, double nodes);

}  // namespace palpate
