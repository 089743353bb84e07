#include "server/trust/rights_gate.hpp"

#include <algorithm>

namespace palpate {
namespace {

Refuse not_allowed(const std::string& what) { return {RefuseReason::bad_request, what}; }

std::string joined(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "\"" : ", \"") + name + "\"";
  return text;
}

bool same_station(const Hello& a, const Hello& b) {
  return a.station == b.station && a.role == b.role && a.shadow_of == b.shadow_of && a.room == b.room && a.guides == b.guides;
}

/// Returns true if both rights could give one name in one room; an empty list of rooms means all.
bool may_share_a_name(const Rights& a, const Rights& b) {
  const bool apart = !a.rooms.empty() && !b.rooms.empty() &&
                     std::find_first_of(a.rooms.begin(), a.rooms.end(), b.rooms.begin(), b.rooms.end()) == a.rooms.end();
  return !apart && (a.has_name(b.name) || b.has_name(a.name));
}

}  // namespace

Ruling RightsGate::cap(Message& message, ChannelPeer from, const PublicKey& key, const Rights& rights, Micros now) {
  if (auto* hello = std::get_if<Hello>(&message.body)) {
    if (auto no = cap_hello(*hello, from, key, rights, now)) return {std::move(no)};
    const auto before = streams_.find(from);
    const bool anew = before != streams_.end() && !same_station(before->second.hello, *hello);
    streams_[from] = {key, rights, now, *hello};
    return {{}, anew};
  }
  if (const auto known = streams_.find(from); known != streams_.end()) known->second.heard = now;
  if (std::holds_alternative<Leave>(message.body)) streams_.erase(from);
  if (std::holds_alternative<Reset>(message.body) && !rights.hand)
    return {not_allowed("this key may not touch, so it may not reset the body")};
  if (std::holds_alternative<Note>(message.body) && !rights.note)
    return {not_allowed("this key may not write notes (role note)")};
  if (auto* view = std::get_if<ViewState>(&message.body)) {
    const int asked = view->kbit_s == 0 ? kKbitUsual : view->kbit_s;
    view->kbit_s = static_cast<std::uint16_t>(std::min(asked, rights.kbit_s));
  }
  return {};
}

std::optional<Refuse> RightsGate::cap_hello(Hello& hello, ChannelPeer from, const PublicKey& key, const Rights& rights,
                                            Micros now) {
  const bool viewer = hello.role == Role::viewer;
  if (viewer ? !rights.viewer : !rights.hand) return not_allowed(viewer ? "this key may not look on" : "this key may not touch");
  if (hello.alike && !rights.has_name(hello.station)) hello.station = rights.name;
  if (!rights.has_name(hello.station))
    return not_allowed("this key's stations are \"" + rights.name + "\", or with - or / and more behind it");
  if (hello.room.empty() && !rights.rooms.empty()) hello.room = rights.rooms.front();
  if (!rights.rooms.empty() && std::find(rights.rooms.begin(), rights.rooms.end(), hello.room) == rights.rooms.end())
    return not_allowed("this key is for room " + joined(rights.rooms));
  if (!hello.shadow_of.empty() && !rights.has_name(hello.shadow_of))
    return not_allowed("\"" + hello.shadow_of + "\" is not a station of this key");
  if (!hello.guides.empty() && !rights.guide) return not_allowed("this key may not guide others");
  hello.may_join = rights.rooms;
  return cap_streams(hello, from, key, rights, now);
}

std::optional<Refuse> RightsGate::cap_streams(const Hello& hello, ChannelPeer from, const PublicKey& key, const Rights& rights,
                                              Micros now) const {
  int streams = 0;
  for (const auto& [peer, stream] : streams_) {
    if (peer == from || now - stream.heard > ServerChannel::kSilent) continue;
    const bool gives_way = peer < from && !hello.alike && same_station(stream.hello, hello);
    if (stream.key == key && !gives_way) ++streams;
    if (stream.key != key && may_share_a_name(stream.rights, rights))
      return Refuse{RefuseReason::name_taken, "another key has a station \"" + stream.rights.name + "\" here"};
  }
  if (streams >= rights.streams)
    return Refuse{RefuseReason::room_full, "this key has its " + std::to_string(rights.streams) + " streams already"};
  return std::nullopt;
}

}  // namespace palpate
