// Counts how fast a driver answers. One thread adds, any thread reads; neither waits.
#pragma once

#include <atomic>
#include <cstdint>

#include "client/device/device.hpp"

namespace palpate {

class ExchangeCounter {
 public:
  void add(Micros trip) noexcept {
    answers_.fetch_add(1, std::memory_order_relaxed);
    total_us_.fetch_add(trip.count(), std::memory_order_relaxed);
    if (trip.count() > most_us_.load(std::memory_order_relaxed)) most_us_.store(trip.count(), std::memory_order_relaxed);
  }
  ExchangeFigures figures() const noexcept {
    return {answers_.load(std::memory_order_relaxed), Micros{total_us_.load(std::memory_order_relaxed)},
            Micros{most_us_.load(std::memory_order_relaxed)}};
  }

 private:
  std::atomic<std::uint64_t> answers_{0};
  std::atomic<std::int64_t> total_us_{0}, most_us_{0};
};

}  // namespace palpate
