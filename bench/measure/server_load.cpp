#include "bench/measure/server_load.hpp"

#include <array>
#include <memory>
#include <numeric>

namespace palpate {
namespace {

constexpr Micros kLoadBegin{1'000'000};

/// Bytes of a datagram and the station at its other end.
struct Datagram {
  PeerId station = 0;
  std::vector<std::byte> bytes;
};

class Loopback {
 public:
  Loopback(const Scene& scene, std::span<const Motion> motions, const ReplayOptions& options, const Stopwatch& stopwatch)
      : room_(scene),
        server_(facts_of(scene, home_of(scene)), {repeatable(1), options.rate_hz}),
        motions_(motions),
        stopwatch_(stopwatch) {
    room_.start(kLoadBegin);
    room_.listen([this](BuildPhase part) { enter(&load.patch_ms[static_cast<std::size_t>(part)]); });
    for (std::size_t k = 0; k < motions.size(); ++k) {
      ClientOptions client;
      client.hello.station = "station " + std::to_string(k + 1);
      client.hello.scheme = options.scheme;
      client.hello.order = static_cast<std::uint16_t>(options.order);
      clients_.push_back(std::make_unique<ClientCore>(client, kLoadBegin));
    }
  }

  void step(Micros now) {
    std::array<std::byte, kMaxDatagramBytes> bytes;
    std::vector<Datagram> up, down;
    for (std::size_t k = 0; k < clients_.size(); ++k) {
      clients_[k]->haptic().tick({now, motions_[k].position(now - kLoadBegin)});
      clients_[k]->tick(now);
      while (const auto size = clients_[k]->emit(bytes, now)) up.push_back({k + 1, {bytes.begin(), bytes.begin() + size}});
    }
    enter(&load.take_ms);
    for (const Datagram& d : up) server_.take(d.bytes, d.station, now);
    server_.tick(now);
    if (const auto job = server_.next_job(now)) frame(*job, now);
    enter(&load.emit_ms);
    PeerId to = 0;
    while (const auto size = server_.emit(bytes, to, now)) down.push_back({to, {bytes.begin(), bytes.begin() + size}});
    enter(nullptr);
    for (const Datagram& d : down) clients_[d.station - 1]->take(d.bytes, now);
  }

  ServerCounts counts() const { return server_.counts(); }

  ServerLoad load;  // sums [ms]

 private:
  void frame(const FrameJob& job, Micros now) {
    enter(&load.step_ms);
    FrameResult result = room_.simulate(job);
    if (result.failed) throw std::runtime_error("server_load: a frame did not converge");
    enter(&load.patch_ms[static_cast<std::size_t>(BuildPhase::other)]);
    room_.build_patches(job, result);
    for (const StationFrame& station : result.stations) load.patches += station.patch.has_value();
    ++load.frames;
    enter(&load.take_ms);
    server_.finish(std::move(result), now);
  }

  /// Adds the time since the last call to the part entered then, and enters `part`.
  void enter(double* part) {
    const std::int64_t now = stopwatch_();
    if (part_) *part_ += static_cast<double>(now - entered_ns_) * 1e-6;
    part_ = part;
    entered_ns_ = now;
  }

  Room room_;
  ServerCore server_;
  std::span<const Motion> motions_;
  const Stopwatch& stopwatch_;
  std::vector<std::unique_ptr<ClientCore>> clients_;
  double* part_ = nullptr;
  std::int64_t entered_ns_ = 0;
};

}  // namespace

double ServerLoad::patches_ms() const { return std::accumulate(patch_ms.begin(), patch_ms.end(), 0.0); }

ServerLoad server_load(const Scene& scene, std::span<const Motion> motions, const ReplayOptions& options,
                       const Stopwatch& stopwatch) {
  Loopback loop(scene, motions, options, stopwatch);
  Micros length = Micros::max();
  for (const Motion& motion : motions) length = std::min(length, motion.duration());
  Micros t = kLoadBegin;
  const auto step = [&] {
    loop.step(t);
    if (options.progress) options.progress("the room", seconds(t - kLoadBegin) / seconds(length));
  };
  for (; t < kLoadBegin + kLoadSkip; t += kTick) step();
  loop.load = {};
  const ServerCounts before = loop.counts();
  for (; t <= kLoadBegin + length; t += kTick) step();
  const ServerCounts after = loop.counts();
  ServerLoad load = loop.load;
  const double per_frame = 1.0 / std::max(1, load.frames);
  load.step_ms *= per_frame;
  for (double& part : load.patch_ms) part *= per_frame;
  load.take_ms *= per_frame;
  load.emit_ms *= per_frame;
  load.patches *= per_frame;
  const double per_station = 1 / (seconds(length - kLoadSkip) * static_cast<double>(motions.size()));
  load.up_bytes_per_s = static_cast<double>(after.bytes_received - before.bytes_received) * per_station;
  load.down_bytes_per_s = static_cast<double>(after.bytes_sent - before.bytes_sent) * per_station;
  return load;
}

}  // namespace palpate
