// Test of the instrument itself: the guard detects everything that it must.
#include "tests/support/realtime_guard.hpp"

#include <atomic>
#include <catch2/catch.hpp>
#include <mutex>
#include <stdexcept>
#include <thread>
#include <vector>

using palpate::test::RealtimeFaults;
using palpate::test::RealtimeGuard;

namespace {
std::vector<int>* volatile kept = nullptr;  // prevents the compiler from removing the allocation
std::mutex mutex;

RealtimeFaults watched(void (*work)()) {
  RealtimeGuard guard;
  work();
  return guard.end();
}
}  // namespace

TEST_CASE("The guard sees allocations, locks and exceptions of its thread", "[realtime]") {
  if (!RealtimeGuard::active()) return;
  const RealtimeFaults allocated = watched([] { kept = new std::vector<int>(100); });
  CHECK(allocated.allocations == 2);
  CHECK(allocated.frees == 0);
  CHECK(watched([] { delete kept; }).frees == 2);
  CHECK(watched([] { const std::lock_guard lock(mutex); }).locks == 1);
  CHECK(watched([] {
          try {
            throw std::runtime_error("seen");
          } catch (const std::runtime_error&) {
          }
        }).throws == 1);
}

TEST_CASE("The guard sees nothing where nothing is, and nothing of other threads", "[realtime]") {
  CHECK(watched([] {}).none());
  std::atomic<bool> go{false}, done{false};
  std::thread other([&go, &done] {
    while (!go) std::this_thread::yield();
    delete new std::vector<int>(1000);
    done = true;
  });
  RealtimeGuard guard;
  go = true;
  while (!done) std::this_thread::yield();
  const RealtimeFaults seen = guard.end();
  other.join();
  CHECK(seen.none());
}
