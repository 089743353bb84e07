// palpate-client: the station of one hand. See --help, and docs/reference/devices.md and docs/reference/threads.md.
#include <atomic>

#include "client/app/device_check.hpp"
#include "client/app/options.hpp"
#include "client/app/run.hpp"
#include "client/io/end_signals.hpp"
#include "common/command_line/flags.hpp"

namespace {

std::atomic<bool> stop_asked{false};

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"the station of one hand: reads a haptic device at 1 kHz, plays the server's patches, writes the force",
               "palpate-client"};
  return palpate::run_program(app, [&] {
    const std::vector<palpate::AppOptions> hands = palpate::parse_options(app, argc, argv);
    palpate::end_by_signals(stop_asked);  // until here nothing needs an orderly end, and help may be written to a closed pipe
    const palpate::AppOptions& first = hands.front();
    if (first.list_devices) return palpate::list_devices();
    if (first.check_device) return palpate::check_device(first, stop_asked);
    if (first.check_link) return palpate::check_link(first, stop_asked);
    if (first.reset) return palpate::reset_body(first, stop_asked);
    return palpate::run(hands, stop_asked);
  });
}
