// The source of what browsers see: a server's room or a recording.
#pragma once

#include <string>

#include "client/web/io/web_server.hpp"
#include "client/web/web_frames.hpp"

namespace palpate {

inline constexpr Micros kShapeEvery{50'000}, kRoomEvery{250'000};

class Page : public Audience {
 public:
  /// Handles what is due and sends it. Returns the time of the next call; an earlier one does no harm.
  virtual Micros tick(WebServer& web, Micros now) = 0;
};

inline Packet text_packet(std::string text) { return {std::make_shared<const std::string>(std::move(text)), false}; }
inline Packet binary_packet(std::string bytes) { return {std::make_shared<const std::string>(std::move(bytes)), true}; }
inline constexpr char kPageProgram[] = "palpate-web " PALPATE_VERSION;

}  // namespace palpate
