#include "server/core/sessions.hpp"

#include <algorithm>
#include <cassert>
#include <utility>

#include "common/base/plain_text.hpp"

namespace palpate {
namespace {

constexpr std::size_t kMostReplies = 256;  // as many as datagrams received at once

/// Strips a trailing number: "hand-2" and "hand" are both like "hand".
std::string without_number(const std::string& name) {
  const std::size_t last = name.find_last_not_of("0123456789");
  const bool numbered = last != std::string::npos && last > 0 && last + 1 < name.size() && name[last] == '-';
  return numbered ? name.substr(0, last) : name;
}

std::string in_a_list(const std::vector<std::string>& names) {
  std::string list;
  for (const std::string& name : names) list += (list.empty() ? "" : ", ") + name;
  return list;
}

}  // namespace

Sessions::Sessions(const RoomInfo& facts, const ServerOptions& options)
    : welcome_{facts.scene,
               facts.contact,
               options.rate_hz,
               facts.home,
               static_cast<std::uint32_t>(facts.mesh.vertices.size()),
               static_cast<std::uint32_t>(facts.mesh.triangles.size()),
               facts.mesh_hash,
               options.deadband,
               {},
               !facts.tool.empty(),
               facts.scene_hash,
               has_jaws(facts.tool),
               static_cast<std::uint8_t>(facts.parts.size()),
               facts.parts.empty() ? 0 : facts.coupling_n_m,
               facts.parts.empty() ? ToolShape() : facts.tool},
      tools_(facts.tools),
      draw_(options.draw),
      room_(options.room),
      rooms_(in_a_list(options.rooms)) {
  assert(draw_);
}

Station* Sessions::take(WireFault fault, const Message& message, std::size_t size, PeerId from, Micros now) {
  // Two servers must never answer each other: no Refuse is answered with a Refuse, of whatever version (it is shorter than any
  // Hello).
  if (fault == WireFault::version && size >= kHelloBytes)
    refuse(message, from,
           {RefuseReason::version, "this server speaks wire version " + std::to_string(kWireVersion) + ", the station another"},
           size, now);
  if (fault != WireFault::none) return nullptr;
  if (std::holds_alternative<Hello>(message.body)) {
    take_hello(message, from, size, now);
    return nullptr;
  }
  if (Station* const station = find(message, from)) return take_from(*station, message, now);
  const bool leaves = std::holds_alternative<Leave>(message.body);
  if (Handshake* const handshake = handshakes_.proven(message.station, message.instance, from, now)) {
    Station* const station = leaves ? nullptr : admit(*handshake, now);
    handshakes_.end(*handshake);
    if (leaves) return nullptr;
    if (station) return take_from(*station, message, now);
  }
  ++counts_.unknown_station;
  if (!leaves && !std::holds_alternative<Refuse>(message.body))
    refuse(message, from, {RefuseReason::unknown_station, "this station is not in the room"}, size, now);
  return nullptr;
}

const Station* Sessions::of_session(const Message& message) const {
  const auto known = stations_.find(message.station);
  return known != stations_.end() && known->second.secret == message.instance ? &known->second : nullptr;
}

const Station* Sessions::find(const Message& message, PeerId from) const {
  const Station* const station = of_session(message);
  return station && station->peer == from ? station : nullptr;
}

bool Sessions::knows(const Message& message, PeerId from, Micros now) const {
  return find(message, from) || handshakes_.proven(message.station, message.instance, from, now);
}

bool Sessions::serves(PeerId peer) const {
  return std::any_of(stations_.begin(), stations_.end(), [peer](const auto& entry) { return entry.second.peer == peer; }) ||
         std::any_of(goodbyes_.begin(), goodbyes_.end(), [peer](const Reply& goodbye) { return goodbye.to == peer; });
}

void Sessions::take_hello(const Message& message, PeerId from, std::size_t size, Micros now) {
  Hello hello = std::get<Hello>(message.body);
  if (Station* const seated = asked_before(hello, from))
    return answer(message, {seated->secret, seated->id, seated->seq_out++, {}, welcome_for(seated->hello)}, from, size, now);
  Handshake* handshake = handshakes_.begun(from, hello, now);
  if (!handshake) {
    const Asker asker{from, of_session(message)};
    if (has_to_wait(hello, asker, now)) return;
    const std::string asked = hello.station;
    if (hello.alike) hello.station = free_name(asked, asker, now);
    if (const auto no = objection(hello, asker, now)) {
      if (now - refusal_told_ >= kRefusalTold) {
        refusal_told_ = now;
        tell(RecordedEventKind::refused, 0, hello, {}, no->message, now);
      }
      return refuse(message, from, *no, size, now);
    }
    handshake =
        &handshakes_.begin({new_id(), draw_(), from, hello, asked, now, message.clock, now, asker.former ? asker.former->id : 0});
  }
  handshake->at = now;
  answer(message, {handshake->secret, handshake->id, 0, {}, welcome_for(handshake->hello)}, from, size, now);
}

/// Returns nullptr if other stations were quicker.
Station* Sessions::admit(Handshake& handshake, Micros now) {
  const auto former = stations_.find(handshake.former);
  const Asker asker{handshake.peer, former != stations_.end() ? &former->second : nullptr};
  if (objection(handshake.hello, asker, now)) return nullptr;
  if (asker.former) replace(*asker.former, "it continues from another address", now);
  if (const Station* const old = stations_.named(handshake.hello.station))
    replace(*old, is_successor(*old, handshake.peer) ? "its successor takes its name" : "another takes its name", now);
  assert(stations_.size() < static_cast<std::size_t>(kMaxStations));
  ++counts_.joins;
  Station& fresh = stations_[handshake.id];
  fresh.id = handshake.id;
  fresh.secret = handshake.secret;
  fresh.peer = handshake.peer;
  fresh.hello = handshake.hello;
  fresh.asked = handshake.asked;
  fresh.held = held_by(fresh.hello).value_or(0);
  if (fresh.held > 0) fresh.tool_held = tools_.further[fresh.held - 1].held;
  fresh.clock.take(handshake.began_clock, handshake.began);
  fresh.next_report = now + kLinkReportEvery;
  tell(RecordedEventKind::joined, fresh, "", now);
  return &fresh;
}

void Sessions::replace(const Station& old, const std::string& why, Micros now) {
  ++counts_.replaced;
  tell(RecordedEventKind::silent, old, why, now);
  stations_.erase(old.id);
}

StationId Sessions::new_id() {
  do ++last_id_;
  while (last_id_ == 0 || stations_.contains(last_id_));
  return last_id_;
}

Welcome Sessions::welcome_for(const Hello& hello) const {
  Welcome welcome = welcome_;
  if (hello.role != Role::haptic || !hello.shadow_of.empty()) welcome.deadband = 0;
  welcome.station = hello.station;
  const std::uint8_t held = held_by(hello).value_or(0);
  if (held == 0) return welcome;
  const FurtherTool& tool = tools_.further[held - 1];
  welcome.turns = !tool.held.shape.empty();
  welcome.jaws = has_jaws(tool.held.shape);
  if (welcome.parts == 0) return welcome;
  welcome.coupling_n_m = tool.coupling_n_m;
  welcome.tool = tool.held.shape;
  return welcome;
}

std::optional<std::uint8_t> Sessions::held_by(const Hello& hello) const {
  if (hello.shadow_of.empty()) return tools_.number_of(hello.tool);
  const Station* const owner = stations_.named(hello.shadow_of);
  return owner ? owner->held : std::uint8_t{0};
}

std::optional<Refuse> Sessions::lack_of_tool(const Hello& hello) const {
  if (hello.tool.empty()) return std::nullopt;
  if (hello.role == Role::viewer || !hello.shadow_of.empty())
    return Refuse{RefuseReason::bad_request, "a station without a tool of its own cannot choose one"};
  if (held_by(hello)) return std::nullopt;
  std::vector<std::string> names;
  if (!tools_.first.empty()) names.push_back(tools_.first);
  for (const FurtherTool& tool : tools_.further) names.push_back(tool.held.name);
  return Refuse{RefuseReason::bad_request, "no tool \"" + hello.tool + "\" in this scene; " +
                                               (names.empty() ? "its only tool has no name" : "there is " + in_a_list(names))};
}

/// Returns the reason why this Hello cannot be granted; empty if it can.
std::optional<Refuse> Sessions::objection(const Hello& hello, const Asker& asker, Micros now) const {
  using enum RefuseReason;
  if (!ended_.empty()) return Refuse{bad_request, ended_};
  if (!draining_.empty()) return Refuse{shutting_down, draining_};
  if (hello.station.empty()) return Refuse{bad_request, "the station has no name"};
  if (!hello.room.empty() && hello.room != room_)
    return Refuse{bad_request,
                  "no room \"" + hello.room + "\" here; " + (rooms_.empty() ? "the rooms have no names" : "there is " + rooms_)};
  const Station* const holder = stations_.named(hello.station);
  const Station* const in_place_of = asker.former ? asker.former : holder;
  if (holder && !gives_way(*holder, asker, now))
    return Refuse{name_taken, "station \"" + hello.station + "\" is in the room already"};
  if (const auto full = lack_of_seats(hello, in_place_of)) return full;
  if (const auto lack = lack_of_tool(hello)) return lack;
  if (!hello.guides.empty()) {
    if (hello.role == Role::viewer || !hello.shadow_of.empty())
      return Refuse{bad_request, "a station without a tool of its own cannot guide"};
    if (hello.guides == hello.station) return Refuse{bad_request, "a station cannot guide itself"};
  }
  if (hello.role == Role::viewer) return std::nullopt;
  const int most_states = 2 * max_port_modes(welcome_.contact);
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

bool Sessions::is_successor(const Station& holder, PeerId from) const {
  const std::string key = key_of ? key_of(from) : std::string();
  return from > holder.peer && !key.empty() && key == key_of(holder.peer);
}

/// Returns true if the holder has to give its name to this sender.
bool Sessions::gives_way(const Station& holder, const Asker& asker, Micros now) const {
  const Micros silent = now - holder.heard;
  const PeerId from = asker.peer;
  if (&holder == asker.former || holder.peer == from || silent > kSilentAfter) return true;
  if (!is_successor(holder, from)) return false;
  const Station::Claim& claim = holder.claim;
  const bool in_vain = claim.by == from && now - claim.since >= holder.clock.rtt().min + kSuccessorProof;
  return (!holder.views() && silent >= kSuccessorAfter) || (in_vain && holder.echoed <= claim.since);
}

/// Returns true while a successor has to wait for evidence whether the holder lives.
bool Sessions::has_to_wait(const Hello& hello, const Asker& asker, Micros now) {
  Station* const holder = stations_.named(hello.station);
  const PeerId from = asker.peer;
  if (!holder || gives_way(*holder, asker, now) || !is_successor(*holder, from)) return false;
  Station::Claim& claim = holder->claim;
  if (claim.by > from) return false;  // a newer one asks as well
  if (claim.by < from) claim = {from, now};
  if (holder->echoed <= claim.since) return true;
  claim.since = now;  // the holder lives; the next request starts a new test
  return false;
}

std::optional<Refuse> Sessions::lack_of_seats(const Hello& hello, const Station* in_place_of) const {
  int all = 0, shadows = 0, viewers = 0;
  for (const auto& [id, station] : stations_) {
    if (&station == in_place_of) continue;
    ++all;
    viewers += station.views();
    shadows += !station.views() && !station.pushes();
  }
  const auto full = [](int most, const char* of) {
    return Refuse{RefuseReason::room_full, "the room is full (" + std::to_string(most) + of};
  };
  if (all >= kMaxStations) return full(kMaxStations, " stations)");
  if (hello.role == Role::viewer && viewers >= kMostViewers) return full(kMostViewers, " viewers)");
  if (!hello.shadow_of.empty() && shadows >= kMostShadows) return full(kMostShadows, " shadows)");
  return std::nullopt;
}

Station* Sessions::take_from(Station& station, const Message& message, Micros now) {
  station.heard = now;
  station.seq.take(message.seq);
  station.loss.take(message.seq);
  station.clock.take(message.clock, now);
  station.echoed = std::max(station.echoed, std::min(message.clock.echo, now));
  if (!std::holds_alternative<Leave>(message.body)) return &station;
  ++counts_.leaves;
  tell(RecordedEventKind::left, station, "", now);
  stations_.erase(station.id);
  return nullptr;
}

/// Queues an answer to a sender that is not, or no longer, in the room; it carries the sender's instance number, not ours, and
/// none in answer to a Hello, so that nobody takes it for the end of a session.
void Sessions::refuse(const Message& question, PeerId to, const Refuse& refusal, std::size_t limit, Micros now) {
  ++counts_.refusals;
  ++counts_.refused[static_cast<std::size_t>(refusal.reason)];
  const bool asks = std::holds_alternative<Hello>(question.body);
  answer(question, {asks ? 0 : question.instance, asks ? 0 : question.station, 0, {}, refusal}, to, limit, now);
}

void Sessions::answer(const Message& question, Message answer, PeerId to, std::size_t limit, Micros now) {
  if (replies_.size() >= kMostReplies) {
    ++counts_.answers_withheld;
    return;
  }
  answer.clock.echo = question.clock.sent;
  replies_.push_back({to, std::move(answer), limit, now});
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

void Sessions::shut_down(const std::string& why, bool ended, Micros now) {
  if (ended) ended_ = why;
  goodbyes_.clear();
  for (const auto& [id, station] : stations_) {
    ++counts_.goodbyes_sent;
    tell(RecordedEventKind::left, station, why, now);
    say_goodbye(station, {RefuseReason::shutting_down, why}, now);
  }
  stations_.clear();
  repeat_goodbyes(now);
}

/// Answers the newest datagram of the station, as a station accepts no other goodbye (ClientCore).
void Sessions::say_goodbye(const Station& station, const Refuse& why, Micros now) {
  Message goodbye{station.secret, station.id, 0, {}, why};
  goodbye.clock.echo = station.clock.stamp(now).echo;
  goodbyes_.push_back({station.peer, std::move(goodbye), kMaxDatagramBytes, now});
}

void Sessions::repeat_goodbyes(Micros now) {
  for (const Reply& goodbye : goodbyes_) {
    replies_.push_back(goodbye);
    replies_.back().at = now;
  }
}

void Sessions::expel(PeerId peer, Micros now) {
  handshakes_.forget(peer);
  std::erase_if(stations_, [&](const auto& entry) {
    const Station& station = entry.second;
    if (station.peer != peer) return false;
    ++counts_.expelled;
    tell(RecordedEventKind::left, station, "its key is not valid any more", now);
    refuse({station.secret, station.id, 0, {station.clock.stamp(now).echo, {}, {}}, Beat{}}, peer,
           {RefuseReason::unknown_station, "this station's key is not valid any more"}, kMaxDatagramBytes, now);
    return true;
  });
}

void Sessions::tell(RecordedEventKind kind, const Station& station, const std::string& text, Micros now) const {
  const bool joins = kind == RecordedEventKind::joined;
  tell(kind, station.id, station.hello, joins ? station.tool_held : HeldTool(), text, now);
}

void Sessions::tell(RecordedEventKind kind, StationId id, const Hello& hello, const HeldTool& tool, const std::string& text,
                    Micros now) const {
  if (!on_event) return;
  const auto role = hello.role == Role::viewer ? RecordedRole::viewer
                    : hello.shadow_of.empty()  ? RecordedRole::hand
                                               : RecordedRole::shadow;
  on_event({now, kind, id, role, hello.scheme.value_or(kWithoutChoice), hello.station, text, tool});
}

/// Returns the station that sent the same Hello before, with the name that it asked for then or the name that it got.
Station* Sessions::asked_before(const Hello& hello, PeerId from) {
  for (auto& [id, station] : stations_)
    if (station.peer == from && same_wish(station.hello, hello) &&
        (station.hello.station == hello.station || station.asked == hello.station))
      return &station;
  return nullptr;
}

/// Returns `like` if it is free or its holder gives way to the same client, else the first free one of "like-2", "like-3" ...
std::string Sessions::free_name(const std::string& like, const Asker& asker, Micros now) const {
  std::string name = like;
  const Station* const holder = stations_.named(like);
  if (holder && (holder == asker.former || is_successor(*holder, asker.peer)) && gives_way(*holder, asker, now)) return name;
  for (int number = 2; stations_.named(name) != nullptr; ++number) {
    const std::string suffix = "-" + std::to_string(number);
    name = std::string(cut_text(without_number(like), static_cast<std::size_t>(kMaxNameBytes) - suffix.size())) + suffix;
  }
  return name;
}

std::size_t Sessions::emit(std::span<std::byte> out, PeerId& to, Micros now) {
  while (!replies_.empty()) {
    Reply reply = std::move(replies_.front());
    replies_.pop_front();
    reply.message.clock.sent = now;
    reply.message.clock.echo_hold = now - reply.at;
    const auto room = out.first(std::min(out.size(), reply.limit));
    to = reply.to;
    if (const auto size = encode(reply.message, room)) return size;
    auto* const refusal = std::get_if<Refuse>(&reply.message.body);
    if (refusal) refusal->message.clear();  // the reason alone may fit
    if (const auto size = refusal ? encode(reply.message, room) : 0) return size;
    ++counts_.answers_withheld;
  }
  return 0;
}

}  // namespace palpate
