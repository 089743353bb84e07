#include "server/core/handshakes.hpp"

#include <cassert>
#include <utility>

namespace palpate {

bool same_wish(const Hello& a, const Hello& b) {
  return a.role == b.role && a.scheme == b.scheme && a.order == b.order && a.shadow_of == b.shadow_of && a.room == b.room &&
         a.alike == b.alike && a.guides == b.guides && a.tool == b.tool;
}

Handshake* Handshakes::begun(PeerId peer, const Hello& hello, Micros now) {
  const auto newest = newest_.find(peer);
  if (newest == newest_.end()) return nullptr;
  Handshake& handshake = places_[newest->second % kMost];
  const bool is_retry = same_wish(handshake.hello, hello) && handshake.asked == hello.station;
  return is_retry && now - handshake.at <= kFor ? &handshake : nullptr;
}

Handshake& Handshakes::begin(Handshake handshake) {
  assert(handshake.id != 0);
  const std::size_t place = handshake.id % kMost;
  if (places_.size() <= place) places_.resize(place + 1);
  end(places_[place]);
  newest_[handshake.peer] = handshake.id;
  return places_[place] = std::move(handshake);
}

const Handshake* Handshakes::proven(StationId id, std::uint64_t secret, PeerId peer, Micros now) const {
  const std::size_t place = id % kMost;
  if (id == 0 || place >= places_.size()) return nullptr;
  const Handshake& h = places_[place];
  return h.id == id && h.secret == secret && h.peer == peer && now - h.at <= kFor ? &h : nullptr;
}

void Handshakes::forget(PeerId peer) {
  for (Handshake& handshake : places_)
    if (handshake.id != 0 && handshake.peer == peer) end(handshake);
}

void Handshakes::end(Handshake& handshake) {
  const auto newest = newest_.find(handshake.peer);
  if (handshake.id != 0 && newest != newest_.end() && newest->second == handshake.id) newest_.erase(newest);
  handshake = {};
}

}  // namespace palpate
