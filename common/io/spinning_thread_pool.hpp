// A thread pool for pieces of work that last tens of microseconds and follow each other closely: its threads spin for the next
// one for about that long before they sleep.
//
// Of P parts, thread t of T begins with those from t P / T on and helps the others when these are done: most parts stay on one
// thread from piece to piece, which keeps its caches warm.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <thread>
#include <vector>

#include "common/base/thread_pool.hpp"

namespace palpate {

class SpinningThreadPool final : public ThreadPool {
 public:
  static constexpr std::size_t kMostParts = 0x7FFF;
  /// Starts size - 1 threads. Throws std::runtime_error when the system refuses them.
  explicit SpinningThreadPool(std::size_t size);
  ~SpinningThreadPool() override;
  SpinningThreadPool(const SpinningThreadPool&) = delete;
  SpinningThreadPool& operator=(const SpinningThreadPool&) = delete;

  /// Number of processors of this machine, 1 if it is unknown.
  static std::size_t processors() { return std::max(1u, std::thread::hardware_concurrency()); }
  std::size_t size() const override { return helpers_.size() + 1; }
  /// Runs at most kMostParts parts.
  void run(std::size_t parts, const std::function<void(std::size_t)>& work) override;

 private:
  /// From the top: number of the piece of work (32 bits), its number of parts, number of the thread's own parts that were claimed
  /// (16 each). Adding one claims a part of the piece in the ticket, or, when the thread has none left, nothing; no earlier
  /// knowledge of the ticket is needed.
  struct alignas(64) Ticket {
    std::atomic<std::uint64_t> value{0};
  };
  void end();
  void help(std::size_t self);
  void take_parts(std::size_t self);
  void take_parts_of(std::size_t thread);

  std::vector<Ticket> tickets_;  // one per thread, the caller's first
  alignas(64) std::atomic<std::uint32_t> done_{0};
  std::atomic<const std::function<void(std::size_t)>*> work_{nullptr};
  std::atomic<bool> stop_{false};
  std::vector<std::thread> helpers_;
};

}  // namespace palpate
