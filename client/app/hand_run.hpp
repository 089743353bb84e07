// One hand of palpate-client: join, wait until the body can be felt, let the hand move, end safely, report.
#pragma once

#include <atomic>

#include "client/app/options.hpp"

namespace palpate {

/// How often what waits looks again.
inline constexpr Micros kPoll{20'000};

struct HandEnd {
  int code = 0;  ///< the exit code that it asks for
  /// Its device does not come back from a call, and no thread can be made to: nothing of it may be waited for.
  bool device_stuck = false;
};

/// Ends early, and well, once `stop` is set. Throws InputError when a report cannot be written.
HandEnd run_hand(const AppOptions& options, const std::atomic<bool>& stop);

}  // namespace palpate
