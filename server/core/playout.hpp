// How far a frame goes: the moment up to which the tools of a room are known, or as good as known.
//
// With one punctual station (its newest sample came within kLateAfter) up to that sample: nothing is gained by waiting, and
// nothing is known beyond. With several as far as all are known, but it waits for nobody longer than that station's jitter
// buffer, nor longer than kMostWait beyond the quickest station's:
//
//     target = max( min_i newest_i,  now - max_i min(buffer_i, min_j buffer_j + kMostWait) )       i, j punctual stations
//
// so that a slow hand costs a quick one that much age and no more. When all are late: now - the lag of the least late one. With
// no tool at all: now. A frame is cut at kLongestFrame after the body's time.
#pragma once

#include "server/core/station.hpp"

namespace palpate {

inline constexpr Micros kLateAfter{150'000};  ///< no newer sample for so long: the tool stands still
inline constexpr Micros kMostWait{20'000};    ///< that patches are older for the sake of a slower station's samples
inline constexpr Micros kLongestFrame{500'000};

Micros playout(const Stations& stations, Micros body_time, Micros now);

}  // namespace palpate
