// Cost of the trust channel: a datagram sealed, opened and refused, the cookie of a stranger, a handshake at the server. A tick
// has 1000 us; the network thread, which does all this, is separate from it.
#include "common/trust/server_channel.hpp"

#include <benchmark/benchmark.h>

#include "bench/micro/benchmarks.hpp"

namespace palpate {
namespace {

constexpr Micros kMoment{1'000'000};
using Packet = std::vector<std::uint8_t>;

SecretKey key_of_byte(std::uint8_t byte) {
  SecretKey key;
  key.bytes.fill(byte);
  return key;
}

Transport transport(std::uint8_t send, std::uint8_t receive) {
  return Transport(key_of_byte(send), key_of_byte(receive), 1, 1, kMoment);
}

void seal(benchmark::State& state, std::size_t bytes) {
  Transport keys = transport(1, 2);
  const Packet plain(bytes);
  Packet sealed(bytes + kDataOverhead);
  for (auto _ : state) benchmark::DoNotOptimize(keys.seal(plain, sealed));
}

/// Number of datagrams opened in a row, sealed beforehand.
void open(benchmark::State& state, std::size_t bytes) {
  constexpr int kAtOnce = 512;
  Transport from = transport(1, 2), to = transport(2, 1);
  const Packet plain(bytes);
  std::vector<Packet> sealed(kAtOnce, Packet(bytes + kDataOverhead));
  Packet opened(bytes);
  bool newest = false;
  int next = kAtOnce;
  for (auto _ : state) {
    if (next == kAtOnce) {
      state.PauseTiming();
      for (Packet& packet : sealed) from.seal(plain, packet);
      next = 0;
      state.ResumeTiming();
    }
    if (to.open(sealed[static_cast<std::size_t>(next++)], opened, newest) != OpenFault::none) state.SkipWithError("not opened");
  }
}

void refuse_forged(benchmark::State& state) {
  Transport from = transport(1, 2), to = transport(3, 4);
  Packet sealed(kMaxDatagramBytes + kDataOverhead), opened(kMaxDatagramBytes);
  from.seal(Packet(kMaxDatagramBytes), sealed);
  bool newest = false;
  for (auto _ : state)
    if (to.open(sealed, opened, newest) != OpenFault::forged) state.SkipWithError("opened");
}

/// Answers an Init without a cookie, the only computation that a stranger can request without limit.
void answer_stranger(benchmark::State& state) {
  ServerChannel server({key_of_byte(1), {}, {}}, system_random(), [] { return std::int64_t{0}; });
  ClientChannel client({key_of_byte(2), server.self(), {}}, 5, system_random(), kMoment);
  Packet init(kInitBytes), answer(kMaxSealedBytes), plain(kMaxSealedBytes);
  client.tick(kMoment);
  client.emit(init, kMoment);
  ChannelAddress to;
  for (auto _ : state) {
    server.take(init, {}, kMoment, plain);
    if (server.emit(answer, to) != kCookieBytes) state.SkipWithError("no cookie");
  }
}

void respond(benchmark::State& state) {
  const SecretKey server = key_of_byte(1);
  const std::array<std::uint8_t, kHeadBytes> prologue{};
  Packet payload(kInitPayloadBytes), first(kNoiseFirstBytes + kInitPayloadBytes), second(kNoiseSecondBytes + 4);
  NoiseInitiator client(key_of_byte(2), public_of(server), key_of_byte(3), prologue);
  if (!client.write(payload, first)) state.SkipWithError("no first message");
  for (auto _ : state) {
    NoiseResponder responder(server, prologue);
    const bool done = responder.read_sender(first) && responder.read_payload(first, payload) &&
                      responder.write(key_of_byte(4), Bytes(payload).first(4), second);
    if (!done) state.SkipWithError("no handshake");
  }
}

}  // namespace

void add_trust_benchmarks() {
  for (const std::size_t bytes : {std::size_t{100}, std::size_t{512}, kMaxDatagramBytes}) {
    benchmark::RegisterBenchmark(("trust/seal/" + std::to_string(bytes)).c_str(), seal, bytes);
    benchmark::RegisterBenchmark(("trust/open/" + std::to_string(bytes)).c_str(), open, bytes);
  }
  benchmark::RegisterBenchmark("trust/refuse_forged", refuse_forged);
  benchmark::RegisterBenchmark("trust/answer_stranger", answer_stranger);
  benchmark::RegisterBenchmark("trust/respond", respond)->Unit(benchmark::kMicrosecond);
}

}  // namespace palpate
