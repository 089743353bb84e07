// Target time of a frame: the moment up to which the tools of a room are known, or nearly known.
//
// With one punctual station (its newest sample came within kLateAfter) the target is that sample: waiting gains nothing, and
// nothing is known beyond it. With several it is the moment up to which all are known, but no station is waited for longer than
// its own jitter buffer, nor more than kMostWait longer than the quickest station:
//
//     target = max( min_i newest_i,  now - max_i min(buffer_i, min_j buffer_j + kMostWait) )       i, j punctual stations
//
// so a slow hand makes a quick hand's patches at most that much older. If all stations are late, the target is now minus the lag
// of the least late one; without any tool it is now. A frame ends at most kLongestFrame after the body's time.
#pragma once

#include "server/core/station.hpp"

namespace palpate {

inline constexpr Micros kLateAfter{150'000};  ///< silence after which the tool is taken to stand still
inline constexpr Micros kMostWait{20'000};    ///< most age that a slower station's samples add to patches
inline constexpr Micros kLongestFrame{500'000};

Micros playout(const Stations& stations, Micros body_time, Micros now);

}  // namespace palpate
