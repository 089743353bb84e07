#include "client/io/watchdog.hpp"

#include <algorithm>

#include "client/io/end_signals.hpp"
#include "client/io/realtime.hpp"
#include "client/io/sleep_until.hpp"
#include "common/io/monotonic.hpp"

namespace palpate {

void Watchdog::start(bool realtime) {
  stop_ = false;
  thread_ = std::thread([this, realtime] {
    block_signals();
    if (realtime) request_realtime(1);
    run();
  });
}

void Watchdog::stop() {
  stop_ = true;
  if (thread_.joinable()) thread_.join();
}

bool Watchdog::resumes(bool& began_again) noexcept {
  const State state = state_.load(std::memory_order_acquire);
  began_again = state == State::halted;
  if (state == State::halting) return false;
  if (state == State::halted) {
    device_.resume();
    state_.store(State::watching, std::memory_order_release);
  }
  return true;
}

void Watchdog::run() noexcept {
  Micros due = monotonic_now(), awake_since = due;
  while (!stop_.load(std::memory_order_relaxed)) {
    due = std::max(due + kLookEvery, monotonic_now());
    sleep_until(due);
    const Micros now = monotonic_now(), ticked{ticked_us_.load(std::memory_order_acquire)};
    if (now - due > kMost) awake_since = now;  // the machine or the program stood still, not only the loop
    if (ticked == Micros{} || now - std::max(ticked, awake_since) <= kMost) continue;
    State watching = State::watching;
    if (!state_.compare_exchange_strong(watching, State::halting, std::memory_order_acq_rel)) continue;
    device_.halt();
    halts_.fetch_add(1, std::memory_order_relaxed);
    state_.store(State::halted, std::memory_order_release);
  }
}

}  // namespace palpate
