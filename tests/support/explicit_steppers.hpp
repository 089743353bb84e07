// Explicit integrators of one stage and of several, for tests of both.
#pragma once

#include "server/dynamics/explicit_integrator.hpp"

namespace palpate::test {

struct Leapfrog : ExplicitIntegrator {
  Leapfrog(const Dynamics& dynamics, const Skin& skin)
      : ExplicitIntegrator(dynamics, skin, Stages::one, ExplicitLimits(dynamics)) {}
};
struct Stabilised : ExplicitIntegrator {
  Stabilised(const Dynamics& dynamics, const Skin& skin)
      : ExplicitIntegrator(dynamics, skin, Stages::more, ExplicitLimits(dynamics)) {}
};

}  // namespace palpate::test
