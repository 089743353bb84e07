// A patch that changes nothing that can be felt need not be sent: the one that the station plays is renewed, as a lease is.
//
// The server knows every patch that the station may play, from the one that it says it plays to the newest that was sent, and the
// samples that it plays them with. It plays them too, and sets each beside the new patch over the time that the new one would be
// used: from its stamp t* to t* + horizon, with the tool going on as it went, and going kProbeM off that way within kProbeS,
// along the force (a tool that does not touch by its distance from a vertex near it more) and along both directions across it
// (which asks for the stiffness). The new patch is not needed when at all these times, for each of them,
//
//     |f_old(t) - f_new(t)| <= kExpectedPathShare w max(|f_new(t)|, kForceLeastN),      w the Weber fraction
//
// and it began in the same state of contact as the new one, finds the tool in contact where the new one does, is valid for as
// long after a word of the server (to a tenth), is no older than kPatchAgeMost, and the tool does not leave its trust radius
// meanwhile. What a hand does that none of these paths expects is what the rest of w is for. Patches that are renewed are set
// beside the new one of every frame: their errors do not add up.
//
// A hand notices a change of the force by about a tenth of it (w = 0.1), and less well where the force is small.
//
// Symbols: f 3 [N], the force on the tool; t in steps of 5 ms; w no unit.
// What can go wrong: a station that does not say what it plays, or plays what is no longer kept (kSentMax, or older than the
// tool's track), is sent the patch: dearer, and no less true.
// Source: Hinterseer and Steinbach (2005), where the last force that was sent stands in place of the patch.
#pragma once

#include <deque>
#include <optional>

#include "common/player/player.hpp"
#include "server/room/tool_track.hpp"

namespace palpate {

class Deadband {
 public:
  static constexpr std::size_t kSentMax = 16;        ///< patches kept that are on their way: 0.8 s of them at 20 Hz
  static constexpr Micros kPatchAgeMost{1'000'000};  ///< bounds for how long an error lasts that no path shows
  static constexpr double kExpectedPathShare = 0.5;  ///< of w; the other half is for what a hand does beside these paths
  static constexpr double kForceLeastN = 0.1;        ///< at w = 0.1 this allows 5 mN, a tenth of what a hand-over hides
  static constexpr double kProbeM = 0.003;           ///< at w = 0.1 and small forces a stiffness wrong by 2 N/m shows
  static constexpr double kProbeS = 0.06;            ///< kProbeM within it, by least jerk: 94 mm/s at most in contact

  /// Whom a patch is for.
  struct Station {
    double fraction = 0;            ///< w
    Micros horizon{};               ///< age that the patch will reach
    std::optional<Micros> playing;  ///< stamp of the patch that it is known to play
    const ToolTrack* track = nullptr;
  };

  /// The stamp from which on all patches of the station do as well as this one, the next; none when it has to be sent, and then
  /// it is taken to be.
  std::optional<Micros> pass(const Patch& patch, const NonlinearTerms& terms, const Station& station);

 private:
  bool all_serve(const PatchPlayer& next, const Station& station);
  void catch_up(const ToolTrack& track, Micros until);

  std::deque<PatchPlayer> sent_;  // oldest first, each as far as the tool is known
};

}  // namespace palpate
