// The keys of one handshake in use: sealing and opening Data (and Path, which is sealed like Data).
//
// Every datagram is self-contained: it carries its counter, so losses, duplicates and reordering affect no other datagram. A
// counter is never used twice with one key.
#pragma once

#include "common/base/types.hpp"
#include "common/trust/channel_wire.hpp"
#include "common/trust/replay_window.hpp"

namespace palpate {

/// Lifetimes of keys. Shorter in a simulation.
struct ChannelTimes {
  Micros rekey{120'000'000};  ///< age at which a client begins the next handshake
  Micros keep_old{10'000'000};
  Micros stop{180'000'000};  ///< age at which keys expire
};

enum class OpenFault : std::uint8_t { none, replayed, forged };

class Transport {
 public:
  /// `own`: index in datagrams that we receive; `other`: index in datagrams that we send.
  Transport(const SecretKey& send, const SecretKey& receive, std::uint32_t own, std::uint32_t other, Micros born)
      : send_(send), receive_(receive), own_(own), other_(other), born_(born) {}

  std::uint32_t own_index() const { return own_; }
  std::uint32_t other_index() const { return other_; }
  Micros born() const { return born_; }
  bool usable(Micros now, const ChannelTimes& times) const { return now - born_ < times.stop; }

  /// `out`: kDataOverhead more than `plain`. Returns the number of bytes written; 0 when they do not fit.
  std::size_t seal(Bytes plain, BytesOut out, ChannelKind kind = ChannelKind::data);
  /// `plain`: kDataOverhead less than the datagram. `newest`: true when no later counter has arrived.
  [[nodiscard]] OpenFault open(Bytes datagram, BytesOut plain, bool& newest);

 private:
  SecretKey send_, receive_;
  std::uint32_t own_, other_;
  Micros born_;
  std::uint64_t sealed_ = 0;
  ReplayWindow window_;
};

}  // namespace palpate
