// Runs the independent runs of an experiment on all cores. Results do not depend on the number of cores: run i writes to element
// i of the caller's own vector.
#pragma once

#include <cstddef>
#include <functional>
#include <string>

namespace palpate {

/// Calls run(0) ... run(count - 1), each once, `jobs` at a time (0: one per core), and shows how many have ended (progress.hpp).
/// The first exception is rethrown after all have ended.
void run_all(std::size_t count, const std::function<void(std::size_t)>& run, unsigned jobs = 0,
             const std::string& what = "the runs");

}  // namespace palpate
