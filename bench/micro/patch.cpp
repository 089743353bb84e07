// A patch between the server's builder and the haptic thread. Server: encode. Client, off the haptic thread: decode (with the
// check in it), compile (the exact exponential of one tick), catch up with 200 ticks of the tool's own samples.
#include <array>
#include <memory>

#include "bench/micro/benchmarks.hpp"
#include "bench/micro/fixtures.hpp"
#include "client/intake/intake.hpp"
#include "common/wire/codec.hpp"

#include <benchmark/benchmark.h>

namespace palpate {
namespace {

constexpr int kCatchUpTicks = 200;

Patch patch_of(ContactKind kind) { return kind == ContactKind::attach ? grasp_patch() : touch_patch(); }

Message message_of(const Patch& patch) {
  Message message;
  message.instance = 1;
  message.station = 1;
  message.body = PatchMessage{patch};
  return message;
}

void encode_patch(benchmark::State& state, ContactKind kind) {
  const Message message = message_of(patch_of(kind));
  std::array<std::byte, kMaxDatagramBytes> bytes{};
  std::size_t size = 0;
  for (auto _ : state) benchmark::DoNotOptimize(size = encode(message, bytes));
  state.counters["wire_bytes"] = static_cast<double>(size);
}

void decode_patch(benchmark::State& state, ContactKind kind) {
  std::array<std::byte, kMaxDatagramBytes> bytes{};
  const std::size_t size = encode(message_of(patch_of(kind)), bytes);
  Message message;
  WireFault fault = WireFault::none;
  for (auto _ : state) fault = decode({bytes.data(), size}, message);
  if (fault != WireFault::none) state.SkipWithError(describe(fault));
}

void check_patch(benchmark::State& state, ContactKind kind) {
  const Patch patch = patch_of(kind);
  PatchFault fault = PatchFault::none;
  for (auto _ : state) benchmark::DoNotOptimize(fault = check(patch));
  if (fault != PatchFault::none) state.SkipWithError(describe(fault));
}

void compile_patch(benchmark::State& state, ContactKind kind) {
  const Patch patch = patch_of(kind);
  const auto player = std::make_unique<PatchPlayer>();
  for (auto _ : state) *player = PatchPlayer(patch);
  benchmark::DoNotOptimize(player->energy());
}

/// Everything that PatchIntake does with a patch of age kCatchUpTicks.
void take_patch(benchmark::State& state, ContactKind kind) {
  Patch patch = patch_of(kind);
  const auto slot = std::make_unique<LatestSlot<PatchPlayer>>();
  PatchIntake intake(*slot);
  for (int tick = -1; tick <= kCatchUpTicks; ++tick)
    intake.add_sample({patch.stamp + tick * kTick, patch.tool + Vec3(0, 0, 1e-6 * tick)});
  for (auto _ : state) {
    ++patch.seq;
    if (!intake.accept(patch, patch.stamp + kCatchUpTicks * kTick)) state.SkipWithError("the patch was not taken");
  }
  state.counters["ticks"] = kCatchUpTicks;
}

}  // namespace

void add_patch_benchmarks() {
  using Function = void (*)(benchmark::State&, ContactKind);
  for (const auto& [what, function] : {std::pair<const char*, Function>{"encode", encode_patch},
                                       {"decode", decode_patch},
                                       {"check", check_patch},
                                       {"compile", compile_patch},
                                       {"compile_and_catch_up", take_patch}})
    for (const auto& [kind, name] : {std::pair{ContactKind::attach, "attach"}, std::pair{ContactKind::touch, "touch"}})
      benchmark::RegisterBenchmark((std::string("patch/") + what + "/" + name).c_str(), function, kind);
}

}  // namespace palpate
