#include "common/io/endpoint.hpp"

#include <asio/socket_base.hpp>
#include <charconv>

#include "common/base/error.hpp"

namespace palpate {
namespace {

constexpr char kExpected[] = "HOST:PORT, for example 127.0.0.1:4711";
constexpr int kSocketBufferBytes = 1 << 20;

InputError wrong(std::string_view where, const std::string& what, const std::string& expected = kExpected) {
  return InputError(std::string(where), what, expected);
}

void widen_buffers(UdpSocket& socket) {
  asio::error_code ignored;  // a smaller buffer than requested works too
  socket.set_option(asio::socket_base::receive_buffer_size(kSocketBufferBytes), ignored);
  socket.set_option(asio::socket_base::send_buffer_size(kSocketBufferBytes), ignored);
}

}  // namespace

HostPort parse_host_port(std::string_view where, std::string_view text) {
  const std::string quoted = '"' + std::string(text) + '"';
  const auto colon = text.rfind(':');
  if (colon == std::string_view::npos) throw wrong(where, quoted + " has no port");
  std::string_view host = text.substr(0, colon);
  const std::string_view port = text.substr(colon + 1);
  if (host.size() >= 2 && host.front() == '[' && host.back() == ']')
    host = host.substr(1, host.size() - 2);
  else if (host.find_first_of(":[]") != std::string_view::npos)
    throw wrong(where, quoted + " is not a host and a port", "HOST:PORT, an IPv6 address as [::1]:4711");
  if (host.empty()) throw wrong(where, quoted + " has no host");
  std::uint16_t number = 0;
  const auto [end, fault] = std::from_chars(port.data(), port.data() + port.size(), number);
  if (fault != std::errc{} || end != port.data() + port.size())
    throw wrong(where, "port \"" + std::string(port) + "\" in " + quoted, "a port from 0 to 65535");
  return {std::string(host), number};
}

UdpEndpoint resolve_udp(std::string_view where, std::string_view text) {
  const HostPort wanted = parse_host_port(where, text);
  asio::error_code fault;
  const auto literal = asio::ip::make_address(wanted.host, fault);
  if (!fault) return {literal, wanted.port};
  asio::io_context io;
  asio::ip::udp::resolver resolver(io);
  const auto found = resolver.resolve(wanted.host, std::to_string(wanted.port), fault);
  if (fault || found.empty())
    throw AddressNotReady(std::string(where), "host \"" + wanted.host + "\" does not resolve (" + fault.message() + ")",
                          "a known host name or an address");
  for (const auto& entry : found)
    if (entry.endpoint().address().is_v4()) return entry.endpoint();
  return found.begin()->endpoint();
}

UdpSocket bind_udp(asio::io_context& io, std::string_view where, const UdpEndpoint& address) {
  UdpSocket socket(io);
  asio::error_code fault;
  socket.open(address.protocol(), fault);
  if (!fault) socket.bind(address, fault);
  if (fault == asio::error::address_in_use)
    throw AddressNotReady(std::string(where), "port " + std::to_string(address.port()) + " is in use",
                          "a free UDP port, or 0 for any");
  if (fault)
    throw AddressNotReady(std::string(where), "cannot listen at " + to_string(address) + " (" + fault.message() + ")",
                          "an address of this machine");
  widen_buffers(socket);
  return socket;
}

UdpSocket open_udp_towards(asio::io_context& io, const UdpEndpoint& server) {
  UdpSocket socket(io, UdpEndpoint(server.protocol(), 0));
  widen_buffers(socket);
  return socket;
}

bool is_loopback(const UdpEndpoint& endpoint) {
  const asio::ip::address address = endpoint.address();
  const bool mapped = address.is_v6() && address.to_v6().is_v4_mapped();
  return mapped ? asio::ip::make_address_v4(asio::ip::v4_mapped, address.to_v6()).is_loopback() : address.is_loopback();
}

std::string to_string(const UdpEndpoint& endpoint) {
  const std::string address = endpoint.address().to_string();
  return (endpoint.address().is_v6() ? '[' + address + ']' : address) + ':' + std::to_string(endpoint.port());
}

}  // namespace palpate
