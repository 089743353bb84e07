// The sessions of a room: handshake, names, seats, leaving, silence.
//
// A Hello is granted with Welcome or refused. Welcome holds a station number and, as instance, a secret (handshakes.hpp). A peer
// that sends both from the same address has proved that it receives there; only then does it get a name, a seat, a node or a
// frame, if its request can still be granted. Otherwise it is refused as unknown, and gets the reason when it asks again. The
// same Hello from the same sender gets the same answer, as the first may have been lost. A name belongs to one station; another
// one gets it after kSilentAfter of silence, or when it has proved that it receives at the very address of the one before.
// Datagrams with another secret, number or sender change nothing: an attacker that does not see a station's datagrams can neither
// end its session nor send in its name, except by guessing 64 bits.
//
// A client whose address changed (a NAT binding was renewed, another network) is refused as unknown and asks again. Its Hello
// carries the number and secret of its former session, so the new session takes the name, seat and node of the former one, which
// ends in the moment in which the new address is proven: a client never has two tools in the body.
//
// A successor is a newer session with the holder's own key (key_of(); without keys there is none), as of a program that crashed
// and was restarted. It gets the name once nothing of the holder has come for kSuccessorAfter, or once it has asked for a round
// trip of the holder (the least one, as late datagrams raise the mean) plus kSuccessorProof and the holder has echoed nothing
// sent since then; so a dead holder's datagrams, replayed late by an attacker, delay nobody. Until then its Hello gets no answer
// and is repeated after kHelloEvery. A live holder has echoed, and the successor is refused, or with `alike` gets another name. A
// session that lost its name is then the older one and gets the name back by the general rule: of two programs with one key and
// one name, neither takes over while the other is heard.
//
// An unknown sender is answered with at most as many bytes as it sent, and with no secret but its own.
//
// A room has kMaxStations seats, at most kMostShadows of them for shadows and kMostViewers for viewers, so that hands find a
// seat.
#pragma once

#include <array>
#include <deque>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "common/record/recording.hpp"
#include "common/wire/codec.hpp"
#include "server/core/handshakes.hpp"
#include "server/core/room_info.hpp"
#include "server/core/server_options.hpp"
#include "server/core/station.hpp"

