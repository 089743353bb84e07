// The haptic tick. Operations and bytes of a tick, n = 2 r states, V vertices and T triangles of surface (8 bytes a number):
//
//   attach   flops  2 n^2 + 24 n + 36        Phi z; three n x 3 inputs; B_k^T q + B_d^T q'; K_p d + D_p d'
//            bytes  8 (n^2 + 15 n + 24)      Phi, inputs and drift, z read and written, B_k and B_d, K_p and D_p, tool
//   touch    flops  2 n^2 + 6 r V            Phi z; R_i q for every vertex
//     free     + 75 T                        nearest point of every triangle
//     contact  + 6 n r + 36 r + 6 n + 400    Psi0 R^T; R and R Psi0_q R^T; response lambda; normals and contact law; for each
//     contact
//            bytes  8 (n^2 + 3 n + 3 r V + 6 V + T)   and in contact + 8 n r (Psi0)
//
// Everything is read from the first-level cache when ticks follow each other at once, so the roofline is that cache's. `cold`
// ticks find nothing there: a buffer larger than the second-level cache is written before each, as other work on the machine does
// in the millisecond between two ticks.
#include <cmath>
#include <memory>
#include <vector>

#include "bench/fidelity/metrics.hpp"
#include "bench/micro/benchmarks.hpp"
#include "bench/micro/fixtures.hpp"
#include "bench/micro/machine.hpp"
#include "bench/micro/timer.hpp"
#include "client/core/haptic_tick.hpp"

namespace palpate {
namespace {

enum class Case { attach, stick, slide, free, eight };
constexpr Case kCases[] = {Case::attach, Case::stick, Case::slide, Case::free, Case::eight};
std::string name_of(Case c) {
  constexpr const char* kNames[] = {"attach", "touch_stick", "touch_slide", "touch_free", "touch_eight"};
  return kNames[static_cast<std::size_t>(c)];
}

/// A patch and one period of a tool path that keeps it in its case.
struct TickCase {
  Patch patch;
  std::vector<Vec3> path;
};

TickCase make_case(Case c) {
  TickCase result;
  result.patch = c == Case::attach ? grasp_patch() : c == Case::eight ? eight_touch_patch() : touch_patch();
  if (c == Case::stick) result.patch.friction = 10;
  if (c == Case::slide) result.patch.friction = 0.05;
  const double radius_m = c == Case::slide ? 0.004 : 0.0005;
  const Vec3 lift(0, 0, c == Case::free ? 0.02 : 0.0);
  constexpr int kPeriodTicks = 500;
  for (int i = 0; i < kPeriodTicks; ++i) {
    const double angle = 2 * M_PI * i / kPeriodTicks;
    result.path.push_back(result.patch.tool + lift + radius_m * Vec3(std::cos(angle) - 1, std::sin(angle), 0));
  }
  return result;
}

Work work_of(Case c, const Patch& patch) {
  const double n = patch.states(), r = patch.modes(), v = patch.surface.vertex_count, t = patch.surface.triangle_count;
  if (c == Case::attach) return {2 * n * n + 24 * n + 36, 8 * (n * n + 15 * n + 24)};
  const Work common{2 * n * n + 6 * r * v, 8 * (n * n + 3 * n + 3 * r * v + 6 * v + t)};
  if (c == Case::free) return {common.flops + 75 * t, common.bytes};
  const double contacts = 1 + patch.others.count;
  return {common.flops + contacts * (6 * n * r + 36 * r + 6 * n + 400), common.bytes + 8 * n * r};
}

/// Moves the tool along its path, one tick per call.
class Hand {
 public:
  Hand(const TickCase& c) : path_(c.path), t_(c.patch.stamp) {}
  ToolSample next() {
    t_ += kTick;
    if (++at_ == path_.size()) at_ = 0;
    return {t_, path_[at_]};
  }

 private:
  const std::vector<Vec3>& path_;
  std::size_t at_ = 0;
  Micros t_;
};

void report(benchmark::State& state, Case c, const Patch& patch, std::uint64_t contacts, double seconds) {
  const auto ticks = static_cast<double>(state.iterations());
  report_limit(state, work_of(c, patch), seconds / ticks);
  state.counters["states"] = patch.states();
  state.counters["contact"] = static_cast<double>(contacts) / ticks;
}

void player_tick(benchmark::State& state, Case c) {
  const TickCase tick = make_case(c);
  PatchPlayer player(tick.patch);
  Hand hand(tick);
  std::uint64_t contacts = 0;
  const ProcessorTimer timer;
  for (auto _ : state) contacts += player.advance(hand.next()).contact;
  report(state, c, tick.patch, contacts, timer.seconds());
}

/// Whole tick: mailbox, sample ring, player, fades, guard.
struct Station {
  LatestSlot<PatchPlayer> slot;
  SampleRing samples;
  HapticTick haptic{slot, samples, {8.5, 500, PassivityMode::on}};

