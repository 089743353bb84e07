// What a patch said of the server's next frame, beside that frame: the free response made visible.
//
// A patch stamped t holds the body at t; the next one, stamped t', holds it at t'. The first is played on from t to t' with the
// tool where it was meanwhile, without a word from the server:
//     foreseen_i = where it then has vertex i of its surface,      found_i = where the next patch begins with that vertex
//     miss_i = |foreseen_i - found_i|,   over the vertices that both patches carry
// Both patches carry positions as the server computed them, to a float: no grid of the shape stream is in the miss. Vertices have
// no numbers in a patch; one is found again as the nearest of the next patch, nearer than a quarter of the least edge. A patch
// without modes, or of a grasp, has no surface that moves: there is only its force.
#pragma once

#include <optional>
#include <vector>

#include "client/core/client_core.hpp"

namespace palpate {

/// Two patches that follow on one another, and what the first needs to be played up to the second.
struct PatchPair {
  Patch patch, next;
  NonlinearTerms terms;             ///< of the first, where they came
  std::vector<ToolSample> samples;  ///< from the first stamp to the second
};

/// Notices on the network thread that a patch has followed another.
class PatchPairs {
 public:
  /// After every datagram that `core` took: whether a newer patch came while the last one was valid; then `pair` is filled.
  bool take(const ClientCore& core, PatchPair& pair);

 private:
  std::optional<Patch> patch_;
  NonlinearTerms terms_;
};

struct ForeseenVertex {
  Vec3 foreseen = Vec3::Zero(), found = Vec3::Zero();  ///< [m]
  bool compared = false;                               ///< the next patch has it too; else `found` means nothing
};

struct Foresight {
  Micros stamp{}, at{};  ///< of the patch and of the next one, in the client's clock
  Scheme scheme = Scheme::hold;
  int states = 0;
  Vec3 force = Vec3::Zero(), force_found = Vec3::Zero();  ///< on the tool at the end [N]
  std::vector<ForeseenVertex> vertices;
  std::vector<Triangle> triangles;  ///< over them
  int compared = 0;
  double miss_rms_m = 0, miss_max_m = 0;
};
/// Plays the first patch of the pair up to the second. Allocates; not for the haptic thread.
Foresight foresee(const PatchPair& pair);

/// The foresights of the last second.
class Foresights {
 public:
  void add(Foresight foresight);
  /// That of the frame last passed at a moment of the client's clock; nullptr when there was none for a while.
  const Foresight* at(Micros moment) const;

 private:
  static constexpr std::size_t kKept = 64;
  static constexpr Micros kForget{500'000};

  std::vector<Foresight> kept_;  ///< newest last
};

}  // namespace palpate
