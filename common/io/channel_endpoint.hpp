// Conversion between socket addresses and those of the trust channel.
#pragma once

#include "common/io/endpoint.hpp"
#include "common/trust/channel_wire.hpp"

namespace palpate {

inline ChannelAddress channel_address(const UdpEndpoint& from) {
  const auto address = from.address();
  const auto v6 = address.is_v6() ? address.to_v6() : asio::ip::make_address_v6(asio::ip::v4_mapped, address.to_v4());
  return {v6.to_bytes(), from.port(), v6.is_link_local() ? static_cast<std::uint32_t>(v6.scope_id()) : 0};
}

/// For a socket of the same protocol as the one that received the address.
inline UdpEndpoint endpoint_of(const ChannelAddress& to, const asio::ip::udp& protocol) {
  const asio::ip::address_v6 v6(to.ip, to.scope);
  if (protocol == asio::ip::udp::v6()) return {v6, to.port};
  return {asio::ip::make_address_v4(asio::ip::v4_mapped, v6), to.port};
}

}  // namespace palpate
