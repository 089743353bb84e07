// Eight springs side by side: the force of spring_kernel.hpp for linear and stiffening springs, in double precision and with the
// same order of operations, so with the same bits.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/base/doubles.hpp"
#include "server/elements/lane_variants.hpp"
#include "server/scene/scene.hpp"

namespace palpate {

struct SpringGroup {
  static constexpr std::size_t kSize = 8;
  EightNumbers stiffness_n_m, damping_n_s_m, rest_length_m;
  std::array<std::uint32_t, kSize> a{}, b{};  ///< nodes; 0 in unused lanes
  std::uint32_t count = 0;
};

/// Returns the springs of a body in their order; empty for a law that branches (thigh_skin).
std::vector<SpringGroup> spring_groups(const LumpedBody& body);

/// Returns the variants that this processor can run, the widest last, of: add forces to f at positions x and velocities v, 3 N
/// each; T(e) = k e (1 + stiffening (e / L0)^2).
std::span<const Variant<std::span<const SpringGroup>, double, const double*, const double*, double*>> spring_loops();

}  // namespace palpate
