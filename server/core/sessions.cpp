#include "server/core/sessions.hpp"

#include <algorithm>
#include <cassert>
#include <utility>

namespace palpate {
namespace {

constexpr std::size_t kMostReplies = 2 * kMaxStations;

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

/// Of whatever scheme it may get.
int most_states_for(SchemeAsked scheme, ContactKind contact) {
  const auto most = [contact](Scheme s) { return 2 * max_port_modes(contact, s); };
  return scheme ? most(*scheme) : std::min(most(Scheme::port), most(Scheme::hyper));
}

}  // namespace

Sessions::Sessions(const RoomFacts& facts, const ServerOptions& options)
    : welcome_{facts.scene,
               facts.contact,
               options.rate_hz,
               facts.home,
               static_cast<std::uint32_t>(facts.mesh.vertices.size()),
               static_cast<std::uint32_t>(facts.mesh.triangles.size()),
               facts.mesh_hash,
               options.deadband,
               {}},
      instance_(options.instance),
      room_(options.room),
      rooms_(options.rooms) {}

Station* Sessions::take(WireFault fault, const Message& message, std::size_t size, PeerId from, Micros now) {
  if (fault == WireFault::version)
    refuse(message, from,
           {RefuseReason::version, "this server speaks wire version " + std::to_string(kWireVersion) + ", the station another"},
           size);
  if (fault != WireFault::none) return nullptr;
  if (std::holds_alternative<Hello>(message.body)) {
    take_hello(message, from, size, now);
    return nullptr;
  }
  const auto known = stations_.find(message.station);
  if (known != stations_.end() && known->second.peer == from && message.instance == instance_)
    return take_from(known->second, message, now);
  ++counts_.unknown_station;
  if (!std::holds_alternative<Leave>(message.body))
    refuse(message, from, {RefuseReason::unknown_station, "this station is not in the room"}, size);
  return nullptr;
}

void Sessions::take_hello(const Message& message, PeerId from, std::size_t size, Micros now) {
  Hello hello = std::get<Hello>(message.body);
  const std::string asked = hello.station;
  Station* station = asked_before(hello, from);
  if (!station) {
    if (hello.alike) hello.station = free_name(asked);
    const Station* old = stations_.named(hello.station);
    const bool for_us = hello.room.empty() || hello.room == room_;
    const bool taken = for_us && old && old->peer != from && now - old->heard <= kSilentAfter;
    const auto no = taken ? Refuse{RefuseReason::name_taken, "station \"" + hello.station + "\" is in the room already"}
                          : objection(hello, old);
    if (no) {
      tell(RecordedEventKind::refused, 0, hello, no->message, now);
      return refuse(message, from, *no, size);
    }
    if (old) {
      tell(RecordedEventKind::silent, *old, "another takes its name", now);
      stations_.erase(old->id);
    }
    station = &seat(hello, asked, from, now);
  }
  station->heard = now;
  station->clock.take(message.clock, now);
  station->welcome_limit = size;
}

Station& Sessions::seat(const Hello& hello, const std::string& asked, PeerId from, Micros now) {
  assert(stations_.size() < static_cast<std::size_t>(kMaxStations));
  ++counts_.joins;
  Station& fresh = stations_[++last_id_];
  fresh.id = last_id_;
  fresh.instance = instance_;
  fresh.peer = from;
  fresh.hello = hello;
  fresh.asked = asked;
  fresh.next_report = now + kLinkReportEvery;
  tell(RecordedEventKind::joined, fresh, "", now);
  return fresh;
}

/// Why this Hello cannot be granted. `in_place_of` leaves the room if it is.
std::optional<Refuse> Sessions::objection(const Hello& hello, const Station* in_place_of) const {
  using enum RefuseReason;
  if (hello.station.empty()) return Refuse{bad_request, "the station has no name"};
  if (!hello.room.empty() && hello.room != room_)
    return Refuse{bad_request,
                  "no room \"" + hello.room + "\" here; " + (rooms_.empty() ? "the rooms have no names" : "there is " + rooms_)};
  if (stations_.size() - (in_place_of ? 1 : 0) >= static_cast<std::size_t>(kMaxStations))
    return Refuse{room_full, "the room is full (" + std::to_string(kMaxStations) + " stations)"};
  if (hello.role == Role::viewer) return std::nullopt;
  if (hello.scheme && !is_available(*hello.scheme))
    return Refuse{bad_request, "scheme " + std::string(name_of(hello.scheme)) + " is not available"};
  const int most_states = most_states_for(hello.scheme, welcome_.contact);
  if (hello.order > most_states || hello.order % 2 != 0)
    return Refuse{bad_request, "order " + std::to_string(hello.order) + "; expected an even number up to " +
                                   std::to_string(most_states) + ", what fits into a datagram in this scene"};
  if (!hello.shadow_of.empty()) {
    const auto* owner = stations_.named(hello.shadow_of);
    if (!owner || owner == in_place_of || !owner->pushes())
      return Refuse{bad_request, "no station \"" + hello.shadow_of + "\" to share the tool of"};
    return std::nullopt;
  }
  if (welcome_.contact != ContactKind::attach) return std::nullopt;
  for (const auto& [id, other] : stations_)
    if (other.pushes() && &other != in_place_of)
      return Refuse{node_taken, "station \"" + other.hello.station + "\" holds the node of this scene"};
  return std::nullopt;
}

Station* Sessions::take_from(Station& station, const Message& message, Micros now) {
  station.heard = now;
  station.proven = true;
  station.seq.take(message.seq);
  station.loss.take(message.seq);
  station.clock.take(message.clock, now);
  if (!std::holds_alternative<Leave>(message.body)) return &station;
  ++counts_.leaves;
  tell(RecordedEventKind::left, station, "", now);
  stations_.erase(station.id);
  return nullptr;
}

/// Queues an answer to someone who is not, or not any more, in the room.
void Sessions::refuse(const Message& question, PeerId to, const Refuse& refusal, std::size_t limit) {
  ++counts_.refusals;
  if (replies_.size() >= kMostReplies) {
    ++counts_.answers_withheld;
    return;
  }
  Message answer;
  answer.instance = instance_;
  answer.station = question.station;
  answer.clock.echo = question.clock.sent;
  answer.body = refusal;
  replies_.push_back({to, std::move(answer), limit});
}

void Sessions::drop_silent(Micros now) {
  counts_.timeouts += std::erase_if(stations_, [&](const auto& entry) {
    const bool gone = now - entry.second.heard >= kGoneAfter;
    if (gone) tell(RecordedEventKind::silent, entry.second, "", now);
    return gone;
  });
}

Micros Sessions::deadline() const {
  Micros earliest = Micros::max();
  for (const auto& [id, station] : stations_) earliest = std::min(earliest, station.heard + kGoneAfter);
  return earliest;
}

void Sessions::shut_down() {
  for (const auto& [id, station] : stations_) {
    if (!station.proven) continue;
    Message question;
    question.station = id;
    refuse(question, station.peer, {RefuseReason::shutting_down, "the server is shutting down"}, kMaxDatagramBytes);
  }
  stations_.clear();
}

void Sessions::tell(RecordedEventKind kind, const Station& station, const std::string& text, Micros now) const {
  tell(kind, station.id, station.hello, text, now);
}

void Sessions::tell(RecordedEventKind kind, StationId id, const Hello& hello, const std::string& text, Micros now) const {
  if (!on_event) return;
  const auto role = hello.role == Role::viewer ? RecordedRole::viewer
                    : hello.shadow_of.empty()  ? RecordedRole::hand
                                               : RecordedRole::shadow;
  on_event({now, kind, id, role, hello.scheme.value_or(kWithoutChoice), hello.station, text});
}

/// Who sent the same Hello before, by the name that it asked for then or the one that it got.
Station* Sessions::asked_before(const Hello& hello, PeerId from) {
  for (auto& [id, station] : stations_)
    if (station.peer == from && same(station.hello, hello) &&
        (station.hello.station == hello.station || station.asked == hello.station))
      return &station;
  return nullptr;
}

/// `like` itself where nobody has it, else the first of "like-2", "like-3" ... that nobody has.
std::string Sessions::free_name(const std::string& like) const {
  std::string name = like;
  for (int number = 2; stations_.named(name) != nullptr; ++number) {
    const std::string suffix = "-" + std::to_string(number);
    name = without_number(like).substr(0, static_cast<std::size_t>(kMaxNameBytes) - suffix.size()) + suffix;
  }
  return name;
}

std::size_t Sessions::emit(std::span<std::byte> out, PeerId& to, Micros now) {
  while (!replies_.empty()) {
    auto reply = std::move(replies_.front());
    replies_.pop_front();
    reply.message.clock.sent = now;
    const auto room = out.first(std::min(out.size(), reply.limit));
    to = reply.to;
    if (const auto size = encode(reply.message, room)) return size;
    reply.refusal().message.clear();  // the reason alone may fit
    if (const auto size = encode(reply.message, room)) return size;
    ++counts_.answers_withheld;
  }
  return 0;
}

std::size_t Sessions::welcome(Station& station, std::span<std::byte> out, Micros now) {
  if (station.welcome_limit == 0) return 0;
  const auto limit = std::min(out.size(), std::exchange(station.welcome_limit, 0));
  Welcome welcome = welcome_;
  if (!station.pushes()) welcome.deadband = 0;
  welcome.station = station.hello.station;
  const auto size = encode_for(station, std::move(welcome), out.first(limit), now);
  if (size == 0) ++counts_.answers_withheld;
  return size;
}

}  // namespace palpate
