// Addresses as numbers, both ways, in memory that strangers cannot fill.
//
// The number of an address is a keyed hash of it (keys.hpp, of a key that the process draws), so that it is the same whenever
// it is asked for and nothing has to be remembered: two addresses share one with probability 2^-64, and nobody can look for such.
// The way back is known of those whom the server serves, and of strangers until forget_strangers(): long enough for an answer.
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
  /// nullptr when forgotten.
  const UdpEndpoint* address_of(PeerId id) const;
  /// Keeps the addresses of which `serves(PeerId)` says so, at most twice as many as that.
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