namespace palpate {

inline constexpr Micros kSilentAfter{1'000'000};            ///< silence after which another peer may get a station's name
inline constexpr Micros kSuccessorAfter{250'000};           ///< the same for a successor, if the holder has a hand
inline constexpr Micros kSuccessorProof{500'000};           ///< time beyond the round trip for a holder to echo what it is sent
inline constexpr Micros kGoneAfter{3'000'000};              ///< silence after which a station has left
inline constexpr int kMostShadows = 16, kMostViewers = 16;  ///< most of them in a room
inline constexpr std::size_t kRefuseReasons = 7;
inline constexpr Micros kRefusalTold{100'000};  ///< least time between two refusals that are reported to listeners

struct SessionCounts {
  std::uint64_t unknown_station = 0;  ///< datagrams with an id that no station has
  std::uint64_t joins = 0, refusals = 0, leaves = 0, timeouts = 0;
  std::uint64_t replaced = 0, expelled = 0, goodbyes_sent = 0;  ///< stations removed: by name, by key, at shutdown
  std::array<std::uint64_t, kRefuseReasons> refused{};          ///< `refusals` by reason, without goodbyes
  std::uint64_t answers_withheld = 0;  ///< answers not sent: larger than the question, or too many at once
};

class Sessions {
 public:
  Sessions(const RoomInfo& facts, const ServerOptions& options);

  /// Accepts the result of decode() on `size` bytes. Returns the station that sent it if other parts have to handle the message.
  Station* take(WireFault fault, const Message& message, std::size_t size, PeerId from, Micros now);
  /// Removes stations that were silent for kGoneAfter.
  void drop_silent(Micros now);
  /// Next moment at which a station may have to be removed for silence; Micros::max() if there is none.
  Micros deadline() const;
  /// Returns true if the message is for a station or a handshake of this room.
  bool knows(const Message& message, PeerId from, Micros now) const;
  bool serves(PeerId peer) const;
  /// Writes the next answer to a Hello or to a stranger; returns its bytes, 0 if there is none.
  std::size_t emit(std::span<std::byte> out, PeerId& to, Micros now);
  /// Refuses new sessions with RefuseReason::shutting_down; existing ones stay.
  void drain(const std::string& why) { draining_ = why; }
  bool draining() const { return !draining_.empty(); }
  /// Says goodbye to all stations and removes them; with `ended` for good: newcomers are refused with that reason.
  void shut_down(const std::string& why, bool ended, Micros now);
  /// Repeats the goodbyes of shut_down().
  void repeat_goodbyes(Micros now);

  /// Says goodbye to all stations and handshakes of a peer and removes them: its key is no longer valid.
  void expel(PeerId peer, Micros now);
  void refuse(const Message& question, PeerId to, const Refuse& refusal, std::size_t limit, Micros now);

  Stations& stations() { return stations_; }
  const Stations& stations() const { return stations_; }
  const SessionCounts& counts() const { return counts_; }
  void tell(RecordedEventKind kind, const Station& station, const std::string& text, Micros now) const;

  /// Called for joins, leaves and refusals, with their reasons.
  std::function<void(const RecordedEvent&)> on_event;
  /// Returns the key of a sender, empty for one that has left; null: there are no keys. Newer senders have larger numbers.
  std::function<std::string(PeerId)> key_of;

 private:
  struct Reply {
    PeerId to = 0;
    Message message;  ///< a Welcome or Refuse
    std::size_t limit = 0;
    Micros at{};
  };

  /// Sender of a Hello. `former`: its session at another address, nullptr if there is none.
  struct Asker {
    PeerId peer = 0;
    const Station* former = nullptr;
  };

  void take_hello(const Message& message, PeerId from, std::size_t size, Micros now);
  Station* take_from(Station& station, const Message& message, Micros now);
  /// Station with the number and the secret of this message, at whatever address.
  const Station* of_session(const Message& message) const;
  const Station* find(const Message& message, PeerId from) const;
  Station* find(const Message& message, PeerId from) { return const_cast<Station*>(std::as_const(*this).find(message, from)); }
  Station* admit(Handshake& handshake, Micros now);
  StationId new_id();
  Welcome welcome_for(const Hello& hello) const;
  /// Returns the number of the tool that it would hold; none where the scene has no such tool.
  std::optional<std::uint8_t> held_by(const Hello& hello) const;
  /// Returns the reason why it cannot hold the tool that it asks for.
  std::optional<Refuse> lack_of_tool(const Hello& hello) const;
  void replace(const Station& old, const std::string& why, Micros now);
  std::optional<Refuse> objection(const Hello& hello, const Asker& asker, Micros now) const;
  bool is_successor(const Station& holder, PeerId from) const;
  bool gives_way(const Station& holder, const Asker& asker, Micros now) const;
  bool has_to_wait(const Hello& hello, const Asker& asker, Micros now);
  std::optional<Refuse> lack_of_seats(const Hello& hello, const Station* in_place_of) const;
  void answer(const Message& question, Message answer, PeerId to, std::size_t limit, Micros now);
  void say_goodbye(const Station& station, const Refuse& why, Micros now);
  Station* asked_before(const Hello& hello, PeerId from);
  std::string free_name(const std::string& like, const Asker& asker, Micros now) const;
  void tell(RecordedEventKind kind, StationId id, const Hello& hello, const HeldTool& tool, const std::string& text,
            Micros now) const;

  Welcome welcome_;  ///< without the station's name, and without a deadband where it gets none; with the first tool
  RoomTools tools_;
  SecretSource draw_;
  std::string room_, rooms_;
  Stations stations_;
  Handshakes handshakes_;
  StationId last_id_ = 0;
  Micros refusal_told_ = -kRefusalTold;
  std::string ended_;     ///< reason why all newcomers are refused for good; empty: they are not
  std::string draining_;  ///< the same while existing sessions stay
  std::vector<Reply> goodbyes_;
  std::deque<Reply> replies_;
  SessionCounts counts_;
};

}  // namespace palpate
