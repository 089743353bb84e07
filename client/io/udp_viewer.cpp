#include "client/io/udp_viewer.hpp"

#include <poll.h>

#include <algorithm>
#include <array>
#include <asio/buffer.hpp>
#include <utility>

#include "common/base/limits.hpp"
#include "common/io/monotonic.hpp"

namespace palpate {

UdpViewer::UdpViewer(const std::string& server, const std::string& station, const std::string& room, bool alike,
                     const std::optional<ClientKeys>& keys, NameLookup::Ask ask)
    : server_(server),
      core_(station, monotonic_now(), room, alike),
      address_(server_at(server)),
      finder_(server, address_, ask ? std::move(ask) : server_at, monotonic_now()) {
  if (keys) channel_.emplace(*keys, kWireVersion, system_random(), monotonic_now());
  connect();
}

void UdpViewer::connect() {
  socket_ = open_udp_towards(io_, address_);
  asio::error_code unreachable;  // a lost network may come back: the next move tries again
  socket_.connect(address_, unreachable);
  socket_.non_blocking(true);
}

UdpViewer::~UdpViewer() {
  core_.leave();
  pump();
}

void UdpViewer::pump() {
  std::array<std::byte, 2 * kMaxDatagramBytes> datagram;
  asio::error_code error;
  // A refused datagram (nobody listens yet) appears as an error of the next call; the one after it may succeed.
  for (int errors = 0; errors < 8;) {
    const std::size_t size = socket_.receive(asio::buffer(datagram), 0, error);
    if (error == asio::error::would_block || error == asio::error::try_again) break;
    if (!error || error == asio::error::connection_refused) nobody_listens_ = static_cast<bool>(error);
    if (error)
      ++errors;
    else
      take(std::span(datagram).first(size));
  }
  if (channel_) channel_->tick(monotonic_now());
  core_.tick(monotonic_now());
  if (const auto server = finder_.move(monotonic_now(), core_.last_answer(), core_.sent_away())) {
    address_ = *server;
    connect();
  }
  send_all();
}

void UdpViewer::take(std::span<const std::byte> datagram) {
  std::array<std::byte, kMaxDatagramBytes> opened;
  if (channel_) {
    const std::size_t size = channel_->take(octets(datagram), monotonic_now(), octets(std::span(opened)));
    if (size == 0) return;
    datagram = std::span(opened).first(size);
  }
  core_.take(datagram, monotonic_now());
}

void UdpViewer::send_all() {
  std::array<std::byte, kMaxDatagramBytes> plain;
  std::array<std::byte, kMaxSealedBytes> sealed;
  asio::error_code ignored;
  const Micros now = monotonic_now();
  while (const std::size_t size = channel_ ? channel_->emit(octets(std::span(sealed)), now) : 0)
    socket_.send(asio::buffer(sealed.data(), size), 0, ignored);
  if (channel_ && !channel_->ready(now)) return;
  while (const std::size_t size = core_.emit(plain, now)) {
    if (channel_) {
      const auto whole = channel_->seal(octets(std::span(plain).first(size)), octets(std::span(sealed)), now);
      socket_.send(asio::buffer(sealed.data(), whole), 0, ignored);
    } else {
      socket_.send(asio::buffer(plain.data(), size), 0, ignored);
    }
  }
}

bool UdpViewer::unanswered() const {
  return core_.link() == LinkState::joining && monotonic_now() - core_.last_answer() > kNoAnswerAfter;
}

Micros UdpViewer::deadline() const { return channel_ ? std::min(core_.deadline(), channel_->deadline()) : core_.deadline(); }

void UdpViewer::nap(Micros time) {
  const Micros wait = std::clamp(std::min(time, deadline()) - monotonic_now(), Micros{0}, kNapMost);
  pollfd readable{socket_.native_handle(), POLLIN, 0};
  ::poll(&readable, 1, static_cast<int>((wait.count() + 999) / 1000));
}

}  // namespace palpate
