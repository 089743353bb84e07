// One run of palpate-client: join, wait until the body can be felt, let the hand move, end safely, report.
#pragma once

#include <atomic>

#include "client/app/options.hpp"

namespace palpate {

/// --check-link: figures, then the verdict in words; 0 when link and machine serve, else 1.
int check_link(const AppOptions& options, const std::atomic<bool>& stop);

/// --reset: 0 when the body was put back to rest, else 1.
int reset_body(const AppOptions& options, const std::atomic<bool>& stop);

/// The program's exit code. Ends early, and well, once `stop` is set. Throws InputError when the report cannot be written.
int run(const AppOptions& options, const std::atomic<bool>& stop);

}  // namespace palpate
