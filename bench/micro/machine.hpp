// Peak performance of this machine, measured in the same run as everything that is compared with it (the roofline model).
//
//     a computation of F operations on B bytes takes at least   limit = max(F / peak, B / bandwidth)
//
// peak       multiply-adds on independent registers at the vector width of this build, two operations each
// bandwidth  triad a = b + s c on arrays that together fit the first-level cache, 24 bytes per element
// One core, double precision. The latency of dependent operations, the larger part of a small computation, is not modelled.
#pragma once

#include <benchmark/benchmark.h>

namespace palpate {

struct Machine {
  double peak_gflops = 0, near_gb_s = 0, far_gb_s = 0;  ///< far: triad on arrays larger than any cache
};

/// Measured at the first call.
const Machine& machine();

/// Floating-point operations and bytes of one call.
struct Work {
  double flops = 0, bytes = 0;
};

/// Sets the counters `flops`, `bytes`, `GFLOP/s`, `GB/s`, `limit_ns` and `of_limit` (limit / measured) from `seconds` per call.
void report_limit(benchmark::State& state, const Work& work, double seconds);

}  // namespace palpate
