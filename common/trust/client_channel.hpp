// The client's end of the trust channel, without sockets, threads, clocks or chance.
//
// Life: Init every kInitEvery, with the cookie as soon as the server has sent one, until Resp -> keys. After times.rekey, after a
// Hint, and when nothing has come for kChannelSilence, the next handshake runs beside the session, which goes on with the keys
// that it has; the old ones still open what is under way for times.keep_old. Keys with which no Data has come back are replaced
// for their age only when they are of no use any more: the server may still seal with those before, and holds no more than one
// pair that was not used, so that what is under way would be lost. A Cookie counts only for the handshake that runs, a Hint only
// for keys in use, and neither does more than have an Init sent, at most one for each kInitEvery beyond the cadence.
//
// Nothing says who made a Cookie. Somebody on the way who answers each Init with n of his own, sooner than the server or later,
// would win if the first or the newest counted: so one is drawn, and a server answers an Init with a wrong one by its own again.
// At least four Inits a second carry one that was drawn, so a handshake is late by (n + 1) / 4 s in the mean, and fifty forged
// cookies an Init end a session between times.rekey and times.stop in one case of a hundred.
//
// A Path, by which the server asks whether we receive where our datagrams seem to come from, goes back as it is. It is no sign of
// life: where our answers do not get there, the silence is still to end in a handshake, which shows the address too.
//
// What the session has to say waits until ready(): whoever drives it calls its emit() only then.
#pragma once

#include <deque>
#include <optional>
#include <vector>

#include "common/trust/transport.hpp"

namespace palpate {

/// Who we are, whom we talk to, and what we may show for it.
struct ClientKeys {
  SecretKey self;
  PublicKey server;
  std::vector<std::uint8_t> token = {};  ///< empty: the server knows our key
};

inline constexpr Micros kInitEvery{250'000};
inline constexpr Micros kAttemptLasts{15'000'000};  ///< then another ephemeral key; longer than two round trips
inline constexpr Micros kBeginEvery{1'000'000};     ///< handshakes, at most
inline constexpr Micros kChannelSilence{3'000'000};

struct ClientChannelCounts {
  std::uint64_t inits = 0, handshakes = 0, opened = 0, replayed = 0, forged = 0, unknown = 0, hints = 0, paths = 0;
};

class ClientChannel {
 public:
  /// `version`: of the wire, told to the server.
  ClientChannel(const ClientKeys& keys, std::uint16_t version, DrawBytes draw, Micros now, const ChannelTimes& times = {});

  /// A datagram from the server's address. Returns the bytes of the session's datagram in it, written into `plain`
  /// (kMaxDatagramBytes), 0 when there is none.
  std::size_t take(Bytes datagram, Micros now, BytesOut plain);
  void tick(Micros now);
  /// The channel's own next datagram, 0 when there is none.
  std::size_t emit(BytesOut out, Micros now);
  bool ready(Micros now) const { return current_ && current_->usable(now, times_); }
  /// A datagram of the session, sealed into `out` (kMaxSealedBytes); 0 when not ready().
  std::size_t seal(Bytes plain, BytesOut out, Micros now);
  /// When tick() is due.
  Micros deadline() const;
  const ClientChannelCounts& counts() const { return counts_; }

 private:
  static constexpr std::size_t kMostPaths = 8;
  struct Handshake {
    NoiseInitiator noise;
    std::uint32_t index;
    std::array<std::uint8_t, kInitBytes> init;
    Micros begun, next_send, next_answer;  ///< next_answer: to a Cookie
    std::uint32_t cookies;                 ///< since the last Init
  };
  void begin(Micros now);
  void take_cookie(Bytes datagram, Micros now);
  void take_resp(Bytes datagram, Micros now);
  void take_hint(Bytes datagram);
  /// Of Data or Path.
  bool open(Bytes datagram, Micros now, BytesOut plain);
  std::size_t take_data(Bytes datagram, Micros now, BytesOut plain);
  void take_path(Bytes datagram, Micros now);
  std::uint32_t draw_number();
  bool wants_keys(Micros now) const;
  Micros too_old() const;  ///< when the current keys are to be replaced for their age

  ClientKeys keys_;
  std::uint16_t version_;
  DrawBytes draw_;
  ChannelTimes times_;
  std::uint64_t session_ = 0;
  std::uint32_t attempts_ = 0;
  std::optional<Handshake> handshake_;
  std::optional<Transport> current_, old_;
  std::deque<PathText> paths_;  ///< to go back
  Micros old_until_{}, heard_{}, next_begin_{};
  bool hinted_ = false, asked_ = false;  ///< asked_: something was sealed since the server was heard
  bool confirmed_ = false;               ///< Data came that the current keys opened
  ClientChannelCounts counts_;
};

}  // namespace palpate
