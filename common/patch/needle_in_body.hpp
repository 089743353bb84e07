// A needle or blade in a body, as it can be put back into the same body when that is built again.
#pragma once

#include "common/patch/needle.hpp"

namespace palpate {

struct NeedleInBody {
  std::array<Vec3, kNeedlePoints> rest;  ///< points of its path in the body at rest [m]
  Vec3 edge = Vec3::Zero();              ///< of a blade, at rest, from end to end [m]; zero: of a needle
  NeedleLayers layers;
  NeedleTip tip;
};

}  // namespace palpate
