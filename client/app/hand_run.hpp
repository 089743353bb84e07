// One hand of palpate-client: joins, waits until the body can be felt, lets the hand move, ends safely and reports.
#pragma once

#include <atomic>

#include "client/app/common_start.hpp"
#include "client/app/options.hpp"

namespace palpate {

/// Polling interval of everything that waits.
inline constexpr Micros kPoll{20'000};

struct HandEnd {
  int code = 0;  ///< exit code of the program as far as this hand decides it
  /// True when the device does not return from a call and no thread can be made to: no part of it may be waited for.
  bool device_stuck = false;
};

/// Runs one hand, which begins to move at the common moment. Ends early, but normally, once `stop` is set. Throws InputError when
/// a report cannot be written.
HandEnd run_hand(const AppOptions& options, CommonStart& start, const std::atomic<bool>& stop);

}  // namespace palpate
