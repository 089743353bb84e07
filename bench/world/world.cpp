#include "bench/world/world.hpp"

#include <algorithm>

#include "common/base/random.hpp"

namespace palpate {
namespace {

constexpr Micros kClientWake{1'000};  // the net side of a client looks at its sample ring as often as its haptic side ticks

// A clock that reads up to 1000 s, on whole milliseconds: the haptic tick of a station stays on the world's.
Micros draw_offset(std::uint64_t seed) { return Micros{1000 * static_cast<std::int64_t>(Random(seed).uniform(1, 1e6))}; }

}  // namespace

WorldStation::WorldStation(const ClientOptions& options, std::unique_ptr<MotionDevice> device, const LinkSpec& link,
                           Micros offset)
    : device_(std::move(device)),
      offset_(offset),
      up_(link),
      down_([&] {
        LinkSpec back = link;
        ++back.seed;
        return back;
      }()),
      core_(options, offset) {}

World::World(const Scene& scene, const WorldOptions& options)
    : options_(options),
      server_offset_(draw_offset(options.seed)),
      room_(scene),
      server_(facts_of(scene, home_of(scene)), {options.seed, options.rate_hz}) {}

WorldStation& World::add_station(const ClientOptions& options, std::unique_ptr<MotionDevice> device, const LinkSpec& link) {
  const Micros drawn = draw_offset(options_.seed + 1 + stations_.size());
  stations_.push_back(std::unique_ptr<WorldStation>(new WorldStation(options, std::move(device), link, drawn)));
  return *stations_.back();
}

Micros World::next_moment() const {
  Micros next = now_ + kClientWake - Micros{now_.count() % kClientWake.count()};
  if (!in_flight_.empty()) next = std::min(next, in_flight_.next_due());
  if (!computing_.empty()) next = std::min(next, computing_.next_due());
  next = std::min(next, server_.deadline() - server_offset_);
  for (const auto& s : stations_) next = std::min(next, s->core_.deadline() - s->offset_);
  return std::max(next, now_ + Micros{1});
}

void World::run_until(Micros until) {
  if (!begun_) at_moment();
  begun_ = true;
  for (Micros next = next_moment(); next <= until; next = next_moment()) {
    now_ = next;
    at_moment();
  }
}

void World::at_moment() {
  deliver();
  if (now_.count() % kTick.count() == 0) haptic_ticks();
  do {
    client_net();
    server_net();
  } while (deliver());
}

bool World::deliver() {
  bool any = false;
  while (auto datagram = in_flight_.pop(now_)) {
    any = true;
    if (datagram->to_server)
      server_.take(datagram->bytes, datagram->station + 1, server_clock());
    else
      stations_[datagram->station]->core_.take(datagram->bytes, stations_[datagram->station]->clock(now_));
  }
  return any;
}

void World::haptic_ticks() {
  for (const auto& s : stations_) {
    const Micros t = s->clock(now_);
    const DeviceReading reading = s->device_->read(t);
    if (!reading.ok) continue;
    const TickOutput out = s->run_tick(s->core_.haptic(), {t, reading.position});
    s->device_->write(out.force);
    if (s->on_tick) s->on_tick(now_, reading.position, out);
  }
}

void World::send(std::size_t station, bool to_server, std::span<const std::byte> bytes) {
  WorldStation& s = *stations_[station];
  for (const Micros at : (to_server ? s.up_ : s.down_).schedule(now_, bytes.size()))
    in_flight_.push(at, {station, to_server, {bytes.begin(), bytes.end()}});
}

void World::client_net() {
  std::array<std::byte, kMaxDatagramBytes> out;
  for (std::size_t k = 0; k < stations_.size(); ++k) {
    const Micros t = stations_[k]->clock(now_);
    stations_[k]->core_.tick(t);
    while (const std::size_t size = stations_[k]->core_.emit(out, t)) send(k, true, {out.data(), size});
  }
}

void World::server_net() {
  const Micros t = server_clock();
  if (auto done = computing_.pop(now_)) server_.finish(std::move(done->result), t);
  server_.tick(t);
  if (!room_started_) room_.start(server_.body_time());
  room_started_ = true;
  if (auto job = server_.next_job(t)) {
    FrameResult result = run_frame(room_, *job);
    if (options_.compute > Micros{})
      computing_.push(now_ + options_.compute, {std::move(result)});
    else
      server_.finish(std::move(result), t);
  }
  std::array<std::byte, kMaxDatagramBytes> out;
  PeerId to = 0;
  while (const std::size_t size = server_.emit(out, to, t)) send(to - 1, false, {out.data(), size});
}

}  // namespace palpate
