// The session of a client with a server, without sockets, threads or clocks: what a station (client_core.hpp) and a viewer
// (view_core.hpp) have in common.
//
//     joining    Hello every kHelloEvery until Welcome
//     joined     until the server refuses the client as unknown, says goodbye (a restarted server has another instance number),
//     or
//                has been silent for kLostAfter; then joining again, after a Leave where the server may still receive us, so that
//                it frees the name
//     refused    for another reason (name in use, wrong version, ...), which is reported; Hello every kRetryEvery
//
// A Hello carries the number and secret of the former session, so that the server recognises a client whose address changed and
// ends the former session with the beginning of the new one (server/core/sessions.hpp).
//
// Forged datagrams: every datagram of a server echoes the microsecond at which we sent the newest one that it received
// (ClockStamps::echo; a Refuse echoes the one that it answers). A datagram that echoes none of our last kSentKept is ignored: an
// attacker off the path has to guess one of several hundred microseconds of the last second. An attacker on the path sees them;
// only a key keeps out that one.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string>

#include "client/core/parts_assembly.hpp"
#include "client/core/sent_stamps.hpp"
#include "common/session/clock_sync.hpp"
#include "common/session/reset_request.hpp"
#include "common/wire/codec.hpp"
#include "common/wire/messages.hpp"

namespace palpate {

inline constexpr Micros kHelloEvery{250'000};
inline constexpr Micros kRetryEvery{1'000'000};  ///< Hello after a refusal
inline constexpr Micros kLostAfter{3'000'000};   ///< silence after which a server counts as gone

enum class LinkState : std::uint8_t { joining, joined, refused };

struct ClientTraffic {
  std::uint64_t sent = 0, received = 0, bytes_sent = 0, bytes_received = 0, joins = 0;
  std::uint64_t stale = 0;                           ///< from another session than the present one
  std::uint64_t unproven = 0;                        ///< in the server's name, but without an echo of our own stamps
  std::array<std::uint64_t, kWireFaults> dropped{};  ///< includes the patches that did not pass check()
};

class ClientSession {
 public:
  LinkState link() const { return link_; }
  /// The last Welcome, valid after the first join. Where the server assigned no name it carries the requested one.
  const Welcome& welcome() const { return welcome_; }
  /// Reason of the refusal; while joining again, the reason for that; also the reason why a reset was refused.
  const std::string& refusal() const { return refusal_.message; }
  /// Rigid parts of the scene, once all have arrived.
  const std::vector<PartMesh>& parts() const { return parts_.parts(); }
  /// True once it is known which parts the scene has.
  bool has_parts() const { return parts_.complete(); }
  /// Changes with parts().
  std::uint64_t parts_version() const { return parts_.version(); }
  RefuseReason refuse_reason() const { return refusal_.reason; }
  const ClockSync& clock() const { return clock_; }
  /// Time of the newest datagram of the session; the start of the client before the first.
  Micros last_heard() const { return heard_; }
  /// Time of the newest datagram that answered one of ours, refusals included; the start of the client before the first.
  Micros last_answer() const { return answered_; }
  /// True when that datagram said that the server is shutting down.
  bool sent_away() const { return sent_away_; }
  /// Requests a reset of the body to rest, sent as soon as the server is there.
  void ask_reset() { reset_.ask(); }
  bool reset_pending() const { return reset_.pending(); }

 protected:
  enum class Event : std::uint8_t {
    none,      ///< nothing to handle
    joined,    ///< a new session began
    resumed,   ///< the previous session continues after a silence
    ended,     ///< the server ended the session or fell silent: the client is joining again
    message,   ///< a datagram of the session
    unusable,  ///< one whose patch check() refuses; `message` has its head
    denied     ///< `message` is the refusal of a request of this session, which continues
  };

  ClientSession(Hello hello, Micros now);

  /// Decodes a datagram into `message`.
  Event receive(std::span<const std::byte> bytes, Message& message, Micros now);
  /// Returns `ended` when the server has been silent for kLostAfter.
  Event advance(Micros now);
  /// Writes the next Leave, Hello or Reset into `out`. Returns its size, 0 when there is none.
  std::size_t emit_own(std::span<std::byte> out, Micros now);
  /// Writes a datagram of the session into `out`. Returns its size, 0 when it does not fit.
  std::size_t say(Payload body, std::span<std::byte> out, Micros now);
  /// Moment of the next advance(); Micros::max() after leave().
  Micros deadline() const;
  /// Says goodbye and ends for good.
  void leave();

  bool joined() const { return link_ == LinkState::joined && !left_; }
  bool left() const { return left_; }
  const Hello& hello() const { return hello_; }
  const ClientTraffic& counts() const { return counts_; }

 private:
  void note_fault(WireFault fault);
  bool is_ours(const Message& message) const;
  void hear(Micros now);
  Event receive_welcome(const Message& message, const Welcome& welcome, Micros now);
  Event receive_refuse(const Message& message, const Refuse& refusal, Micros now);
  void join_again(Micros now);

  Hello hello_;
  LinkState link_ = LinkState::joining;
  std::uint64_t instance_ = 0;
  StationId station_ = 0;
  std::uint32_t seq_out_ = 0;
  ClockSync clock_;
  SentStamps sent_;
  ResetRequest reset_;
  Welcome welcome_;
  PartsAssembly parts_;
  Refuse refusal_;
  Micros heard_, answered_, next_hello_;
  bool hello_due_ = false, leave_due_ = false, left_ = false, sent_away_ = false;
  std::uint64_t unproven_before_ = 0;  ///< value of the counter when the server was last heard
  ClientTraffic counts_;
};

}  // namespace palpate
