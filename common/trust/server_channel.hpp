// The server's end of the trust channel, for all peers, without sockets, threads, clocks or randomness.
//
// Effort that a stranger can cause: none without the server's public key (mac1); with it, one hash and 24 bytes for 512. There is
// no Diffie-Hellman and no state before a cookie has proven that it receives at its address; then as many handshakes as
// HandshakeLimits allow, one X25519 each for unknown keys. A session counts, and its address is trusted, from the first Data on
// that opens. Everything else is ignored without an answer.
//
// A session is one (station key, session number of the client's): new keys, a new address and a SIGHUP of the server do not
// change it. A repeated handshake gets the same answer again; one that is older than the newest of its session gets none, and its
// mac is stored: replaying recorded handshakes does not use up the limits of their key.
//
// The wall clock decides only whether a token is still valid for joining: a change of that clock ends no session.
//
// The newest authenticated counter suggests the address of a client (a NAT that rebinds, a laptop that changes networks), but is
// not trusted: an attacker may replay it from a forged source. So an address that is not proven (paths.hpp) gets a Path, no more
// bytes than came from it, and is served once that came back; until then the previous one is. A server stores no pending
// questions: each datagram asks again, at most once in kAskEvery, so that losses cost no more than elsewhere, and a forged sender
// nothing.
#pragma once

#include <algorithm>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <unordered_map>
#include <utility>
#include <vector>

#include "common/trust/cookies.hpp"
#include "common/trust/handshake_limits.hpp"
#include "common/trust/key_file.hpp"
#include "common/trust/paths.hpp"
#include "common/trust/token.hpp"
#include "common/trust/transport.hpp"

