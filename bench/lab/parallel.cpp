#include "bench/lab/parallel.hpp"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace palpate {

void run_all(std::size_t count, const std::function<void(std::size_t)>& run, unsigned jobs) {
  std::atomic<std::size_t> next{0};
  std::mutex mutex;
  std::exception_ptr failure;
  const auto work = [&] {
    for (std::size_t i = next++; i < count; i = next++) {
      try {
        run(i);
      } catch (...) {
        const std::lock_guard lock(mutex);
        if (!failure) failure = std::current_exception();
        next = count;
      }
    }
  };
  std::vector<std::jthread> threads;
  const std::size_t at_once = jobs > 0 ? jobs : std::max(1u, std::thread::hardware_concurrency());
  for (std::size_t k = 1; k < std::min(at_once, count); ++k) threads.emplace_back(work);
  work();
  threads.clear();
  if (failure) std::rethrow_exception(failure);
}

void run_counted(std::size_t count, const std::function<void(std::size_t)>& run, unsigned jobs,
                 const std::function<void(std::size_t)>& done) {
  std::mutex mutex;
  std::size_t ended = 0;
  const auto run_and_count = [&](std::size_t i) {
    run(i);
    const std::lock_guard lock(mutex);
    done(++ended);
  };
  run_all(count, run_and_count, jobs);
}

}  // namespace palpate
