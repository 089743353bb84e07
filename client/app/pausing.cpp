#include "client/app/pausing.hpp"

#include <atomic>
#include <csignal>
#include <thread>

#include "common/io/monotonic.hpp"

namespace palpate {
namespace {

std::atomic<bool> asked{false};
std::atomic<int> running{0}, waiting{0};
std::atomic<unsigned> pauses{0};

}  // namespace

void begin_pauses(int hands) {
  running = hands;
  std::signal(SIGTSTP, [](int) { asked = true; });
}

void hand_ended() { --running; }

bool pause_asked() { return asked; }

void pause(HapticLoop* loop) {
  constexpr Micros kMost{200'000};
  const unsigned before = pauses;
  const auto until = [&](const auto& done) {
    for (const Micros begin = monotonic_now(); !done() && monotonic_now() - begin < kMost;) std::this_thread::sleep_for(kTick);
  };
  if (loop) {
    loop->hold(true);
    until([&] { return loop->at_zero(); });
  }
  if (++waiting < running) until([&] { return pauses != before; });
  if (asked.exchange(false)) {
    std::raise(SIGSTOP);
    ++pauses;
  }
  --waiting;
  if (loop) loop->hold(false);
}

}  // namespace palpate
