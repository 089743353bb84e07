#include "bindings/core/live_viewer.hpp"

#include <stdexcept>

#include "bindings/core/keys_named.hpp"
#include "common/io/monotonic.hpp"

namespace palpate {

LiveViewer::LiveViewer(const ViewerOptions& options)
    : udp_(options.server, options.station, options.room, true, keys_named(options.key_file, options.token_file)) {}

void LiveViewer::wait(Micros most) {
  const Micros end = monotonic_now() + most;
  do {
    udp_.pump();
    if (udp_.core().link() == LinkState::refused)
      throw std::runtime_error(udp_.server() + " refuses the viewer: " + udp_.core().refusal());
    if (udp_.core().ready()) return;
    udp_.nap(end);
  } while (monotonic_now() < end);
  throw std::runtime_error(udp_.no_answer());
}

bool LiveViewer::update(Micros most) {
  const Micros end = monotonic_now() + most;
  for (udp_.pump(); monotonic_now() < end; udp_.pump()) udp_.nap(end);
  auto moment = std::make_shared<ViewMoment>();
  if (!udp_.core().show(monotonic_now(), *moment)) return false;
  if (!udp_.core().heard_lately(monotonic_now())) moment->tools.clear();
  moment_ = std::move(moment);
  return true;
}

}  // namespace palpate
