// The client's end of the trust channel, without sockets, threads, clocks or randomness.
//
// Life: Init every kInitEvery, with the cookie as soon as the server has sent one, until Resp -> keys. After times.rekey, after a
// Hint, and after kChannelSilence, the next handshake runs in parallel with the session, which continues with its keys; the old
// keys still open datagrams in flight for times.keep_old. Keys under which no Data has arrived are replaced only when they have
// expired: the server may still seal with the ones before, and holds no more than one unused pair, so datagrams in flight would
// be lost. A Cookie counts only for the running handshake, a Hint only for keys in use, and either causes at most an Init, at
// most one for each kInitEvery beyond the cadence.
//
// Cookies are not authenticated. An attacker on the path that answers each Init with n cookies of its own, before or after the
// server, would win if the first or the newest counted: so one is drawn at random, and a server answers an Init with a wrong
// cookie by sending its own again. At least four Inits a second carry a drawn one, so a handshake is delayed by (n + 1) / 4 s in
// the mean, and fifty forged cookies an Init end a session between times.rekey and times.stop in one case of a hundred.
//
// A Path, by which the server asks whether we receive at the apparent source of our datagrams, is returned unchanged. It is no
// sign of life: if our answers do not arrive, the silence shall still end in a handshake, which proves the address too.
//
// The session's datagrams wait until ready(): the caller calls its emit() only then.
#pragma once

#include <deque>
#include <optional>
#include <vector>

#include "common/trust/transport.hpp"

namespace palpate {

/// Our identity, the server's, and our token.
struct ClientKeys {
  SecretKey self;
  PublicKey server;
  std::vector<std::uint8_t> token = {};  ///< empty: the server knows our key
};

inline constexpr Micros kInitEvery{250'000};
inline constexpr Micros kAttemptLasts{15'000'000};  ///< then another ephemeral key; longer than two round trips
inline constexpr Micros kBeginEvery{1'000'000};     ///< shortest interval between handshakes
inline constexpr Micros kChannelSilence{3'000'000};

struct ClientChannelCounts {
  std::uint64_t inits = 0, handshakes = 0, opened = 0, replayed = 0, forged = 0, unknown = 0, hints = 0, paths = 0;
};

class ClientChannel {
 public:
  /// `version`: wire version, sent to the server.
  ClientChannel(const ClientKeys& keys, std::uint16_t version, DrawBytes draw, Micros now, const ChannelTimes& times = {});

  /// Processes a datagram from the server's address. Writes the session's datagram in it into `plain` (kMaxDatagramBytes);
  /// returns its size, 0 when there is none.
  std::size_t take(Bytes datagram, Micros now, BytesOut plain);
  void tick(Micros now);
  /// Writes the channel's own next datagram; returns its size, 0 when there is none.
  std::size_t emit(BytesOut out, Micros now);
  bool ready(Micros now) const { return current_ && current_->usable(now, times_); }
  /// Seals a datagram of the session into `out` (kMaxSealedBytes); returns 0 when not ready().
  std::size_t seal(Bytes plain, BytesOut out, Micros now);
  /// Time at which tick() is due.
  Micros deadline() const;
  const ClientChannelCounts& counts() const { return counts_; }

 private:
  static constexpr std::size_t kMostPaths = 8;
  struct Handshake {
    NoiseInitiator noise;
    std::uint32_t index;
    std::array<std::uint8_t, kInitBytes> init;
    Micros begun, next_send, next_answer;  ///< next_answer: earliest answer to a Cookie
    std::uint32_t cookies;                 ///< number since the last Init
  };
  void begin(Micros now);
  void take_cookie(Bytes datagram, Micros now);
  void take_resp(Bytes datagram, Micros now);
  void take_hint(Bytes datagram);
  /// Opens a Data or Path.
  bool open(Bytes datagram, Micros now, BytesOut plain);
  std::size_t take_data(Bytes datagram, Micros now, BytesOut plain);
  void take_path(Bytes datagram, Micros now);
  std::uint32_t draw_number();
  bool wants_keys(Micros now) const;
  Micros too_old() const;  ///< time at which the current keys are replaced for their age

  ClientKeys keys_;
  std::uint16_t version_;
  DrawBytes draw_;
  ChannelTimes times_;
  std::uint64_t session_ = 0;
  std::uint32_t attempts_ = 0;
  std::optional<Handshake> handshake_;
  std::optional<Transport> current_, old_;
  std::deque<PathText> paths_;  ///< to be returned
  Micros old_until_{}, heard_{}, next_begin_{};
  bool hinted_ = false, asked_ = false;  ///< asked_: something was sealed since the server was heard
  bool confirmed_ = false;               ///< true: Data arrived that the current keys opened
  ClientChannelCounts counts_;
};

}  // namespace palpate
