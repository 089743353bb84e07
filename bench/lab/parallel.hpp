// Independent runs of an experiment on the cores of the machine. Results do not depend on how many there are: run i writes to
// place i of the caller's own vector.
#pragma once

#include <cstddef>
#include <functional>

namespace palpate {

/// Calls run(0) ... run(count - 1), each once, `jobs` at a time (0: one a core). The first exception is thrown again once all
/// have ended.
void run_all(std::size_t count, const std::function<void(std::size_t)>& run, unsigned jobs = 0);

/// The same; `done` is told after each how many have ended, from one thread at a time.
void run_counted(std::size_t count, const std::function<void(std::size_t)>& run, unsigned jobs,
                 const std::function<void(std::size_t)>& done);

}  // namespace palpate
