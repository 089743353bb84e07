#include "client/view/view_core.hpp"

#include <algorithm>
#include <utility>

namespace palpate {
namespace {

constexpr Micros kSecond{1'000'000};

}  // namespace

ViewCore::ViewCore(std::string station, Micros now, std::string room, bool alike)
    : heard_(now), answered_(now), next_hello_(now), next_beat_(now), next_mesh_(now) {
  hello_.station = std::move(station);
  hello_.room = std::move(room);
  hello_.role = Role::viewer;
  hello_.alike = alike;
}

void ViewCore::tick(Micros now) {
  if (left_) return;
  if (link_ == ViewLink::joined && now - heard_ >= kLostAfter) join_again(now);
  if (link_ != ViewLink::joined) {
    if (now < next_hello_) return;
    hello_due_ = true;
    next_hello_ = now + (link_ == ViewLink::refused ? kRetryEvery : kHelloEvery);
    return;
  }
  if (!mesh_.complete() && now >= next_mesh_) ask_for_mesh(now);
  if (now >= next_state_) {
    state_due_ = true;
    next_state_ = Micros::max();
  }
  if (now >= next_beat_) {
    beat_due_ = true;
    next_beat_ = now + kBeatEvery;
  }
}

Micros ViewCore::deadline() const {
  if (left_) return Micros::max();
  if (link_ != ViewLink::joined) return next_hello_;
  const Micros alive_at = std::min({next_beat_, next_state_, heard_ + kLostAfter});
  return mesh_.complete() ? alive_at : std::min(alive_at, next_mesh_);
}

void ViewCore::leave() {
  leave_due_ = link_ == ViewLink::joined;
  left_ = true;
  hello_due_ = beat_due_ = state_due_ = false;
  asking_.clear();
}

void ViewCore::show_channel(ShapeChannel channel) {
  if (channel == channel_) return;
  channel_ = channel;
  shapes_.show(channel);
  if (link_ == ViewLink::joined) state_due_ = true;
}

void ViewCore::take(std::span<const std::byte> bytes, Micros now) {
  ++counts_.received;
  counts_.bytes_received += bytes.size();
  if (left_) return;
  Message message;
  const WireFault fault = decode(bytes, message);
  if (fault != WireFault::none) {
    ++counts_.dropped[static_cast<std::size_t>(fault)];
    if (fault == WireFault::version && link_ != ViewLink::joined) {
      link_ = ViewLink::refused;
      refusal_ = "the server speaks another wire version than " + std::to_string(kWireVersion);
    }
    return;
  }
  if (!sent_.has(message.clock.echo)) {
    ++counts_.unproven;
    return;
  }
  answered_ = now;
  const auto* const refusal = std::get_if<Refuse>(&message.body);
  sent_away_ = refusal && refusal->reason == RefuseReason::shutting_down;
  if (std::holds_alternative<Welcome>(message.body)) return take_welcome(message, now);
  if (refusal) return take_refuse(message, now);
  if (link_ != ViewLink::joined || message.instance != instance_ || message.station != station_) {
    ++counts_.stale;
    return;
  }
  heard_ = now;
  clock_.take(message.clock, now);
  if (const auto* piece = std::get_if<MeshPiece>(&message.body)) take_mesh(*piece, now);
  if (const auto* room = std::get_if<RoomView>(&message.body)) room_ = *room;
  if (const auto* beat = std::get_if<Beat>(&message.body)) reset_.hear(beat->resets);
  const auto* const piece = std::get_if<ShapePiece>(&message.body);
  // Without the mesh a shape is meaningless: it counts as lost, and its contents are sent again.
  if (piece && !mesh_.complete()) return;
  note(message.seq, now);
  if (piece) take_shape(*piece, now);
  const auto* const tools = std::get_if<Tools>(&message.body);
  if (!tools || !mesh_.complete()) return;
  take_shape(*tools, now);
  playback_.add(*tools, now);
}

/// Notes that a datagram arrived, to report it to the server.
void ViewCore::note(std::uint32_t seq, Micros now) {
  const auto ahead = static_cast<std::int32_t>(seq - state_.newest);
  if (!heard_any_ || ahead > 0) {
    state_.have = heard_any_ && ahead < 64 ? state_.have << ahead | 1 : 1;
    state_.newest = seq;
    heard_any_ = true;
  } else if (ahead > -64) {
    state_.have |= std::uint64_t{1} << -ahead;
  }
  if (next_state_ == Micros::max()) next_state_ = now + kStateEvery;
}

void ViewCore::take_mesh(const MeshPiece& piece, Micros now) {
  const bool had = mesh_.complete();
  mesh_.take(piece);
  if (asked_ > 0 && --asked_ == 0) next_mesh_ = now;
  if (had || !mesh_.complete()) return;
  shapes_.rest(mesh_.mesh().vertices);
  rest_.clear();
  for (const MeshVertex& vertex : mesh_.mesh().vertices) rest_.push_back(vertex.rest.cast<float>());
}

void ViewCore::take_welcome(const Message& message, Micros now) {
  if (link_ == ViewLink::joined) {
    if (message.instance == instance_ && message.station == station_)
      heard_ = now;
    else
      ++counts_.stale;
    return;
  }
  const auto& welcome = std::get<Welcome>(message.body);
  const bool same_mesh = counts_.joins > 0 && welcome.mesh_hash == welcome_.mesh_hash && welcome.vertices == welcome_.vertices &&
                         welcome.triangles == welcome_.triangles;
  const bool same_session = message.instance == instance_ && message.station == station_;
  if (!same_session) {
    clock_ = ClockSync{};
    reset_.forget();
    seq_out_ = 0;
    heard_any_ = false;
  }
  instance_ = message.instance;
  station_ = message.station;
  welcome_ = welcome;
  if (!welcome.station.empty()) hello_.station = welcome.station;
  if (!same_mesh) {
    mesh_.expect(welcome.vertices, welcome.triangles, welcome.mesh_hash);
    rest_.clear();
    playback_.clear();
    ++mesh_version_;
  }
  if (!same_mesh || !same_session) shapes_.rest(mesh_.complete() ? mesh_.mesh().vertices : std::vector<MeshVertex>{});
  refusal_.clear();
  link_ = ViewLink::joined;
  ++counts_.joins;
  hello_due_ = false;
  asked_ = 0;
  heard_ = next_beat_ = next_mesh_ = now;
  clock_.take(message.clock, now);
}

void ViewCore::take_refuse(const Message& message, Micros now) {
  const auto& refusal = std::get<Refuse>(message.body);
  const bool gone = refusal.reason == RefuseReason::unknown_station || refusal.reason == RefuseReason::shutting_down;
  if (link_ == ViewLink::joined) {
    if (gone && message.station == station_)
      join_again(now);
    else
      ++counts_.stale;
    return;
  }
  if (refusal.reason == RefuseReason::unknown_station || message.station != 0) {
    ++counts_.stale;
    return;
  }
  link_ = ViewLink::refused;
  refusal_ = refusal.message;
  next_hello_ = std::max(next_hello_, now + kRetryEvery);
}

template <class Part>
void ViewCore::take_shape(const Part& part, Micros now) {
  finished_.clear();
  shapes_.take(part, finished_);
  for (Shape& shape : finished_) {
    playback_.add(std::move(shape), now);
    shapes_came_.push_back(now);
  }
  while (!shapes_came_.empty() && now - shapes_came_.front() >= kSecond) shapes_came_.pop_front();
}

int ViewCore::shapes_lately(Micros now) const {
  return static_cast<int>(std::count_if(shapes_came_.begin(), shapes_came_.end(), [now](Micros t) { return now - t < kSecond; }));
}

void ViewCore::join_again(Micros now) {
  link_ = ViewLink::joining;
  next_hello_ = now;
  beat_due_ = state_due_ = false;
  next_state_ = Micros::max();
  asking_.clear();
}

void ViewCore::ask_for_mesh(Micros now) {
  const auto pieces = mesh_.missing(kMeshWindow);
  asking_.assign(pieces.begin(), pieces.end());
  asked_ = pieces.size();
  next_mesh_ = now + kMeshRetry;
}

Micros ViewCore::lateness(Micros now) const {
  return clock_.locked() ? now - clock_.from_peer(playback_.moment(now)) : playback_.delay();
}

std::size_t ViewCore::emit(std::span<std::byte> out, Micros now) {
  if (std::exchange(leave_due_, false)) return say(Leave{}, out, now);
  if (std::exchange(hello_due_, false)) return say(hello_, out, now);
  if (link_ == ViewLink::joined)
    if (const auto resets = reset_.due(now)) return say(Reset{*resets}, out, now);
  if (std::exchange(beat_due_, false)) return say(Beat{}, out, now);
  if (std::exchange(state_due_, false)) return say_state(out, now);
  if (asking_.empty()) return 0;
  const MeshRequest request{asking_.front()};
  asking_.pop_front();
  return say(request, out, now);
}

std::size_t ViewCore::say_state(std::span<std::byte> out, Micros now) {
  state_.channels = channel_ == ShapeChannel::position ? std::uint8_t{0} : bit_of(channel_);
  state_.kbit_s = kbit_s_;
  return say(state_, out, now);
}

std::size_t ViewCore::say(Payload body, std::span<std::byte> out, Micros now) {
  const bool stranger = std::holds_alternative<Hello>(body);
  const Message message{stranger ? 0 : instance_, stranger ? 0 : station_, seq_out_, clock_.stamp(now), std::move(body)};
  const std::size_t size = encode(message, out);
  if (size == 0) return 0;
  sent_.add(now);
  ++seq_out_;
  ++counts_.sent;
  return size;
}

}  // namespace palpate
