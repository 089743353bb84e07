// A thread pool for pieces of work that take tens of microseconds and follow on each other's heels: its threads look out for the
// next one for as long as that takes, and only then sleep.
//
// Of P parts thread t of T begins with those from t P / T on and, when they are done, helps the others with theirs: from piece to
// piece most parts stay with a thread, and with them what its caches hold.
#pragma once

#include <atomic>
#include <cstdint>
#include <thread>
#include <vector>

#include "common/base/thread_pool.hpp"

namespace palpate {

class SpinningThreadPool final : public ThreadPool {
 public:
  static constexpr std::size_t kMostParts = 0x7FFF;
  /// Starts size - 1 threads. Throws std::runtime_error where the system has not so many.
  explicit SpinningThreadPool(std::size_t size);
  ~SpinningThreadPool() override;
  SpinningThreadPool(const SpinningThreadPool&) = delete;
  SpinningThreadPool& operator=(const SpinningThreadPool&) = delete;

  std::size_t size() const override { return helpers_.size() + 1; }
  /// kMostParts at most.
  void run(std::size_t parts, const std::function<void(std::size_t)>& work) override;

 private:
  /// From the top: which piece of work it is (32 bits), how many parts that has, how many of a thread's own were taken (16 each).
  /// Who adds one has taken a part of the piece that the ticket says, or, where the thread has no more, nothing: whatever it knew
  /// before.
  struct alignas(64) Ticket {
    std::atomic<std::uint64_t> value{0};
  };
  void end();
  void help(std::size_t self);
  void take_parts(std::size_t self);
  void take_parts_of(std::size_t thread);

  std::vector<Ticket> tickets_;  // of each thread, the caller's first
  alignas(64) std::atomic<std::uint32_t> done_{0};
  std::atomic<const std::function<void(std::size_t)>*> work_{nullptr};
  std::atomic<bool> stop_{false};
  std::vector<std::thread> helpers_;
};

}  // namespace palpate
