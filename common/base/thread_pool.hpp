// Threads that share one piece of work, seen from the work: cores are given one and make none.
#pragma once

#include <cstddef>
#include <functional>

namespace palpate {

class ThreadPool {
 public:
  virtual ~ThreadPool() = default;
  /// How many work at once, the caller among them.
  virtual std::size_t size() const = 0;
  /// work(0) ... work(parts - 1), each once, in any order and at the same time; all are done on return. It must not throw. For
  /// one caller at a time.
  virtual void run(std::size_t parts, const std::function<void(std::size_t)>& work) = 0;
};

}  // namespace palpate
