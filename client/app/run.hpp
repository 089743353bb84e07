// The tasks of palpate-client after its command line has been parsed. Several hands of one person run in parallel, each as a
// station of its own with its own threads, report and recording (hand_run.hpp). They begin to move at one moment, at which their
// times are 0, and a joint summary lists them.
#pragma once

#include <atomic>
#include <vector>

#include "client/app/options.hpp"

namespace palpate {

/// --check-link: prints figures, then the verdict in words; returns 0 when link and machine are good enough, else 1.
int check_link(const AppOptions& options, const std::atomic<bool>& stop);

/// --reset: returns 0 when the body was put back to rest, else 1.
int reset_body(const AppOptions& options, const std::atomic<bool>& stop);

/// Runs all hands and returns the program's exit code, the worst of theirs. Ends early, but normally, once `stop` is set; a hand
/// that fails ends the others in the same way. Throws InputError when a report cannot be written.
int run(const std::vector<AppOptions>& hands, const std::atomic<bool>& stop);

}  // namespace palpate
