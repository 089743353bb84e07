// A server for browsers: palpate-web is one viewer in each room that somebody watches, however many browsers look. Each browser
// chooses its room; the first one is always watched, so that its history is there.
#pragma once

#include <map>
#include <memory>
#include <string>

#include "client/web/app/live_room.hpp"

namespace palpate {

class LivePage final : public Page {
 public:
  static constexpr Micros kKeptFor{10'000'000};  ///< a room that nobody watches any more is left after this time

  /// `room`: the first one; empty: the server's. Throws InputError when the server's name does not parse or resolve.
  LivePage(LiveSession session, const std::string& room);

  Micros tick(WebServer& web, Micros now) override;
  void joined(BrowserId id) override;
  void said(BrowserId id, std::string_view text) override;
  void left(BrowserId id) override;

 private:
  struct Watched {
    std::unique_ptr<LiveRoom> room;
    Micros until = Micros::max();  ///< nobody watches it: time at which it is left
  };
  void move(BrowserId id, const std::string& name);
  /// Returns the room of that name, with a new viewer if nobody watches it; nullptr for one that is not the server's.
  LiveRoom* named(const std::string& name);

  LiveSession session_;
  LiveRoom first_;
  std::map<std::string, Watched> others_;
  std::map<BrowserId, LiveRoom*> place_of_;
};

}  // namespace palpate
