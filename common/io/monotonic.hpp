// The clock of both programs: std::chrono::steady_clock in microseconds since its own epoch.
#pragma once

#include <chrono>

#include "common/base/types.hpp"

namespace palpate {

inline Micros monotonic_now() { return std::chrono::duration_cast<Micros>(std::chrono::steady_clock::now().time_since_epoch()); }
inline std::chrono::steady_clock::time_point monotonic_at(Micros t) { return std::chrono::steady_clock::time_point(t); }

}  // namespace palpate
