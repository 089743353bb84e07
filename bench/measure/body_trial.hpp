// The full model alone, ill-treated: a block of 4 x 4 x 4 nodes is deformed by its top, let go of, and watched.
//
// Nodes are 20 mm apart, the bottom fixed. Springs are drawn log-uniformly from 10 N/m to ratio times that, node masses from
// mass_min_kg to mass_max_kg, each damper b = 2 zeta sqrt(k m) with m the mean of its nodes.
//     compress  every node down to (1 - `amount`) of its height, at once (amount below 1)
//     invert    the top through the fixed bottom within 0.2 s, by `amount` times the height (amount above 1)
//     pull      one corner of the top sideways and up within 0.2 s, by `amount` times the height
// and then everything lets go.
//
// What must hold: nothing is ever NaN; no step is given up; after the release the energy never grows (a body without dampers has
// only the integrator's own damping, so that is all it can promise); every step that was shorter than asked for is told; and the
// body comes back. One that is slow, or swings on, has not after the watched time. It is then relaxed: L-stable steps whose
// velocity is thrown away (as settle.hpp does), longer and longer, so that what is stiff is at rest before the steps are long
// enough to throw it over, take it down to the equilibrium in whose basin it is. Springs see lengths alone, so the rest shape is
// not the only equilibrium: the block mirrored in its fixed face is as relaxed as before, and folded ones can be stable. A block
// that was torn through itself, or compressed to less than half its height, may end in such a one, which is told from the rest
// shape. One that was compressed less may only when it still swings with most of its energy, which takes it over the folds of its
// softest springs: so it does at any step length.
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
  int failed = 0;  ///< pieces of 50 ms that even the shortest step did not get through: the room's answer is to halt the body
  bool hidden_cut = false;  ///< more steps than the longest ones make, and none reported as cut
  double released_j = 0;    ///< energy at the release
  double growth = 0;        ///< highest energy after the release over that, minus 1; negative: it only fell
  double left = 0;          ///< energy at the end of the watched time over that
  double off_spacings = 0;  ///< largest distance of a node from its rest place then
  BodyEnd end = BodyEnd::none;

  /// No NaN, no piece given up, no growth, all cuts told, and an equilibrium at the end: the rest shape, or where the block may
  /// fold another.
  bool holds(const BodyTrial& trial) const;
};

LumpedBody trial_body(const BodyTrial& trial);
BodyTrialResult try_body(const BodyTrial& trial);

}  // namespace palpate
