// What a room with many stations costs its server, part by part.
//
// The real room, server core and station cores in virtual time without delay: every station moves a tool of its own, its samples
// go up, its patches come down and are played. Sockets are left out; so is what the stations themselves do.
#pragma once

#include <array>

#include "bench/fidelity/replay.hpp"
#include "server/reduce/patch_part.hpp"

namespace palpate {

struct ServerLoad {
  int frames = 0;
  double step_ms = 0;                               ///< a frame: the body's own step
  std::array<double, kPatchParts> patch_ms{};       ///< a frame: what the patches of all stations take, by PatchPart
  double take_ms = 0;                               ///< a frame: datagrams taken (decoded, checked, put in order), ticks
  double emit_ms = 0;                               ///< a frame: datagrams made
  double up_bytes_per_s = 0, down_bytes_per_s = 0;  ///< of one station, UDP payload
  double patches = 0;                               ///< a frame

  double patches_ms() const;
  /// Everything but the body's step [ms a frame].
  double beside_step_ms() const { return patches_ms() + take_ms + emit_ms; }
};

/// Of the whole of the motions but the first kLoadSkip. `stopwatch` is that of this machine, of the calling thread. Of `options`
/// scheme, order, frame rate and progress count.
ServerLoad server_load(const Scene& scene, std::span<const Motion> motions, const ReplayOptions& options,
                       const Stopwatch& stopwatch);

inline constexpr Micros kLoadSkip{1'000'000};  ///< tools come down, stations join

}  // namespace palpate
