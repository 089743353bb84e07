// What the sessions of a room cost a server: everything of a frame but the body's step and the making of patches.
#pragma once

#include "bench/measure/replay.hpp"

namespace palpate {

struct SessionCost {
  double cpu_ms_per_s = 0;                          ///< of all stations: datagrams taken, ticks, patches and beats encoded
  double up_bytes_per_s = 0, down_bytes_per_s = 0;  ///< of one station, UDP payload
};

/// The real cores of `stations` stations and their server for a second of virtual time without delay, a copy of `patch` for each
/// station and frame. Client threads are not counted. `stopwatch` is that of this machine.
SessionCost session_cost(const Scene& scene, const Patch& patch, int stations, double rate_hz, const Stopwatch& stopwatch);

}  // namespace palpate
