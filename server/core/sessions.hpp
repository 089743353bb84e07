// Who is in the room: handshake, names, seats, leaving, silence.
//
// A Hello is granted with Welcome or refused. The same Hello from the same sender has the same answer, as it may have been lost;
// a name belongs to one station, and may be taken by another after kSilentAfter of silence. Everything after Welcome is known by
// instance, station number and sender together; who says something without is refused as unknown.
//
// Trust: an unknown sender is answered with at most as many bytes as it sent; a new station gets nothing but Welcome until it
// has shown, by using its id, that it receives at its address.
#pragma once

#include <deque>
#include <functional>
#include <optional>
#include <span>
#include <string>

#include "common/record/recording.hpp"
#include "common/wire/codec.hpp"
#include "server/core/room_facts.hpp"
#include "server/core/server_options.hpp"
#include "server/core/station.hpp"

namespace palpate {

inline constexpr Micros kSilentAfter{1'000'000};  ///< another peer may take the name of a station silent for so long
inline constexpr Micros kGoneAfter{3'000'000};    ///< a station silent for so long has left

struct SessionCounts {
  std::uint64_t unknown_station = 0;  ///< datagrams with an id that nobody here has
  std::uint64_t joins = 0, refusals = 0, leaves = 0, timeouts = 0;
  std::uint64_t answers_withheld = 0;  ///< larger than the question, or too many at once
};

class Sessions {
 public:
  Sessions(const RoomFacts& facts, const ServerOptions& options);

  /// What decode() made of `size` bytes. The station that said it, when it is for others to hear.
  Station* take(WireFault fault, const Message& message, std::size_t size, PeerId from, Micros now);
  /// Those who were not heard for kGoneAfter have left.
  void drop_silent(Micros now);
  /// When the next of them will have; Micros::max() when there is nobody.
  Micros deadline() const;
  /// Bytes of the next refusal, 0 when there is none.
  std::size_t emit(std::span<std::byte> out, PeerId& to, Micros now);
  /// Bytes of the answer to the station's Hello, 0 when it waits for none.
  std::size_t welcome(Station& station, std::span<std::byte> out, Micros now);
  /// Everyone is told and forgotten.
  void shut_down();

  Stations& stations() { return stations_; }
  const Stations& stations() const { return stations_; }
  const SessionCounts& counts() const { return counts_; }
  void tell(RecordedEventKind kind, const Station& station, const std::string& text, Micros now) const;

  /// Hears who comes, goes and is refused, and why.
  std::function<void(const RecordedEvent&)> on_event;

 private:
  struct Reply {
    PeerId to = 0;
    Message message;  ///< a Refuse
    std::size_t limit = 0;
    Refuse& refusal() { return std::get<Refuse>(message.body); }
  };

  void take_hello(const Message& message, PeerId from, std::size_t size, Micros now);
  Station* take_from(Station& station, const Message& message, Micros now);
  Station& seat(const Hello& hello, const std::string& asked, PeerId from, Micros now);
  std::optional<Refuse> objection(const Hello& hello, const Station* in_place_of) const;
  void refuse(const Message& question, PeerId to, const Refuse& refusal, std::size_t limit);
  Station* asked_before(const Hello& hello, PeerId from);
  std::string free_name(const std::string& like) const;
  void tell(RecordedEventKind kind, StationId id, const Hello& hello, const std::string& text, Micros now) const;

  Welcome welcome_;  ///< but for the station's name, and deadband where it gets none
  std::uint64_t instance_;
  std::string room_, rooms_;
  Stations stations_;
  StationId last_id_ = 0;
  std::deque<Reply> replies_;
  SessionCounts counts_;
};

}  // namespace palpate
