// Stress test of the full model alone: a block of 4 x 4 x 4 nodes is deformed by its top, released, and observed.
//
// Nodes are 20 mm apart, the bottom fixed. Springs are drawn log-uniformly from 10 N/m to ratio times that, node masses from
// mass_min_kg to mass_max_kg, each damper b = 2 zeta sqrt(k m) with m the mean of its nodes.
//     compress  every node down to (1 - `amount`) of its height, at once (amount below 1)
//     invert    the top through the fixed bottom within 0.2 s, by `amount` times the height (amount above 1)
//     pull      one corner of the top sideways and up within 0.2 s, by `amount` times the height
// and then everything is released.
//
// Requirements: nothing is ever NaN; no step is given up; after the release the energy never grows (a body without dampers has
// only the integrator's own damping, so that is all it can promise); every step that was shorter than requested is reported; and
// the body returns. A body that is slow, or still oscillates, has not returned after the observed time. It is then relaxed:
// L-stable steps whose velocity is discarded (as in settle.hpp), with growing length, so that stiff parts are at rest before the
// steps are long enough to throw them over, lead to the equilibrium in whose basin it is. Springs depend on lengths alone, so the
// rest shape is not the only equilibrium: the block mirrored in its fixed face is as relaxed as before, and folded ones can be
// stable. A block that was torn through itself, or compressed to less than half its height, may end in such an equilibrium, which
// is distinguished from the rest shape. A block that was compressed less may do so only if it still oscillates with most of its
// energy, which carries it over the folds of its softest springs, at any step length.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "server/body/dynamics.hpp"

namespace palpate {

enum class Treatment : std::uint8_t { compress, invert, pull };
inline constexpr std::array<std::string_view, 3> kTreatmentNames{"compress", "invert", "pull"};
inline std::string_view name_of(Treatment t) { return kTreatmentNames[static_cast<std::size_t>(t)]; }

struct BodyTrial {
  Treatment treatment = Treatment::compress;
  SpringLaw law = SpringLaw::linear;
  double amount = 0.5;
  double ratio = 1, zeta = 0.1, mass_min_kg = 0.01, mass_max_kg = 0.01;
  double step_ms = 10;
  std::uint64_t seed = 1;
};

/// back: at the rest shape by itself. on_its_way: not yet, but it relaxes to it. elsewhere: it is in, or relaxes to, another
/// equilibrium. none: the relaxation found no equilibrium.
enum class BodyEnd : std::uint8_t { back, on_its_way, elsewhere, none };
inline constexpr std::array<std::string_view, 4> kBodyEndNames{"back", "on its way", "elsewhere", "none"};
inline std::string_view name_of(BodyEnd e) { return kBodyEndNames[static_cast<std::size_t>(e)]; }

struct BodyTrialResult {
  bool finite = true;
  int steps = 0, cut_steps = 0;
  int failed = 0;           ///< pieces of 50 ms that failed even with the shortest step; a room would halt the body
  bool hidden_cut = false;  ///< true: more steps than the longest ones make, and none reported as cut
  double released_j = 0;    ///< energy at the release
  double growth = 0;        ///< highest energy after the release over that, minus 1; negative: it only fell
  double left = 0;          ///< energy at the end of the observed time, over released_j
  double off_spacings = 0;  ///< largest distance of a node from its rest position at that time
  BodyEnd end = BodyEnd::none;

  /// Returns true if there was no NaN, no piece given up, no growth, all cuts were reported, and the end is an equilibrium: the
  /// rest shape, or another one if the block may fold.
  bool holds(const BodyTrial& trial) const;
};

LumpedBody trial_body(const BodyTrial& trial);
BodyTrialResult try_body(const BodyTrial& trial);

}  // namespace palpate
