// Who said Hello and has not shown yet that it receives at its address.
//
// A granted Hello is answered with a station number and a secret of 64 random bits, which nobody else knows who does not see the
// answer. The first datagram from the same address that carries both is the proof, and only then is there a station: until then
// this list is all that a Hello holds. It is bounded, kMost of kFor each, and a new one takes the place of the oldest: with
// addresses that somebody made up at 100,000 Hellos a second one stays for 160 ms, in which who receives its answer can use it,
// and who is late asks again.
//
//     place of a handshake = station number mod kMost,     the newest of each sender is found by the sender
//
// so that all takes O(1). The same Hello from the same sender gets the same answer; another one from there has a place of its
// own, as it may be somebody else's.
#pragma once

#include <cstdint>
#include <unordered_map>
#include <utility>
#include <vector>

#include "common/wire/messages.hpp"

namespace palpate {

/// Whoever sent a datagram; the io side maps it to an address. Compared for equality only.
using PeerId = std::uint64_t;

struct Handshake {
  StationId id = 0;  ///< 0: none
  std::uint64_t secret = 0;
  PeerId peer = 0;
  Hello hello;        ///< under the name that the station would have
  std::string asked;  ///< name that it asked for
  Micros at{};
  ClockStamps began_clock{};  ///< of the first of the same Hellos, which came at
  Micros began{};             ///< this moment: the first exchange may span a step of our clock
};

class Handshakes {
 public:
  static constexpr std::size_t kMost = 16384;
  static constexpr Micros kFor{3'000'000};

  /// The one that the same Hello from there began, nullptr when there is none.
  Handshake* begun(PeerId peer, const Hello& hello, Micros now);
  Handshake& begin(Handshake handshake);
  /// The one that this proves, nullptr when there is none.
  const Handshake* proven(StationId id, std::uint64_t secret, PeerId peer, Micros now) const;
  Handshake* proven(StationId id, std::uint64_t secret, PeerId peer, Micros now) {
    return const_cast<Handshake*>(std::as_const(*this).proven(id, secret, peer, now));
  }
  void end(Handshake& handshake);
  /// All of a sender.
  void forget(PeerId peer);
  std::size_t size() const { return newest_.size(); }  ///< senders that have one

 private:
  std::vector<Handshake> places_;
  std::unordered_map<PeerId, StationId> newest_;
};

/// Whether two Hellos ask for the same, names aside.
bool same_wish(const Hello& a, const Hello& b);

}  // namespace palpate