namespace palpate {

/// Identifies a session, from 1 on, never reused.
using ChannelPeer = std::uint64_t;

/// Reason for which a handshake was not answered, or a datagram not opened.
enum class ChannelFault : std::uint8_t {
  malformed,
  mac,            ///< made without our public key
  limit,          ///< too many handshakes
  handshake,      ///< wrong tags: another server's key, or modified in transit
  unknown_key,    ///< unknown key without a token
  token,          ///< not signed for these two keys, or by an unknown issuer
  token_expired,  ///<
  token_used,
  stale,     ///< older than the newest of its session
  full,      ///< too many sessions
  index,     ///< Data for unknown keys
  replayed,  ///<
  forged     ///< Data with a wrong tag
};
inline constexpr std::size_t kChannelFaults = 13;
const char* describe(ChannelFault fault);

struct ServerChannelCounts {
  std::uint64_t cookies = 0, answers = 0, hints = 0, opened = 0, sessions = 0, paths = 0, moves = 0;
  std::array<std::uint64_t, kChannelFaults> faults{};
  std::uint64_t of(ChannelFault fault) const { return faults[static_cast<std::size_t>(fault)]; }
};

/// The last refused handshake, for a log.
struct ChannelRefusal {
  ChannelFault fault = ChannelFault::malformed;
  ChannelAddress from;
  std::optional<PublicKey> key;  ///< claimed key; proven only where the fault is about the token
};

class ServerChannel {
 public:
  using UnixSeconds = std::function<std::int64_t()>;
  static constexpr std::size_t kMostSessions = 1024, kMostAnswers = 256, kMostTokens = 65536;
  /// Stale handshakes that are recognised by their mac: an attacker with more recordings can use up the limits of a key.
  static constexpr std::size_t kMostStale = 4096;
  /// Extra sessions of a key beyond its streams, for those that ended silently; also its largest number of handshakes without
  /// Data.
  static constexpr int kSpareSessions = 8;
  static constexpr Micros kUnconfirmed{20'000'000};  ///< time for which a handshake without Data is kept
  static constexpr Micros kSilent{3'000'000};        ///< silence after which another session of the same key may replace it
  static constexpr Micros kAskEvery{20'000};         ///< interval of Paths to one address
  static constexpr Micros kPathLasts{5'000'000};     ///< lifetime of its cookie: at least this, up to twice as long

  ServerChannel(SiteKeys keys, DrawBytes draw, UnixSeconds unix_now, const ChannelTimes& times = {});

  struct Opened {
    ChannelPeer peer = 0;
    std::size_t size = 0;  ///< size of the session's datagram in `plain`
    bool shown = true;     ///< true: its client receives at the source address
  };
  /// Opens a datagram into `plain`: kMaxDatagramBytes.
  std::optional<Opened> take(Bytes datagram, const ChannelAddress& from, Micros now, BytesOut plain);
  /// Writes the channel's own next answer; returns its size, 0 when there is none.
  std::size_t emit(BytesOut out, ChannelAddress& to);
  /// Seals into `out` (kMaxSealedBytes); returns 0 when the session is gone or its keys have expired.
  std::size_t seal(ChannelPeer peer, Bytes plain, BytesOut out, ChannelAddress& to, Micros now);
  /// Ends sessions that are too old, or whose token has expired.
  void tick(Micros now);
  /// Replaces the keys. Ends the sessions of removed stations and of those whose rights changed.
  void change_keys(SiteKeys keys);
  /// Returns the sessions that ended since the last call and had sent Data. They can be sealed to until forget().
  std::vector<ChannelPeer> take_ended() { return std::exchange(ended_, {}); }
  void forget(ChannelPeer peer);

  /// Returns nullptr when the session is gone.
  const Rights* rights(ChannelPeer peer) const;
  const PublicKey* key(ChannelPeer peer) const;
  const PublicKey& self() const { return self_; }
  std::size_t sessions() const { return sessions_.size(); }
  const ServerChannelCounts& counts() const { return counts_; }
  std::optional<ChannelRefusal> take_refusal() { return std::exchange(refusal_, std::nullopt); }

 private:
  static constexpr std::size_t kMostAnswerBytes = std::max(kRespBytes, kPathBytes);
  struct Session {
    ChannelPeer peer = 0;
    PublicKey key;
    std::uint64_t number = 0;
    Rights rights;
    bool by_token = false, confirmed = false, ending = false;
    Micros ends = Micros::max();  ///< end set by a token
    PublicKey issuer;             ///< issuer of that token
    Paths paths;
    ChannelAddress asked;  ///< the address to which the last Path was sent
    Micros ask_again{};
    std::optional<Transport> current, old, next;
    Micros old_until{}, begun{}, heard{};
    std::uint32_t attempt = 0;
    Mac answered{};  ///< mac1 of the Init that was answered by `answer`
    std::array<std::uint8_t, kRespBytes> answer{};
  };
  struct Answer {
    ChannelAddress to;
    std::array<std::uint8_t, kMostAnswerBytes> bytes{};
    std::size_t size = 0;
  };
  struct UsedToken {
    Micros until{};
    std::map<std::uint64_t, Micros> sessions;  ///< end of each session, however often it restarts
  };
  struct Admission {
    Rights rights;
    bool by_token = false;
    Micros ends = Micros::max();
    PublicKey issuer;
  };

  std::optional<Opened> fail(ChannelFault fault);
  void refuse(ChannelFault fault, const ChannelAddress& from, const PublicKey* key);
  void answer(const ChannelAddress& to, Bytes bytes);
  void take_init(Bytes datagram, const ChannelAddress& from, Micros now);
  void remember_stale(const Mac& mac);
  void shake_hands(Bytes datagram, const Mac& mac, const ChannelAddress& from, Neighbour lives, Micros now);
  std::optional<Admission> admit(const PublicKey& key, const InitPayload& payload, Session* known, Micros now, ChannelFault& why);
  std::optional<Admission> admit_token(const PublicKey& key, const InitPayload& payload, Session* known, Micros now,
                                       ChannelFault& why);
  Session* find(const PublicKey& key, std::uint64_t number);
  bool make_room_for(const PublicKey& key, int streams, Micros now);
  std::optional<Opened> take_data(Bytes datagram, const ChannelAddress& from, Micros now, BytesOut plain);
  bool follow(Session& session, const ChannelAddress& from, std::size_t bytes, Micros now);
  void ask(Session& session, const ChannelAddress& from, Micros now);
  void take_path(Session& session, Bytes text, Micros now);
  Transport* keys_at(Session& session, std::uint32_t index, Micros now);
  void confirm(Session& session, Micros now);
  void drop_keys(std::optional<Transport>& slot);
  bool is_over(const Session& session, Micros now) const;
  bool still_believed(const Session& session) const;
  std::uint32_t draw_index();
  void end(Session& session);

  SiteKeys keys_;
  PublicKey self_;
  std::array<std::uint8_t, 32> mac1_key_;
  DrawBytes draw_;
  UnixSeconds unix_now_;
  ChannelTimes times_;
  Cookies cookies_, path_cookies_;
  HandshakeLimits limits_;
  PlaceLimits hint_limits_{kHandshakesPrefix, kHandshakesAll};
  std::map<ChannelPeer, Session> sessions_;
  std::unordered_map<std::uint32_t, ChannelPeer> indices_;
  std::map<TokenId, UsedToken> used_;
  std::set<Mac> stale_;
  std::deque<Mac> stale_in_order_;  ///< oldest first
  std::deque<Answer> answers_;
  std::vector<ChannelPeer> ended_;
  std::optional<ChannelRefusal> refusal_;
  ChannelPeer last_ = 0;
  Micros next_sweep_{};
  ServerChannelCounts counts_;
};

}  // namespace palpate
