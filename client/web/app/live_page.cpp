#include "client/web/app/live_page.hpp"

#include <algorithm>

namespace palpate {

LivePage::LivePage(LiveSession session, const std::string& room) : session_(std::move(session)), first_(session_, room) {}

void LivePage::joined(BrowserId id) {
  place_of_[id] = &first_;
  first_.add(id);
}

void LivePage::left(BrowserId id) {
  const auto place = place_of_.find(id);
  if (place == place_of_.end()) return;
  place->second->remove(id);
  place_of_.erase(place);
}

void LivePage::said(BrowserId id, std::string_view text) {
  const auto place = place_of_.find(id);
  if (place == place_of_.end()) return;
  const PageRequest request = read_request(text);
  if (request.kind == PageRequest::Kind::room) move(id, request.text);
  if (request.kind == PageRequest::Kind::note) place->second->write_note(request);
}

void LivePage::move(BrowserId id, const std::string& name) {
  LiveRoom* const to = named(name);
  LiveRoom*& place = place_of_[id];
  if (to == nullptr || to == place) return;
  place->remove(id);
  place = to;
  to->add(id);
}

LiveRoom* LivePage::named(const std::string& name) {
  const RoomList& rooms = first_.rooms();
  if (rooms.here == name) return &first_;
  const auto watched = others_.find(name);
  if (watched != others_.end()) return watched->second.room.get();
  if (std::find(rooms.names.begin(), rooms.names.end(), name) == rooms.names.end()) return nullptr;
  return others_.emplace(name, Watched{std::make_unique<LiveRoom>(session_, name)}).first->second.room.get();
}

Micros LivePage::tick(WebServer& web, Micros now) {
  Micros next = first_.tick(web, now);
  for (auto& [name, watched] : others_) {
    next = std::min(next, watched.room->tick(web, now));
    if (watched.room->watched())
      watched.until = Micros::max();
    else if (watched.until == Micros::max())
      watched.until = now + kKeptFor;
  }
  std::erase_if(others_, [now](const auto& other) { return now >= other.second.until; });
  return next;
}

}  // namespace palpate