  TickOutput tick(const ToolSample& sample) {
    const TickOutput out = haptic.tick(sample);
    ToolSample taken;
    samples.pop(taken);
    return out;
  }
};

Patch lasting(Patch patch) {
  patch.valid_for = Micros{std::numeric_limits<std::int64_t>::max() / 4};
  patch.trust_radius_m = kWorldExtentM;
  return patch;
}

void haptic_tick(benchmark::State& state, Case c) {
  TickCase tick = make_case(c);
  tick.patch = lasting(tick.patch);
  const auto station = std::make_unique<Station>();
  station->slot.back() = PatchPlayer(tick.patch);
  station->slot.publish();
  Hand hand(tick);
  std::uint64_t contacts = 0;
  const ProcessorTimer timer;
  for (auto _ : state) contacts += station->tick(hand.next()).contact;
  report(state, c, tick.patch, contacts, timer.seconds());
}

/// Times each tick by itself, after filling the caches with other data.
void haptic_tick_cold(benchmark::State& state, Case c) {
  TickCase tick = make_case(c);
  tick.patch = lasting(tick.patch);
  const auto station = std::make_unique<Station>();
  station->slot.back() = PatchPlayer(tick.patch);
  station->slot.publish();
  Hand hand(tick);
  std::vector<double> others(512 * 1024), each_ns;
  std::uint64_t contacts = 0;
  double sum = 0;
  for (auto _ : state) {
    for (double& x : others) x += 1;
    benchmark::ClobberMemory();
    const ToolSample sample = hand.next();
    const Timer timer;
    contacts += station->tick(sample).contact;
    each_ns.push_back(static_cast<double>(timer.ns()));
    sum += each_ns.back() * 1e-9;
    state.SetIterationTime(each_ns.back() * 1e-9);
  }
  report(state, c, tick.patch, contacts, sum);
  state.counters["p50_ns"] = percentile(each_ns, 0.5);
  state.counters["p99_ns"] = percentile(each_ns, 0.99);
}

/// Tick in which a new patch takes over: 10 ticks that the network side had not seen, one tick of both patches, and the copy.
void hand_over(benchmark::State& state, Case c) {
  constexpr int kUnseen = 10;
  TickCase tick = make_case(c);
  tick.patch = lasting(tick.patch);
  const auto station = std::make_unique<Station>();
  Hand hand(tick);
  PatchPlayer fresh(tick.patch);
  for (auto _ : state) {
    for (int k = 0; k < kUnseen; ++k) {
      const ToolSample sample = hand.next();
      station->tick(sample);
      if (k == 0) fresh.advance(sample);
    }
    station->slot.back() = fresh;
    station->slot.publish();
    const ToolSample sample = hand.next();
    const Timer timer;
    benchmark::DoNotOptimize(station->tick(sample));
    const double seconds = timer.seconds();
    state.SetIterationTime(seconds);
    fresh.advance(sample);
  }
  state.counters["player_bytes"] = sizeof(PatchPlayer);
}

}  // namespace

void add_tick_benchmarks() {
  using Function = void (*)(benchmark::State&, Case);
  for (const auto& [group, function] :
       {std::pair<const char*, Function>{"tick/player/", player_tick}, {"tick/whole/", haptic_tick}})
    for (const Case c : kCases) benchmark::RegisterBenchmark((group + name_of(c)).c_str(), function, c);
  for (const Case c : kCases)
    benchmark::RegisterBenchmark(("tick/cold/" + name_of(c)).c_str(), haptic_tick_cold, c)->UseManualTime()->Iterations(1000);
  benchmark::RegisterBenchmark("tick/hand_over/attach", hand_over, Case::attach)->UseManualTime()->Iterations(2000);
  benchmark::RegisterBenchmark("tick/hand_over/touch", hand_over, Case::stick)->UseManualTime()->Iterations(2000);
}

}  // namespace palpate
