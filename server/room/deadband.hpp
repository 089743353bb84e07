// A patch whose difference from the one in play cannot be felt is not sent: the older one is renewed instead, as a lease is.
//
// The server knows every patch that the station may be playing, from the newest that it reported to the newest that was sent, and
// the samples that drive it. It plays all of them, and compares each with the new patch over the time in which the new one would
// be used: from its stamp t* to t* + horizon, with the tool extrapolated along its path, and with the tool kProbeM off that path
// within kProbeS, along the force (for a tool that does not touch: farther, by its distance from a nearby vertex) and along both
// directions across the force (which tests the stiffness). The new patch is not needed if at all these times, for each of the
// older patches,
//
//     |f_old(t) - f_new(t)| <= kExpectedPathShare w max(|f_new(t)|, kForceLeastN),      w the Weber fraction
//
// and if the older patch began in the same state of contact as the new one, finds the tool in contact where the new one does,
// stays valid for as long after a message from the server (within a tenth), is no older than kPatchAgeMost, and the tool stays
// inside its trust radius. The rest of w covers what a hand does off these paths. Renewed patches are compared with the new one
// in every frame: their errors do not add up.
//
// A hand notices a change of the force of about a tenth (w = 0.1), and is less sensitive where the force is small.
//
// Symbols: f 3 [N], the force on the tool; t in steps of 5 ms; w no unit.
// Failures: a station that does not report what it plays, or plays a patch that is no longer kept (more than kSentMax ago, or
// older than the tool's track), is sent the new patch, which costs bandwidth but no accuracy.
// Source: Hinterseer and Steinbach (2005), where the last force that was sent is compared instead of the patch.
#pragma once

#include <deque>
#include <optional>

#include "common/player/player.hpp"
#include "server/room/tool_track.hpp"

namespace palpate {

class Deadband {
 public:
  static constexpr std::size_t kSentMax = 16;        ///< most patches in flight that are kept: 0.8 s of them at 20 Hz
  static constexpr Micros kPatchAgeMost{1'000'000};  ///< bounds the duration of an error that no probe shows
  static constexpr double kExpectedPathShare = 0.5;  ///< share of w; the other half covers what a hand does off these paths
  static constexpr double kForceLeastN = 0.1;        ///< [N]; at w = 0.1 it allows 5 mN, a tenth of what a hand-over hides
  static constexpr double kProbeM = 0.003;           ///< [m]; at w = 0.1 and small forces it reveals a stiffness error of 2 N/m
  static constexpr double kProbeS = 0.06;            ///< [s] to reach kProbeM, by minimum jerk: 94 mm/s at most in contact

  /// The station that a patch is for.
  struct Station {
    double fraction = 0;            ///< w
    Micros horizon{};               ///< age that the patch will reach
    std::optional<Micros> playing;  ///< stamp of the patch that it is known to play
    const ToolTrack* track = nullptr;
  };

  /// Returns the stamp from which on all patches of the station are as good as `patch`, its next one. Returns none if `patch` has
  /// to be sent; it is then recorded as sent.
  std::optional<Micros> pass(const Patch& patch, const NonlinearTerms& terms, const Station& station);

 private:
  bool all_serve(const PatchPlayer& next, const Station& station);
  void catch_up(const ToolTrack& track, Micros until);

  std::deque<PatchPlayer> sent_;  // oldest first, each advanced as far as the tool is known
};

}  // namespace palpate
