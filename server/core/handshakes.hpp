// Handshakes of peers that sent Hello and have not yet proved that they receive at their address.
//
// The answer to a granted Hello holds a station number and a secret of 64 random bits, known only to those who see the answer.
// The first datagram from the same address that carries both is the proof, and only then is a station created: until then this
// list is all that a Hello allocates. The list is bounded (kMost entries, each for kFor), and a new entry overwrites the oldest.
// Under 100,000 Hellos per second from spoofed addresses an entry survives for 160 ms; a peer that answers within that time
// joins, a later one asks again.
//
//     place of a handshake = station number mod kMost,     the newest of each sender is found by the sender
//
// so every operation is O(1). The same Hello from the same sender gets the same answer; a different Hello from there gets its own
// entry, as it may come from another program.
#pragma once

#include <cstdint>
#include <unordered_map>
#include <utility>
#include <vector>

#include "common/wire/messages.hpp"

namespace palpate {

/// Sender of a datagram; the I/O layer maps it to an address. Compared for equality only.
using PeerId = std::uint64_t;

struct Handshake {
  StationId id = 0;  ///< 0: none
  std::uint64_t secret = 0;
  PeerId peer = 0;
  Hello hello;        ///< the Hello, with the name that the station would have
  std::string asked;  ///< name that the peer asked for
  Micros at{};
  ClockStamps began_clock{};  ///< clock stamps of the first of the identical Hellos
  Micros began{};             ///< arrival of that Hello: the first exchange may span a step of our clock
  StationId former = 0;       ///< station of the same client at another address; 0: none
};

class Handshakes {
 public:
  static constexpr std::size_t kMost = 16384;
  static constexpr Micros kFor{3'000'000};

  /// Handshake that the same Hello from this peer began; nullptr if there is none.
  Handshake* begun(PeerId peer, const Hello& hello, Micros now);
  Handshake& begin(Handshake handshake);
  /// Handshake that this datagram proves; nullptr if there is none.
  const Handshake* proven(StationId id, std::uint64_t secret, PeerId peer, Micros now) const;
  Handshake* proven(StationId id, std::uint64_t secret, PeerId peer, Micros now) {
    return const_cast<Handshake*>(std::as_const(*this).proven(id, secret, peer, now));
  }
  void end(Handshake& handshake);
  /// Removes all handshakes of a sender.
  void forget(PeerId peer);
  std::size_t size() const { return newest_.size(); }  ///< senders with a handshake

 private:
  std::vector<Handshake> places_;
  std::unordered_map<PeerId, StationId> newest_;
};

/// Returns true if two Hellos ask for the same, apart from names.
bool same_wish(const Hello& a, const Hello& b);

}  // namespace palpate
