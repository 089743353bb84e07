// HOST:PORT from a flag to a UDP address and a bound socket. Set-up code: faults are thrown as InputError.
#pragma once

#include <asio/io_context.hpp>
#include <asio/ip/udp.hpp>
#include <string>
#include <string_view>

#include "common/base/error.hpp"

namespace palpate {

using UdpEndpoint = asio::ip::udp::endpoint;
using UdpSocket = asio::ip::udp::socket;

/// A fault that may be gone later with the same command line: a name that does not resolve yet, an address that this machine does
/// not have yet, a port that another program still uses.
class AddressNotReady : public InputError {
  using InputError::InputError;
};

struct HostPort {
  std::string host;
  std::uint16_t port = 0;
};

/// Splits "HOST:PORT" or "[IPV6]:PORT"; `where` names the flag in the error. Port 0 asks the system for a free one.
HostPort parse_host_port(std::string_view where, std::string_view text);

/// Returns the address named by `text`, IPv4 first when it has both kinds. Asks the resolver, so it may block for seconds. Throws
/// AddressNotReady for a host that does not resolve.
UdpEndpoint resolve_udp(std::string_view where, std::string_view text);

/// Returns a socket that receives at `address`. Throws AddressNotReady for a port in use or an address of another machine.
UdpSocket bind_udp(asio::io_context& io, std::string_view where, const UdpEndpoint& address);

/// Returns a socket for talking to `server` from any free port of this machine.
UdpSocket open_udp_towards(asio::io_context& io, const UdpEndpoint& server);

/// True for an address that only programs of this machine reach.
bool is_loopback(const UdpEndpoint& endpoint);

/// Returns for example "127.0.0.1:4711" or "[::1]:4711".
std::string to_string(const UdpEndpoint& endpoint);

}  // namespace palpate
