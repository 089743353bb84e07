// A patch's prediction of the server's next frame, compared with that frame: the free response made visible.
//
// A patch stamped t holds the body at t; the next one, stamped t', holds it at t'. The first is played from t to t' along the
// tool's actual path, without input from the server:
//     foreseen_i = position of vertex i of its surface then,      found_i = initial position of that vertex in the next patch
//     miss_i = |foreseen_i - found_i|,   over the vertices that both patches carry
// Both patches carry positions as the server computed them, to a float: no grid of the shape stream is in the miss. Vertices have
// no numbers in a patch; a vertex is matched to the nearest one of the next patch, nearer than a quarter of the shortest edge. A
// patch without modes, or of a grasp, has no surface that moves: it predicts only its force.
#pragma once

#include <optional>
#include <vector>

#include "client/core/client_core.hpp"

namespace palpate {

/// Two successive patches, and the inputs to play the first up to the second.
struct PatchPair {
  Patch patch, next;
  NonlinearTerms terms;             ///< terms of the first patch, if they arrived
  std::vector<ToolSample> samples;  ///< samples from the first stamp to the second
};

/// Detects successive patches on the network thread.
class PatchPairs {
 public:
  /// Call after every datagram that `core` received. Fills `pair` and returns true when a newer patch arrived while the last one
  /// was valid.
  bool take(const ClientCore& core, PatchPair& pair);

 private:
  std::optional<Patch> patch_;
  NonlinearTerms terms_;
};

struct ForeseenVertex {
  Vec3 foreseen = Vec3::Zero(), found = Vec3::Zero();  ///< [m]
  bool compared = false;                               ///< true: the next patch has this vertex too; otherwise `found` is invalid
};

struct Foresight {
  Micros stamp{}, at{};  ///< stamps of the patch and of the next one, in the client's clock
  Scheme scheme = Scheme::hold;
  int states = 0;
  Vec3 force = Vec3::Zero(), force_found = Vec3::Zero();  ///< force on the tool at the end [N]
  std::vector<ForeseenVertex> vertices;
  std::vector<Triangle> triangles;  ///< triangles over `vertices`
  int compared = 0;
  double miss_rms_m = 0, miss_max_m = 0;
};
/// Plays the first patch of the pair up to the second. Allocates; not for the haptic thread.
Foresight foresee(const PatchPair& pair);

/// The foresights of the last second.
class Foresights {
 public:
  void add(Foresight foresight);
  /// Returns the foresight of the frame last passed at a moment of the client's clock; nullptr when there was none recently.
  const Foresight* at(Micros moment) const;

 private:
  static constexpr std::size_t kKept = 64;
  static constexpr Micros kForget{500'000};

  std::vector<Foresight> kept_;  ///< newest last
};

}  // namespace palpate
