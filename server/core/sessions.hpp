// Who is in the room: handshake, names, seats, leaving, silence.
//
// A Hello is granted with Welcome or refused. Welcome gives a station number and, as instance, a secret (handshakes.hpp); who
// uses both from the same address receives there, and only then has a name, a seat, a node or a frame, if what it asked for can
// still be granted: else it is refused as unknown, and hears why when it asks again. The same Hello from the same sender has the
// same answer, as it may have been lost. A name belongs to one station; another one gets it after kSilentAfter of silence, or
// when it has shown that it receives at the very address of the one before. Datagrams with another secret, number or sender
// change nothing: who does not see a station's datagrams can neither end it nor speak for it, except by guessing 64 bits.
//
// A successor is a newer session of the holder's own key (succeeds(); without keys there is none): a program that crashed and was
// started again. It gets the name when nothing of the holder has come for kSuccessorAfter, or when it has asked for a round trip
// of the holder (the least: what comes late makes the mean longer) and kSuccessorProof and the holder has echoed nothing that it
// was sent since: what a dead one said and somebody brings late holds up nobody. Until then its Hello is not answered, and comes
// again after kHelloEvery; a holder that lives has echoed, and the successor is refused, or with `alike` gets another name. A
// session that lost its name is the older one, and gets it back as anybody does: of two programs that run with one key and one
// name neither takes over while the other is heard.
//
// An unknown sender is answered with at most as many bytes as it sent, and with no secret but its own.
//
// Seats: kMaxStations in a room, of which shadows have at most kMostShadows and viewers kMostViewers, so that hands find one.
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
#include "server/core/room_facts.hpp"
#include "server/core/server_options.hpp"
#include "server/core/station.hpp"

namespace palpate {

inline constexpr Micros kSilentAfter{1'000'000};            ///< another peer may take the name of a station silent for so long
inline constexpr Micros kSuccessorAfter{250'000};           ///< the same for a successor, where the holder has a hand
inline constexpr Micros kSuccessorProof{500'000};           ///< beyond its round trip, for a holder to echo what it is sent
inline constexpr Micros kGoneAfter{3'000'000};              ///< a station silent for so long has left
inline constexpr int kMostShadows = 16, kMostViewers = 16;  ///< of a room
inline constexpr std::size_t kRefuseReasons = 7;
inline constexpr Micros kRefusalTold{100'000};  ///< at least, from one refusal that listeners hear of to the next

struct SessionCounts {
  std::uint64_t unknown_station = 0;  ///< datagrams with an id that nobody here has
  std::uint64_t joins = 0, refusals = 0, leaves = 0, timeouts = 0;
  std::uint64_t replaced = 0, expelled = 0, told_goodbye = 0;  ///< stations that went: for another of their name, by key, with us
  std::array<std::uint64_t, kRefuseReasons> refused{};         ///< `refusals` by reason; goodbyes are none
  std::uint64_t answers_withheld = 0;                          ///< larger than the question, or too many at once
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
  /// Whether a station or a handshake is meant.
  bool knows(const Message& message, PeerId from, Micros now) const;
  bool serves(PeerId peer) const;
  /// Bytes of the next answer to a Hello or to a stranger, 0 when there is none.
  std::size_t emit(std::span<std::byte> out, PeerId& to, Micros now);
  /// Who comes from now on is refused with RefuseReason::shutting_down; who is there stays.
  void drain(const std::string& why) { draining_ = why; }
  bool draining() const { return !draining_.empty(); }
  /// Everyone is told and forgotten; `ended`: for good, so that whoever comes is refused with that.
  void shut_down(const std::string& why, bool ended, Micros now);
  /// Those whom shut_down() told are told again.
  void repeat_goodbyes(Micros now);

  /// All stations and handshakes of a peer are told so, and forgotten: its key does not count any more.
  void expel(PeerId peer, Micros now);
  void refuse(const Message& question, PeerId to, const Refuse& refusal, std::size_t limit, Micros now);

  Stations& stations() { return stations_; }
  const Stations& stations() const { return stations_; }
  const SessionCounts& counts() const { return counts_; }
  void tell(RecordedEventKind kind, const Station& station, const std::string& text, Micros now) const;

  /// Hears who comes, goes and is refused, and why.
  std::function<void(const RecordedEvent&)> on_event;
  /// Whether two senders have one key and the first is the newer session; empty: there are no keys.
  std::function<bool(PeerId, PeerId)> succeeds;

 private:
  struct Reply {
    PeerId to = 0;
    Message message;  ///< a Welcome or Refuse
    std::size_t limit = 0;
    Micros at{};
  };

  void take_hello(const Message& message, PeerId from, std::size_t size, Micros now);
  Station* take_from(Station& station, const Message& message, Micros now);
  const Station* find(const Message& message, PeerId from) const;
  Station* find(const Message& message, PeerId from) { return const_cast<Station*>(std::as_const(*this).find(message, from)); }
  Station* admit(Handshake& handshake, Micros now);
  StationId new_id();
  Welcome welcome_for(const Hello& hello) const;
  std::optional<Refuse> objection(const Hello& hello, PeerId from, Micros now) const;
  bool is_successor(const Station& holder, PeerId from) const;
  bool gives_way(const Station& holder, PeerId from, Micros now) const;
  bool has_to_wait(const Hello& hello, PeerId from, Micros now);
  std::optional<Refuse> lack_of_seats(const Hello& hello, const Station* in_place_of) const;
  void answer(const Message& question, Message answer, PeerId to, std::size_t limit, Micros now);
  void say_goodbye(const Station& station, const Refuse& why, Micros now);
  Station* asked_before(const Hello& hello, PeerId from);
  std::string free_name(const std::string& like, PeerId from, Micros now) const;
  void tell(RecordedEventKind kind, StationId id, const Hello& hello, const std::string& text, Micros now) const;

  Welcome welcome_;  ///< but for the station's name, and deadband where it gets none
  SecretSource draw_;
  std::string room_, rooms_;
  Stations stations_;
  Handshakes handshakes_;
  StationId last_id_ = 0;
  Micros refusal_told_ = -kRefusalTold;
  std::string ended_;     ///< why nobody is let in any more, empty: everybody is
  std::string draining_;  ///< the same, while those who are there stay
  std::vector<Reply> goodbyes_;
  std::deque<Reply> replies_;
  SessionCounts counts_;
};

}  // namespace palpate
