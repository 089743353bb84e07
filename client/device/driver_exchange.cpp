#include "client/device/driver_exchange.hpp"

#include <cmath>

namespace palpate {

DriverExchange::DriverExchange(double driver_hz) noexcept
    : stale_turns_(static_cast<int>(std::lround(driver_hz * seconds(kStaleAfter)))) {
  last_.state = DeviceState::not_ready;
  last_.reason = "it starts";
}

Wrench DriverExchange::turn(const DeviceReading& reading) noexcept {
  readings_.back() = reading;
  readings_.publish();
  if (const Wrench* newest = forces_.take()) {
    force_ = *newest;
    still_turns_ = 0;
  } else if (still_turns_ < stale_turns_ && ++still_turns_ == stale_turns_) {
    force_ = {};
  }
  return reading.ok() && !halted_.load(std::memory_order_acquire) ? force_ : Wrench();
}

DeviceReading DriverExchange::read() noexcept {
  if (const DeviceReading* newest = readings_.take()) {
    last_ = *newest;
    silent_reads_ = 0;
  } else if (silent_reads_ < kSilentReads && ++silent_reads_ == kSilentReads && last_.state != DeviceState::gone) {
    last_.state = DeviceState::gone;
    last_.reason = "its driver has not been heard of for 20 ms";
  }
  return last_;
}

void DriverExchange::write(const Wrench& wrench) noexcept {
  forces_.back() = last_.ok() ? finite_parts(wrench) : Wrench();
  forces_.publish();
}

}  // namespace palpate
