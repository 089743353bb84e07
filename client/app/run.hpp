// One run of palpate-client: join, wait until the body can be felt, let the hand move, end safely, report.
#pragma once

#include <atomic>

#include "client/app/options.hpp"

namespace palpate {

/// The program's exit code. Ends early, and well, once `stop` is set. Throws InputError when the report cannot be written.
int run(const AppOptions& options, const std::atomic<bool>& stop);

}  // namespace palpate
