#include "bench/lab/parallel.hpp"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

#include "bench/output/progress.hpp"

namespace palpate {

void run_all(std::size_t count, const std::function<void(std::size_t)>& run, unsigned jobs, const std::string& what) {
  Progress progress(what);
  std::atomic<std::size_t> next{0}, ended{0};
  std::mutex mutex;
  std::exception_ptr failure;
  const auto work = [&] {
    for (std::size_t i = next++; i < count; i = next++) {
      try {
        run(i);
        progress.at(static_cast<double>(++ended) / static_cast<double>(count));
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

}  // namespace palpate
