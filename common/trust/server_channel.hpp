// The server's end of the trust channel, for all peers, without sockets, threads, clocks or chance.
//
// What a stranger can make it do: nothing at all without the server's public key (mac1); with it, one hash and 24 bytes for his
// 512. No Diffie-Hellman and no state before he has shown by a cookie that he receives at his address; then as many handshakes as
// HandshakeLimits allow, one X25519 each for those whose key nobody here knows. A session counts, and its address is believed,
// from the first Data on that opens. All else is silence.
//
// A session is one (station key, session number of the client's): new keys, a new address and a server's SIGHUP leave it as it
// is. A handshake that is repeated gets the same answer again, one that is older than the newest of its session none, and is
// known by its mac from then on: who plays recorded ones again uses up nothing of their key's.
//
// The clock on the wall says whether a token came in time to join, and nothing else: one that is set ends no session.
//
// The newest authenticated counter says where a client is (a NAT that rebinds, a laptop that changes networks), and is not
// believed: its holder may forge the sender. So an address that has not been shown (paths.hpp) gets a Path, no more bytes than
// came from it, and is served when that came back; until then the one before is. A server remembers nothing of what it asked:
// each datagram asks again, at most one for each kAskEvery, so that losses cost what they cost elsewhere, and a forged sender
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

/// Of a session, from 1 on, never used twice.
using ChannelPeer = std::uint64_t;

/// Why a handshake was not answered, or a datagram not opened.
enum class ChannelFault : std::uint8_t {
  malformed,
  mac,            ///< made without our public key
  limit,          ///< too many handshakes
  handshake,      ///< tags do not fit: another server's key, or changed on the way
  unknown_key,    ///< and no token
  token,          ///< not signed for these two, or by nobody whom we believe
  token_expired,  ///<
  token_used,
  stale,     ///< older than the newest of its session
  full,      ///< too many sessions
  index,     ///< Data for keys that nobody here has
  replayed,  ///<
  forged     ///< Data whose tag does not fit
};
inline constexpr std::size_t kChannelFaults = 13;
const char* describe(ChannelFault fault);

struct ServerChannelCounts {
  std::uint64_t cookies = 0, answers = 0, hints = 0, opened = 0, sessions = 0, paths = 0, moves = 0;
  std::array<std::uint64_t, kChannelFaults> faults{};
  std::uint64_t of(ChannelFault fault) const { return faults[static_cast<std::size_t>(fault)]; }
};

/// The last handshake that was refused, for a log that a person reads.
struct ChannelRefusal {
  ChannelFault fault = ChannelFault::malformed;
  ChannelAddress from;
  std::optional<PublicKey> key;  ///< who says he has it; proven only where the fault is about the token
};

class ServerChannel {
 public:
  using UnixSeconds = std::function<std::int64_t()>;
  static constexpr std::size_t kMostSessions = 1024, kMostAnswers = 256, kMostTokens = 65536;
  /// Handshakes found stale that are known again by their mac: whoever recorded so many may use up what a key may ask for.
  static constexpr std::size_t kMostStale = 4096;
  /// Of a key beyond its streams: lives that ended without a word, and as many handshakes.
  static constexpr int kSpareSessions = 8;
  static constexpr Micros kUnconfirmed{20'000'000};  ///< that a handshake is remembered without Data
  static constexpr Micros kSilent{3'000'000};        ///< then a session gives its place to another one of its key
  static constexpr Micros kAskEvery{20'000};         ///< for a Path, of one address
  static constexpr Micros kPathLasts{5'000'000};     ///< that it may take to come back, and up to twice that

  ServerChannel(SiteKeys keys, DrawBytes draw, UnixSeconds unix_now, const ChannelTimes& times = {});

  struct Opened {
    ChannelPeer peer = 0;
    std::size_t size = 0;  ///< of the session's datagram in `plain`
    bool shown = true;     ///< its client receives where it came from
  };
  /// `plain`: kMaxDatagramBytes.
  std::optional<Opened> take(Bytes datagram, const ChannelAddress& from, Micros now, BytesOut plain);
  /// The channel's own next answer, 0 when there is none.
  std::size_t emit(BytesOut out, ChannelAddress& to);
  /// Into `out` (kMaxSealedBytes); 0 when the session is gone or its keys too old.
  std::size_t seal(ChannelPeer peer, Bytes plain, BytesOut out, ChannelAddress& to, Micros now);
  /// Sessions end here: too old, or as their token says.
  void tick(Micros now);
  /// Who is not there any more, or has other rights, ends.
  void change_keys(SiteKeys keys);
  /// Those that ended since the last call and that had sent Data. They may still be sealed to until forget().
  std::vector<ChannelPeer> take_ended() { return std::exchange(ended_, {}); }
  void forget(ChannelPeer peer);

  /// nullptr when it is gone.
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
    Micros ends = Micros::max();  ///< where a token says so
    PublicKey issuer;             ///< of that token
    Paths paths;
    ChannelAddress asked;  ///< for a Path, when last
    Micros ask_again{};
    std::optional<Transport> current, old, next;
    Micros old_until{}, begun{}, heard{};
    std::uint32_t attempt = 0;
    Mac answered{};  ///< mac1 of the Init that got `answer`
    std::array<std::uint8_t, kRespBytes> answer{};
  };
  struct Answer {
    ChannelAddress to;
    std::array<std::uint8_t, kMostAnswerBytes> bytes{};
    std::size_t size = 0;
  };
  struct UsedToken {
    Micros until{};
    std::map<std::uint64_t, Micros> sessions;  ///< when each is over, however often it begins anew
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
  std::deque<Mac> stale_in_order_;  ///< the oldest first
  std::deque<Answer> answers_;
  std::vector<ChannelPeer> ended_;
  std::optional<ChannelRefusal> refusal_;
  ChannelPeer last_ = 0;
  Micros next_sweep_{};
  ServerChannelCounts counts_;
};

}  // namespace palpate
