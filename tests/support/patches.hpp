// Patches of full size that pass check(), without a server: for tests of timing, allocation and hand-over.
#pragma once

#include <cstdint>

#include "common/port/nonlinear_terms.hpp"
#include "common/port/patch.hpp"

namespace palpate::test {

/// A grasp at the origin: `modes` damped modes from 5 Hz up, coupled to the tool in all directions, at rest.
Patch attach_patch(int modes, std::uint32_t seq, Micros stamp);

/// A flat surface of 8 triangles, 40 mm square, in the plane z = 0 with its outside up, borne by `modes` modes, at rest.
Patch touch_patch(int modes, std::uint32_t seq, Micros stamp);

/// Terms for springs or tetrahedra of which none are there yet.
NonlinearTerms sampled_terms(const Patch& patch);

/// Terms that are 20 springs, half as stiff together as the modes are.
NonlinearTerms spring_terms(const Patch& patch);
/// The same, linear, a tenth as stiff, and without tension at the stamp: what they give was put into them.
NonlinearTerms slack_spring_terms(const Patch& patch);
/// With 60 springs: with 11 modes three pieces.
NonlinearTerms many_spring_terms(const Patch& patch);

/// Terms that are 20 tetrahedra, some of the modes' stiffness.
NonlinearTerms solid_terms(const Patch& patch);

}  // namespace palpate::test
