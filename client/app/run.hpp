// What palpate-client does, once its command line is understood. Several hands of one person run side by side, each a station of
// its own with its own threads, report and recording (hand_run.hpp).
#pragma once

#include <atomic>
#include <vector>

#include "client/app/options.hpp"

namespace palpate {

/// --check-link: figures, then the verdict in words; 0 when link and machine serve, else 1.
int check_link(const AppOptions& options, const std::atomic<bool>& stop);

/// --reset: 0 when the body was put back to rest, else 1.
int reset_body(const AppOptions& options, const std::atomic<bool>& stop);

/// The program's exit code, of several hands the worst. Ends early, and well, once `stop` is set; a hand that fails ends the
/// others so. Throws InputError when a report cannot be written.
int run(const std::vector<AppOptions>& hands, const std::atomic<bool>& stop);

}  // namespace palpate
