#include "bench/micro/machine.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <utility>

#include "bench/micro/timer.hpp"

namespace palpate {
namespace {

constexpr int kRepeats = 7;  // the best counts, as there may be other load on the machine

using Packet = Eigen::internal::packet_traits<double>::type;

/// Seconds for `rounds` multiply-adds on each of the independent chains, one per index, enough to hide their latency.
template <std::size_t... kChain>
double chains_s(int rounds, std::index_sequence<kChain...>) {
  Packet x[sizeof...(kChain)];
  ((x[kChain] = Eigen::internal::pset1<Packet>(0.5)), ...);
  const Packet scale = Eigen::internal::pset1<Packet>(0.999), add = Eigen::internal::pset1<Packet>(1e-3);
  const Timer timer;
  for (int round = 0; round < rounds; ++round) ((x[kChain] = Eigen::internal::pmadd(x[kChain], scale, add)), ...);
  const double seconds = timer.seconds();
  for (Packet& p : x) benchmark::DoNotOptimize(p);
  return seconds;
}

double peak_gflops() {
  constexpr int kChains = 12, kRounds = 400'000, kWidth = static_cast<int>(sizeof(Packet) / sizeof(double));
  double best = 0;
  for (int repeat = 0; repeat < kRepeats; ++repeat)
    best = std::max(best, 2e-9 * kWidth * kChains * kRounds / chains_s(kRounds, std::make_index_sequence<kChains>{}));
  return best;
}

double triad_gb_s(Eigen::Index elements, int rounds) {
  Eigen::ArrayXd a = Eigen::ArrayXd::Zero(elements), b = Eigen::ArrayXd::Ones(elements), c = b;
  double best = 0;
  for (int repeat = 0; repeat < kRepeats; ++repeat) {
    const Timer timer;
    for (int round = 0; round < rounds; ++round) {
      a = b + 0.5 * c;
      benchmark::DoNotOptimize(a.data());
      benchmark::ClobberMemory();
    }
    best = std::max(best, 24.0 * static_cast<double>(elements) * rounds / timer.seconds() * 1e-9);
  }
  return best;
}

}  // namespace

const Machine& machine() {
  static const Machine measured{peak_gflops(), triad_gb_s(500, 20'000), triad_gb_s(6'000'000, 1)};
  return measured;
}

void report_limit(benchmark::State& state, const Work& work, double seconds) {
  const double limit_ns = std::max(work.flops / machine().peak_gflops, work.bytes / machine().near_gb_s);
  state.counters["flops"] = work.flops;
  state.counters["bytes"] = work.bytes;
  state.counters["GFLOP/s"] = work.flops / seconds * 1e-9;
  state.counters["GB/s"] = work.bytes / seconds * 1e-9;
  state.counters["limit_ns"] = limit_ns;
  state.counters["of_limit"] = limit_ns * 1e-9 / seconds;
}

}  // namespace palpate
