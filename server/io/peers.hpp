// Maps addresses to numbers and back, with memory that strangers cannot fill.
//
// The number of an address is its keyed hash (keys.hpp, with a key that the process draws): it is reproducible without being
// stored, two addresses share one with probability 2^-64, and nobody can search for collisions. The reverse mapping is kept for
// served peers, and for strangers until forget_strangers(), which is long enough for an answer.
#pragma once

#include <cstdint>
#include <unordered_map>

#include "common/base/random.hpp"
#include "common/io/endpoint.hpp"
#include "common/trust/keys.hpp"
#include "server/core/handshakes.hpp"

namespace palpate {

class Peers {
 public:
  explicit Peers(const SecretSource& draw) : key_{draw(), draw()} {}

  PeerId id_of(const UdpEndpoint& address);
  /// Returns nullptr for a forgotten peer.
  const UdpEndpoint* address_of(PeerId id) const;
  /// Keeps the addresses for which `serves(PeerId)` is true, and at most twice as many in total.
  template <class Serves>
  void forget_strangers(const Serves& serves) {
    for (const auto& [id, address] : strangers_)
      if (serves(id)) served_.insert({id, address});
    strangers_.clear();
    if (served_.size() <= most_) return;
    std::erase_if(served_, [&](const auto& entry) { return !serves(entry.first); });
    most_ = 2 * served_.size() + kSpare;
  }
  std::size_t size() const { return served_.size() + strangers_.size(); }

 private:
  static constexpr std::size_t kSpare = 64;

  HashKey key_;
  std::unordered_map<PeerId, UdpEndpoint> served_, strangers_;
  std::size_t most_ = kSpare;
};

}  // namespace palpate
