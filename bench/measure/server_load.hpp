// Cost of a room with many stations for its server, part by part.
//
// The real room, server core and station cores in virtual time without delay: every station moves its own tool, sends samples,
// and receives and plays patches. Sockets and the work of the stations themselves are not counted.
#pragma once

#include <array>

#include "bench/fidelity/replay.hpp"
#include "server/reduce/build_phase.hpp"

namespace palpate {

struct ServerLoad {
  int frames = 0;
  double step_ms = 0;                               ///< per frame: the body's step
  std::array<double, kPatchParts> patch_ms{};       ///< per frame: the patches of all stations, by BuildPhase
  double take_ms = 0;                               ///< per frame: datagrams received (decoded, checked, ordered), ticks
  double emit_ms = 0;                               ///< per frame: datagrams made
  double up_bytes_per_s = 0, down_bytes_per_s = 0;  ///< per station, UDP payload
  double patches = 0;                               ///< per frame

  double patches_ms() const;
  /// Everything but the body's step [ms per frame].
  double beside_step_ms() const { return patches_ms() + take_ms + emit_ms; }
};

/// Measures the motions without the first kLoadSkip. `stopwatch` measures the calling thread. Of `options` scheme, order, frame
/// rate and progress are used.
ServerLoad server_load(const Scene& scene, std::span<const Motion> motions, const ReplayOptions& options,
                       const Stopwatch& stopwatch);

inline constexpr Micros kLoadSkip{1'000'000};  ///< time for tools to come down and stations to join

}  // namespace palpate
