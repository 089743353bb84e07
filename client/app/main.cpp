// palpate-client: the station of one hand. See --help, and docs/reference/devices.md and docs/reference/threads.md.
#include <atomic>
#include <csignal>
#include <exception>
#include <iostream>

#include "client/app/options.hpp"
#include "client/app/run.hpp"
#include "common/base/error.hpp"

namespace {

std::atomic<bool> stop_asked{false};
static_assert(std::atomic<bool>::is_always_lock_free, "set from a signal handler");

void ask_to_stop(int) { stop_asked = true; }

}  // namespace

int main(int argc, char** argv) {
  std::signal(SIGINT, ask_to_stop);
  std::signal(SIGTERM, ask_to_stop);
  try {
    const auto options = palpate::parse_options(argc, argv);
    if (!options) return 0;
    if (options->check_link) return palpate::check_link(*options, stop_asked);
    if (options->reset) return palpate::reset_body(*options, stop_asked);
    return palpate::run(*options, stop_asked);
  } catch (const palpate::InputError& error) {
    std::cerr << "palpate-client: " << error.what() << '\n';
    return 2;
  } catch (const std::exception& error) {
    std::cerr << "palpate-client: " << error.what() << '\n';
    return 1;
  }
}
