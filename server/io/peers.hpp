// Addresses as numbers, both ways, in bounded memory.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <unordered_map>

#include "common/io/endpoint.hpp"
#include "server/core/station.hpp"

namespace palpate {

/// An address keeps its number while datagrams come from it; one that was silent for kForgetAfter may get another.
class Peers {
 public:
  static constexpr std::size_t kMost = 4096;
  static constexpr Micros kForgetAfter{10'000'000};

  /// Nothing when kMost others were heard lately: a flood of made-up senders must not push out those who are there.
  std::optional<PeerId> id_of(const UdpEndpoint& address, Micros now);
  /// nullptr when forgotten.
  const UdpEndpoint* address_of(PeerId id) const;

 private:
  struct Heard {
    PeerId id = 0;
    Micros at{};
  };
  void forget_silent(Micros now);

  std::map<UdpEndpoint, Heard> ids_;
  std::unordered_map<PeerId, UdpEndpoint> addresses_;
  PeerId last_ = 0;
};

}  // namespace palpate
