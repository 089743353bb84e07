// Who is in the room: handshake, what stations send, and leaving.
#include <algorithm>
#include <string>
#include <utility>

#include "server/core/mesh_pieces.hpp"
#include "server/core/server_core.hpp"

namespace palpate {
namespace {

constexpr std::size_t kMostReplies = 2 * kMaxStations;
constexpr std::size_t kMostMeshPieces = 64;  // asked for and not yet sent, a viewer

/// Names aside.
bool same(const Hello& a, const Hello& b) {
  return a.role == b.role && a.scheme == b.scheme && a.order == b.order && a.shadow_of == b.shadow_of && a.room == b.room &&
         a.alike == b.alike;
}

/// "hand-2" and "hand" are both like "hand".
std::string without_number(const std::string& name) {
  const std::size_t last = name.find_last_not_of("0123456789");
  const bool numbered = last != std::string::npos && last > 0 && last + 1 < name.size() && name[last] == '-';
  return numbered ? name.substr(0, last) : name;
}

/// As few datagrams for each patch as lose no more than kPatchesLost of the patches where each loses `share` of the datagrams.
int copies_for(double share) {
  int copies = 1;
  for (double lost = share; lost > kPatchesLost && copies < kPatchCopiesMost; lost *= share) ++copies;
  return copies;
}

/// Of whatever scheme it may get.
int most_states_for(SchemeAsked scheme, ContactKind contact) {
  const auto most = [contact](Scheme s) { return 2 * max_port_modes(contact, s); };
  return scheme ? most(*scheme) : std::min(most(Scheme::port), most(Scheme::hyper));
}

}  // namespace

void ServerCore::take(std::span<const std::byte> bytes, PeerId from, Micros now) {
  Message message;
  const auto fault = decode(bytes, message);
  take(fault, message, bytes.size(), from, now);
}

void ServerCore::take(WireFault fault, const Message& message, std::size_t size, PeerId from, Micros now) {
  ++counts_.received;
  counts_.bytes_received += size;
  if (fault != WireFault::none) {
    ++counts_.dropped[static_cast<std::size_t>(fault)];
    if (fault == WireFault::version)
      refuse(message, from,
             {RefuseReason::version, "this server speaks wire version " + std::to_string(kWireVersion) + ", the station another"},
             size);
    return;
  }
  if (std::holds_alternative<Hello>(message.body)) return take_hello(message, from, size, now);
  const auto known = stations_.find(message.station);
  if (known != stations_.end() && known->second.peer == from && message.instance == options_.instance)
    return take_from(known->second, message, now);
  ++counts_.unknown_station;
  if (!std::holds_alternative<Leave>(message.body))
    refuse(message, from, {RefuseReason::unknown_station, "this station is not in the room"}, size);
}

void ServerCore::take_hello(const Message& message, PeerId from, std::size_t size, Micros now) {
  Hello hello = std::get<Hello>(message.body);
  const std::string asked = hello.station;
  Station* old = asked_before(hello, from);
  const bool again = old != nullptr;
  if (!again) {
    if (hello.alike) hello.station = free_name(asked);
    old = find(hello.station);
    const bool for_us = hello.room.empty() || hello.room == options_.room;
    const bool taken = for_us && old && old->peer != from && now - old->heard <= kSilentAfter;
    const auto no = taken ? Refuse{RefuseReason::name_taken, "station \"" + hello.station + "\" is in the room already"}
                          : objection(hello, old);
    if (no) {
      tell(RecordedEventKind::refused, 0, hello, no->message, now);
      return refuse(message, from, *no, size);
    }
    if (old) {
      tell(RecordedEventKind::silent, old->id, old->hello, "another takes its name", now);
      stations_.erase(old->id);
    }
    ++counts_.joins;
    if (is_idle()) wake(now);
    Station& fresh = stations_[++last_id_];
    fresh.id = last_id_;
    fresh.peer = from;
    fresh.hello = hello;
    fresh.asked = asked;
    fresh.next_report = now + kLinkReportEvery;
    tell(RecordedEventKind::joined, fresh.id, hello, "", now);
  }
  Station& station = again ? *old : stations_.at(last_id_);
  station.heard = now;
  station.clock.take(message.clock, now);
  station.outbox.welcome = true;
  station.outbox.welcome_limit = size;
}

/// Why this Hello cannot be granted. `in_place_of` leaves the room if it is.
std::optional<Refuse> ServerCore::objection(const Hello& hello, const Station* in_place_of) const {
  using enum RefuseReason;
  if (hello.station.empty()) return Refuse{bad_request, "the station has no name"};
  if (!hello.room.empty() && hello.room != options_.room)
    return Refuse{bad_request, "no room \"" + hello.room + "\" here; " +
                                   (options_.rooms.empty() ? "the rooms have no names" : "there is " + options_.rooms)};
  if (stations_.size() - (in_place_of ? 1 : 0) >= static_cast<std::size_t>(kMaxStations))
    return Refuse{room_full, "the room is full (" + std::to_string(kMaxStations) + " stations)"};
  if (hello.role == Role::viewer) return std::nullopt;
  if (hello.scheme && !is_available(*hello.scheme))
    return Refuse{bad_request, "scheme " + std::string(name_of(hello.scheme)) + " is not available"};
  const int most_states = most_states_for(hello.scheme, facts_.contact);
  if (hello.order > most_states || hello.order % 2 != 0)
    return Refuse{bad_request, "order " + std::to_string(hello.order) + "; expected an even number up to " +
                                   std::to_string(most_states) + ", what fits into a datagram in this scene"};
  if (!hello.shadow_of.empty()) {
    const auto* owner = find(hello.shadow_of);
    if (!owner || owner == in_place_of || !owner->pushes())
      return Refuse{bad_request, "no station \"" + hello.shadow_of + "\" to share the tool of"};
    return std::nullopt;
  }
  if (facts_.contact != ContactKind::attach) return std::nullopt;
  for (const auto& [id, other] : stations_)
    if (other.pushes() && &other != in_place_of)
      return Refuse{node_taken, "station \"" + other.hello.station + "\" holds the node of this scene"};
  return std::nullopt;
}

void ServerCore::take_from(Station& station, const Message& message, Micros now) {
  station.heard = now;
  station.proven = true;
  station.seq.take(message.seq);
  station.loss.take(message.seq);
  station.clock.take(message.clock, now);
  if (const auto* samples = std::get_if<Samples>(&message.body)) return take_samples(station, *samples, now);
  if (const auto* beat = std::get_if<Beat>(&message.body)) {
    const LinkReport& link = beat->link;
    station.patch_age = link.patch_age;
    if (link.judged >= kLossJudged) {
      station.loss_known = true;
      station.lost = static_cast<double>(link.lost) / link.judged;
      station.patch_copies = copies_for(station.lost);
    }
    station.longest_run = link.longest_run;
    station.ticks_late = beat->ticks_late;
    return;
  }
  if (std::holds_alternative<Leave>(message.body)) {
    ++counts_.leaves;
    tell(RecordedEventKind::left, station.id, station.hello, "", now);
    stations_.erase(station.id);
    return;
  }
  if (const auto* reset = std::get_if<Reset>(&message.body)) return take_reset(station, *reset, now);
  if (const auto* state = std::get_if<ViewState>(&message.body); state && station.views())
    return shapes_.heard(station.shape, *state);
  const auto* request = std::get_if<MeshRequest>(&message.body);
  if (!request || !station.views() || request->piece >= mesh_pieces(facts_.mesh)) {
    ++counts_.unexpected;
    return;
  }
  auto& pieces = station.outbox.mesh_pieces;
  if (pieces.size() < kMostMeshPieces && std::find(pieces.begin(), pieces.end(), request->piece) == pieces.end())
    pieces.push_back(request->piece);
}

/// One that knows of another count asked for what is done.
void ServerCore::take_reset(Station& station, const Reset& reset, Micros now) {
  station.next_report = now;  // it waits for the new count
  if (reset.resets != static_cast<std::uint16_t>(counts_.resets)) return;
  ++counts_.resets;
  reset_due_ = true;
  tell(RecordedEventKind::reset, station.id, station.hello, "", now);
}

/// What a datagram says that others have overtaken is known already.
void ServerCore::take_playing(Station& station, std::uint32_t seq) {
  auto& sent = station.patches_sent;
  const auto played = std::find_if(sent.begin(), sent.end(), [&](const Station::SentPatch& p) { return p.seq == seq; });
  if (seq == 0) station.playing.reset();
  if (played == sent.end()) return;
  station.playing = played->stamp;
  sent.erase(sent.begin(), played);
}

void ServerCore::take_samples(Station& station, const Samples& samples, Micros now) {
  if (!station.pushes()) return;
  if (options_.deadband > 0) take_playing(station, samples.playing);
  const auto before = station.sample_heard;
  const bool first = station.timeline.empty();
  const auto age = first ? Micros{} : std::max(Micros{}, now - station.timeline.newest());
  for (const auto& sample : samples.samples) {
    const auto t = station.clock.locked() ? station.clock.from_peer(sample.t) : Micros::max();
    if (t > now + kSampleAhead) {
      ++station.counts.samples_refused;
      continue;
    }
    if (!station.timeline.add(sample.t, t, sample.position)) continue;
    ++station.counts.samples;
    if (t <= body_time_) ++station.counts.samples_late;
    station.sample_heard = now;
    station.sample_lag = std::max(Micros{}, now - station.timeline.newest());
  }
  if (station.sample_heard == before) return;
  take_hold(station, samples);
  if (first)
    station.buffer.begin(station.sample_lag, now);
  else
    station.buffer.take(age, now);
}

/// How the tool is held and its buttons. Changes are repeated, and come again out of order.
void ServerCore::take_hold(Station& station, const Samples& samples) {
  station.orientation = samples.orientation;
  for (const ButtonChange& change : samples.buttons) {
    if (change.t <= station.buttons.t) continue;
    const bool changed = change.pressed != station.buttons.pressed;
    station.buttons = change;
    if (changed && on_buttons) on_buttons(station.id, {station.clock.from_peer(change.t), change.pressed});
  }
}

void ServerCore::expel(PeerId peer, Micros now) {
  std::erase_if(stations_, [&](const auto& entry) {
    const Station& station = entry.second;
    if (station.peer != peer) return false;
    tell(RecordedEventKind::left, station.id, station.hello, "its key is not valid any more", now);
    Message last;
    last.station = station.id;
    last.clock.sent = station.clock.stamp(now).echo;
    refuse(last, peer, {RefuseReason::unknown_station, "this station's key is not valid any more"}, kMaxDatagramBytes);
    return true;
  });
}

void ServerCore::refuse(const Message& question, PeerId to, const Refuse& refusal, std::size_t limit) {
  ++counts_.refusals;
  if (replies_.size() >= kMostReplies) {
    ++counts_.answers_withheld;
    return;
  }
  Message answer;
  answer.instance = options_.instance;
  answer.station = question.station;
  answer.clock.echo = question.clock.sent;
  answer.body = refusal;
  replies_.push_back({to, std::move(answer), limit});
}

void ServerCore::drop_silent(Micros now) {
  counts_.timeouts += std::erase_if(stations_, [&](const auto& entry) {
    const bool gone = now - entry.second.heard >= kGoneAfter;
    if (gone) tell(RecordedEventKind::silent, entry.first, entry.second.hello, "", now);
    return gone;
  });
}

void ServerCore::tell(RecordedEventKind kind, StationId id, const Hello& hello, const std::string& text, Micros now) const {
  if (!on_event) return;
  const auto role = hello.role == Role::viewer ? RecordedRole::viewer
                    : hello.shadow_of.empty()  ? RecordedRole::hand
                                               : RecordedRole::shadow;
  on_event({now, kind, id, role, hello.scheme.value_or(kWithoutChoice), hello.station, text});
}

/// Who sent the same Hello before, by the name that it asked for then or the one that it got.
Station* ServerCore::asked_before(const Hello& hello, PeerId from) {
  for (auto& [id, station] : stations_)
    if (station.peer == from && same(station.hello, hello) &&
        (station.hello.station == hello.station || station.asked == hello.station))
      return &station;
  return nullptr;
}

/// `like` itself where nobody has it, else the first of "like-2", "like-3" ... that nobody has.
std::string ServerCore::free_name(const std::string& like) const {
  std::string name = like;
  for (int number = 2; find(name) != nullptr; ++number) {
    const std::string suffix = "-" + std::to_string(number);
    name = without_number(like).substr(0, static_cast<std::size_t>(kMaxNameBytes) - suffix.size()) + suffix;
  }
  return name;
}

const Station* ServerCore::find(const std::string& name) const {
  for (const auto& [id, station] : stations_)
    if (station.hello.station == name) return &station;
  return nullptr;
}

Station* ServerCore::find(const std::string& name) { return const_cast<Station*>(std::as_const(*this).find(name)); }

}  // namespace palpate
