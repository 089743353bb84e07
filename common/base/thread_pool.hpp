// Threads that share one piece of work, as an interface: cores receive a pool and create no threads.
#pragma once

#include <cstddef>
#include <functional>

namespace palpate {

class ThreadPool {
 public:
  virtual ~ThreadPool() = default;
  /// Number of threads that work at once, including the caller.
  virtual std::size_t size() const = 0;
  /// Runs work(0) ... work(parts - 1), each once, in any order and in parallel; all are done on return. It must not throw. For
  /// one caller at a time.
  virtual void run(std::size_t parts, const std::function<void(std::size_t)>& work) = 0;
};

}  // namespace palpate
