// A patch that changes nothing that can be felt need not be sent: the one that the station plays lives on.
//
// The server knows every patch that the station may play, from the one that it says it plays to the newest that was sent, and the
// samples that it plays them with. It plays them too, and sets each beside the new patch over the time that the new one would be
// used: from its stamp t* to t* + horizon, with the tool going on as it went, and going kProbeM off that way within kProbeS,
// along the force and along both directions across it (which asks for the stiffness). The new patch is not needed when for each
// of them
//
//     |f_old(t) - f_new(t)| <= kKnown w max(|f_new(t)|, kLeastN)          at all these times, w the Weber fraction
//
// and it began in the same state of contact as the new one, finds the tool in contact where the new one does, is valid for as
// long after a word of the server (to a tenth), is no older than kLivesMost, and the tool does not leave its trust radius
// meanwhile. What a hand does that none of these paths expects is what the rest of w is for. Patches that live on are set beside
// the new one of every frame: their errors do not add up.
//
// A hand notices a change of the force by about a tenth of it (w = 0.1), and less well where the force is small.
#pragma once

#include <deque>
#include <optional>

#include "common/player/player.hpp"
#include "server/room/tool_track.hpp"

namespace palpate {

class Deadband {
 public:
  static constexpr std::size_t kMostSent = 16;  ///< patches on their way to a station; older ones are forgotten
  static constexpr Micros kLivesMost{1'000'000};
  static constexpr double kKnown = 0.5, kLeastN = 0.1, kProbeM = 0.003, kProbeS = 0.06;

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
