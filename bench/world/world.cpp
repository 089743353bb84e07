#include "bench/world/world.hpp"

#include <algorithm>

#include "common/base/random.hpp"

namespace palpate {
namespace {

constexpr Micros kClientWake{1'000};  // the net side of a client polls its sample ring as often as its haptic side ticks

// Offset of a clock, up to 1000 s, in whole milliseconds: without drift the haptic ticks of a station coincide with the world's.
Micros draw_offset(std::uint64_t seed) { return Micros{1000 * static_cast<std::int64_t>(Random(seed).uniform(1, 1e6))}; }

}  // namespace

World::World(const Scene& scene, const WorldOptions& options)
    : options_(options),
      scene_(scene),
      clock_(draw_offset(options.seed), options.server_drift_ppm),
      room_(scene),
      instance_(options.seed),
      server_(new_server()),
      trust_(options.keys ? std::make_unique<WorldTrust>(*options.keys, options.seed) : nullptr) {
  know_keys();
}

void World::know_keys() {
  if (!trust_) return;
  server_->know_keys([trust = trust_.get()](PeerId peer) { return trust->server().key_of(peer); });
}

std::unique_ptr<ServerCore> World::new_server() const {
  const ServerOptions options{.draw = repeatable(instance_), .rate_hz = options_.rate_hz, .deadband = options_.deadband};
  auto server = std::make_unique<ServerCore>(facts_of(scene_, home_of(scene_)), options);
  server->expect_costs(options_.expected_costs);
  return server;
}

WorldStation& World::add_station(const ClientOptions& options, std::unique_ptr<MotionDevice> device, const LinkSpec& link) {
  LinkSpec back = link;
  ++back.seed;
  return add_station(options, std::move(device), link, back, 0);
}

WorldStation& World::add_station(const ClientOptions& options, std::unique_ptr<MotionDevice> device, const LinkSpec& up,
                                 const LinkSpec& down, double drift_ppm) {
  const WorldClock clock(draw_offset(options_.seed + 1 + stations_.size()), drift_ppm);
  return add(std::unique_ptr<WorldStation>(new WorldStation(options, std::move(device), up, down, clock, now_)));
}

WorldStation& World::add_shadow(const ClientOptions& options, const WorldStation& owner, const LinkSpec& up,
                                const LinkSpec& down) {
  auto shadow = std::unique_ptr<WorldStation>(new WorldStation(options, nullptr, up, down, owner.clock_, now_));
  shadow->owner_ = &owner;
  return add(std::move(shadow));
}

WorldStation& World::add(std::unique_ptr<WorldStation> station) {
  // This moment's tick is over once the world has begun.
  if (begun_) station->next_tick_ += Micros{1};
  station->next_tick_ = (station->next_tick_ + kTick - Micros{1}) / kTick * kTick;
  stations_.push_back(std::move(station));
  if (trust_) {
    const auto owner =
        std::find_if(stations_.begin(), stations_.end(), [this](const auto& s) { return s.get() == stations_.back()->owner_; });
    const std::size_t k = stations_.size() - 1;
    trust_->add_station(owner != stations_.end() ? static_cast<std::size_t>(owner - stations_.begin()) : k,
                        stations_.back()->options_.hello.station);
  }
  return *stations_.back();
}

Micros World::next_moment() const {
  Micros next = now_ + kClientWake - Micros{now_.count() % kClientWake.count()};
  if (!events_.empty()) next = std::min(next, events_.next_due());
  if (!in_flight_.empty()) next = std::min(next, in_flight_.next_due());
  if (server_up_ && !server_stalled_) {
    if (!computing_.empty()) next = std::min(next, computing_.next_due());
    if (const Micros due = server_->deadline(); due != Micros::max()) next = std::min(next, clock_.world(due));
  }
  for (const auto& s : stations_) {
    if (s->net_runs()) next = std::min(next, s->clock_.world(s->core_->deadline()));
    if (s->haptic_runs()) next = std::min(next, s->clock_.world(s->next_tick_));
  }
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
  while (auto event = events_.pop(now_)) (*event)();
  deliver();
  haptic_ticks();
  do {
    client_net();
    server_net();
  } while (deliver());
}

bool World::deliver() {
  bool any = false;
  while (server_up_ && !server_stalled_ && !waiting_.empty()) {
    Datagram datagram = std::move(waiting_.front());
    waiting_.pop_front();
    any |= hand_to_server(datagram);
  }
  for (const auto& s : stations_)
    while (s->net_runs() && !s->waiting_.empty()) {
      Datagram datagram{s->waiting_.front().number, s->peer_, false, std::move(s->waiting_.front().bytes),
                        std::move(s->waiting_.front().sealed)};
      s->waiting_.pop_front();
      any |= hand_to_station(datagram);
    }
  while (auto datagram = in_flight_.pop(now_))
    any |= datagram->to_server ? hand_to_server(*datagram) : hand_to_station(*datagram);
  return any;
}

/// Returns true if the server received it.
bool World::hand_to_server(Datagram& datagram) {
  if (server_up_ && !server_stalled_) {
    tell(DatagramEvent::Kind::delivered, datagram);
    take_at_server(datagram);
    return true;
  }
  if (server_up_ && waiting_.size() < kSocketBuffer)
    waiting_.push_back(std::move(datagram));
  else
    tell(DatagramEvent::Kind::lost, datagram);
  return false;
}

/// Returns true if the station received it.
bool World::hand_to_station(Datagram& datagram) {
  WorldStation& s = station_of(datagram.peer);
  const bool listens = s.up_ && !s.asleep() && s.peer_ == datagram.peer;
  if (listens && s.net_runs()) {
    tell(DatagramEvent::Kind::delivered, datagram);
    take_at_station(peers_[datagram.peer - 1], datagram);
    return true;
  }
  if (listens && s.waiting_.size() < kSocketBuffer)
    s.waiting_.push_back({datagram.number, std::move(datagram.bytes), std::move(datagram.sealed)});
  else
    tell(DatagramEvent::Kind::lost, datagram);
  return false;
}

void World::tell(DatagramEvent::Kind kind, const Datagram& datagram) const {
  if (datagram.bytes.empty()) return;
  if (on_datagram) on_datagram(now_, {kind, datagram.number, peers_[datagram.peer - 1], datagram.to_server, datagram.bytes});
}

void World::haptic_ticks() {
  for (const auto& s : stations_) {
    if (!s->haptic_runs()) continue;
    const Micros t = s->clock(now_);
    if (t < s->next_tick_) continue;
    s->next_tick_ = t / kTick * kTick + kTick;  // late ticks are skipped, never run in a row
    s->reading_ = s->owner_ ? s->owner_->reading_ : s->device_->read(t);
    if (!s->reading_.ok()) continue;
    const Device* const device = (s->owner_ ? s->owner_ : s.get())->device_.get();
    const bool turns = device && device->caps().has_orientation;
    const TickOutput out =
        s->run_tick(s->core_->haptic(),
                    {t, s->reading_.position, turns ? Orientation(s->reading_.orientation) : Orientation(), s->reading_.opening});
    if (s->device_) s->core_->haptic().buttons().say(t, s->reading_.buttons);
    if (s->device_) s->device_->write(out.wrench());
    if (s->on_tick) s->on_tick(now_, s->reading_.position, out);
  }
}

void World::send(PeerId peer, bool to_server, std::span<const std::byte> bytes, std::vector<std::byte> sealed) {
  WorldStation& s = station_of(peer);
  const Datagram datagram{datagrams_++, peer, to_server, {bytes.begin(), bytes.end()}, std::move(sealed)};
  tell(DatagramEvent::Kind::sent, datagram);
  see_wire(peer, to_server, datagram.sealed);
  if (to_server ? s.cut_up_ : s.cut_down_) return tell(DatagramEvent::Kind::lost, datagram);
  const Deliveries deliveries = (to_server ? s.up_link_ : s.down_link_).schedule(now_, bytes.size());
  if (deliveries.count == 0) tell(DatagramEvent::Kind::lost, datagram);
  for (const Micros at : deliveries) in_flight_.push(at, datagram);
}

PeerId World::peer_of(std::size_t station) {
  PeerId& peer = stations_[station]->peer_;
  if (peer != 0) return peer;
  peers_.push_back(station);
  return peer = peers_.size();
}

void World::client_net() {
  std::array<std::byte, kMaxDatagramBytes> out;
  for (std::size_t k = 0; k < stations_.size(); ++k) {
    WorldStation& s = *stations_[k];
    if (!s.net_runs()) continue;
    const Micros t = s.clock(now_);
    s.core_->tick(t);
    if (trust_ && !ready_to_send(k, t)) continue;
    while (const std::size_t size = s.core_->emit(out, t)) {
      const std::span<const std::byte> datagram(out.data(), size);
      send(peer_of(k), true, datagram, trust_ ? trust_->seal_up(k, datagram, t) : std::vector<std::byte>{});
    }
    if (s.leaving_) s.crash();
  }
}

/// Charges the cost of the frame to the server, in virtual time.
void World::charge(const FrameJob& job, FrameResult& result) const {
  const FrameTimes times = options_.frame_times ? options_.frame_times(now_, job, result) : FrameTimes{.step = options_.compute};
  result.step_took = times.step;
  result.patches_took = times.patches;
  result.rollouts_took = times.rollouts;
}

void World::server_net() {
  if (!server_up_ || server_stalled_) return;
  const Micros t = server_clock();
  if (auto done = computing_.pop(now_)) server_->finish(std::move(done->result), t);
  server_->tick(t);
  if (!room_started_) room_.start(server_->body_time());
  room_started_ = true;
  if (auto job = server_->next_job(t)) {
    FrameResult result = run_frame(room_, *job);
    charge(*job, result);
    if (const Micros took = result.step_took + result.patches_took; took > Micros{})
      computing_.push(now_ + took, {std::move(result)});
    else
      server_->finish(std::move(result), t);
  }
  std::array<std::byte, kMaxDatagramBytes> out;
  const std::vector<ChannelPeer> ended = trust_ ? server_channel(t) : std::vector<ChannelPeer>{};
  PeerId to = 0;
  while (const std::size_t size = server_->emit(out, to, t)) {
    if (trust_)
      send_sealed(to, {out.data(), size}, t);
    else
      send(to, false, {out.data(), size});
  }
  for (const ChannelPeer peer : ended) trust_->server().forget(peer);
}

void World::kill_server() {
  server_up_ = server_stalled_ = false;
  waiting_.clear();
  computing_ = {};
}

void World::start_server(bool keep_body) {
  ++instance_;
  server_ = new_server();
  if (trust_) trust_->new_server();
  ends_.clear();
  know_keys();
  if (!keep_body) room_ = Room(scene_);
  room_started_ = false;
  server_up_ = true;
}

}  // namespace palpate
