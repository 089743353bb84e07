#include "server/io/peers.hpp"

#include <algorithm>
#include <array>
#include <asio/ip/address.hpp>

namespace palpate {

PeerId Peers::id_of(const UdpEndpoint& address) {
  // An IPv6 address with its scope, or an IPv4 address and zeros; the port; the kind of address.
  std::array<std::uint8_t, 23> bytes{};
  const auto ip = address.address();
  if (ip.is_v6()) {
    const auto v6 = ip.to_v6();
    const auto raw = v6.to_bytes();
    std::copy(raw.begin(), raw.end(), bytes.begin());
    for (std::size_t k = 0; k < 4; ++k) bytes[18 + k] = static_cast<std::uint8_t>(v6.scope_id() >> 8 * k);
  } else {
    const auto raw = ip.to_v4().to_bytes();
    std::copy(raw.begin(), raw.end(), bytes.begin());
  }
  bytes[16] = static_cast<std::uint8_t>(address.port() >> 8);
  bytes[17] = static_cast<std::uint8_t>(address.port() & 0xff);
  bytes[22] = ip.is_v6() ? 6 : 4;
  const PeerId id = keyed_hash(key_, bytes);
  if (!served_.contains(id)) strangers_.insert_or_assign(id, address);
  return id;
}

const UdpEndpoint* Peers::address_of(PeerId id) const {
  for (const auto* known : {&served_, &strangers_})
    if (const auto found = known->find(id); found != known->end()) return &found->second;
  return nullptr;
}

}  // namespace palpate
