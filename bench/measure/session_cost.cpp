#include "bench/measure/session_cost.hpp"

#include <array>
#include <memory>

namespace palpate {
namespace {

constexpr Micros kBegin{1'000'000}, kWarm{1'500'000}, kMeasured{1'000'000};

struct Loopback {
  ServerCore server;
  std::vector<std::unique_ptr<ClientCore>> clients;
  const Patch& patch;
  const Stopwatch& stopwatch;
  std::int64_t server_ns = 0;

  template <class Work>
  void timed(const Work& work) {
    const auto begin = stopwatch();
    work();
    server_ns += stopwatch() - begin;
  }

  void step(Micros now) {
    std::array<std::byte, kMaxDatagramBytes> bytes;
    for (std::size_t k = 0; k < clients.size(); ++k) {
      clients[k]->haptic().tick({now, patch.tool});
      clients[k]->tick(now);
      while (const auto size = clients[k]->emit(bytes, now)) timed([&] { server.take({bytes.data(), size}, k + 1, now); });
    }
    std::optional<FrameJob> job;
    timed([&] {
      server.tick(now);
      job = server.next_job(now);
    });
    if (job) {
      FrameResult result;
      result.stamp = job->target;
      for (const StationJob& station : job->stations) {
        StationFrame frame{station.id, patch, {}, patch.tool, patch.force, true};
        frame.patch->stamp = job->target;
        result.stations.push_back(frame);
      }
      timed([&] { server.finish(std::move(result), now); });
    }
    while (true) {
      PeerId to = 0;
      std::size_t size = 0;
      timed([&] { size = server.emit(bytes, to, now); });
      if (size == 0) return;
      clients[to - 1]->take({bytes.data(), size}, now);
    }
  }
};

}  // namespace

SessionCost session_cost(const Scene& scene, const Patch& patch, int stations, double rate_hz, const Stopwatch& stopwatch) {
  Loopback loop{{facts_of(scene, home_of(scene)), {1, rate_hz}}, {}, patch, stopwatch};
  for (int k = 0; k < stations; ++k) {
    ClientOptions options;
    options.hello.station = "station " + std::to_string(k + 1);
    loop.clients.push_back(std::make_unique<ClientCore>(options, kBegin));
  }
  for (Micros t = kBegin; t < kWarm; t += kTick) loop.step(t);
  loop.server_ns = 0;
  const ServerCounts before = loop.server.counts();
  for (Micros t = kWarm; t < kWarm + kMeasured; t += kTick) loop.step(t);
  const ServerCounts& after = loop.server.counts();
  const double per_station = 1 / (seconds(kMeasured) * stations);
  return {static_cast<double>(loop.server_ns) * 1e-6 / seconds(kMeasured),
          static_cast<double>(after.bytes_received - before.bytes_received) * per_station,
          static_cast<double>(after.bytes_sent - before.bytes_sent) * per_station};
}

}  // namespace palpate
