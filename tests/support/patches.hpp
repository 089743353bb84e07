// Full-size patches that pass check(), made without a server, for tests of timing, allocation and hand-over.
#pragma once

#include <cstdint>

#include "common/patch/nonlinear_terms.hpp"
#include "common/patch/patch.hpp"

namespace palpate::test {

/// A grasp at the origin: `modes` damped modes from 5 Hz up, coupled to the tool in all directions, at rest.
Patch attach_patch(int modes, std::uint32_t seq, Micros stamp);

/// A flat surface of 8 triangles, 40 mm square, in the plane z = 0 facing up, carried by `modes` modes, at rest.
Patch touch_patch(int modes, std::uint32_t seq, Micros stamp);

/// Empty terms, to be filled with springs or tetrahedra.
NonlinearTerms sampled_terms(const Patch& patch);

/// Terms of 20 springs, together half as stiff as the modes.
NonlinearTerms spring_terms(const Patch& patch);
/// The same, linear, a tenth as stiff, and without tension at the stamp, so that they return only energy that was put in.
NonlinearTerms slack_spring_terms(const Patch& patch);
/// Terms of 60 springs: three pieces for 11 modes.
NonlinearTerms many_spring_terms(const Patch& patch);

/// Terms of 20 tetrahedra, with some of the modes' stiffness.
NonlinearTerms solid_terms(const Patch& patch);

}  // namespace palpate::test
