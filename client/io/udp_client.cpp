#include "client/io/udp_client.hpp"

#include <algorithm>
#include <asio/post.hpp>
#include <cstdio>

#include "client/io/end_signals.hpp"
#include "common/base/error.hpp"
#include "common/io/monotonic.hpp"

namespace palpate {
namespace {

std::string joined_text(const ClientStatus& status) {
  std::array<char, 96> figures{};
  std::snprintf(figures.data(), figures.size(), "\" at %g Hz", status.welcome.rate_hz);
  return "joined scene \"" + status.welcome.scene + figures.data();
}

}  // namespace

UdpClient::UdpClient(const std::string& server, ClientCore& core, Say say, Watch watch, const std::optional<ClientKeys>& keys,
                     NameLookup::Ask ask)
    : core_(core),
      say_(std::move(say)),
      watch_(std::move(watch)),
      server_name_(server),
      server_(server_at(server)),
      socket_(open_udp_towards(io_, server_)),
      finder_(server, server_, ask ? std::move(ask) : server_at, monotonic_now()) {
  connect();
  if (keys) channel_.emplace(*keys, kWireVersion, system_random(), monotonic_now());
}

UdpClient::~UdpClient() { stop(); }

void UdpClient::start() {
  if (thread_.joinable()) return;
  receive();
  asio::post(io_, [this] { step(); });
  thread_ = std::thread([this] { run(); });
}

void UdpClient::run() {
  block_signals();
  const CrashStack stack;
  try {
    io_.run();
  } catch (const std::exception& error) {
    const std::lock_guard lock(mutex_);
    status_.fault = error.what();
  }
}

void UdpClient::stop() {
  if (!thread_.joinable()) return;
  asio::post(io_, [this] {
    const auto now = monotonic_now();
    core_.leave();
    send_all(now);
    io_.stop();
  });
  thread_.join();
}

ClientStatus UdpClient::status() const {
  const std::lock_guard lock(mutex_);
  return status_;
}

void UdpClient::connect() {
  asio::error_code unreachable;  // a lost network may come back
  socket_.connect(server_, unreachable);
  socket_.non_blocking(true);
}

void UdpClient::receive() {
  socket_.async_wait(UdpSocket::wait_read, [this, socket = sockets_](const asio::error_code& fault) {
    if (fault == asio::error::operation_aborted || socket != sockets_) return;
    UdpEndpoint from;
    asio::error_code none;
    while (true) {
      const auto size = socket_.receive_from(asio::buffer(in_), from, 0, none);
      if (none == asio::error::would_block || none == asio::error::try_again) break;
      if (none == asio::error::connection_refused) nobody_listens_ = true;
      if (none) continue;
      if (from != server_) continue;
      take(std::span(in_).first(size), monotonic_now());
    }
    step();
    if (socket == sockets_) receive();
  });
}

void UdpClient::move_to(const UdpEndpoint& server, Micros now) {
  nobody_listens_ &= server == server_;
  server_ = server;
  socket_ = open_udp_towards(io_, server_);
  connect();
  address_gone_ = false;
  opened_at_ = now;
  ++sockets_;
  receive();
}

void UdpClient::take(std::span<const std::byte> datagram, Micros now) {
  nobody_listens_ = false;
  if (channel_) {
    const auto size = channel_->take(octets(datagram), now, octets(std::span(opened_)));
    if (size == 0) return;
    datagram = std::span(opened_).first(size);
  }
  core_.take(datagram, now);
  if (watch_) watch_(core_, datagram, now);
}

void UdpClient::wake() {
  auto at = core_.deadline();
  if (channel_) at = std::min(at, channel_->deadline());
  if (core_.link() == LinkState::joined) at = std::min(at, monotonic_now() + kWake);
  timer_.expires_at(monotonic_at(at));
  timer_.async_wait([this](const asio::error_code& fault) {
    if (!fault) step();
  });
}

void UdpClient::step() {
  const auto now = monotonic_now();
  if (channel_) channel_->tick(now);
  core_.tick(now);
  send_all(now);
  if (const auto server = finder_.move(now, core_.last_answer(), core_.sent_away())) move_to(*server, now);
  if (address_gone_ && now - opened_at_ >= kReopenAfter) move_to(server_, now);
  note();
  wake();
}

void UdpClient::send_all(Micros now) {
  while (const auto size = channel_ ? channel_->emit(octets(std::span(sealed_)), now) : 0) send(std::span(sealed_).first(size));
  if (channel_ && !channel_->ready(now)) return;
  while (const auto size = core_.emit(out_, now)) {
    const auto datagram = std::span(out_).first(size);
    if (channel_)
      send(std::span(sealed_).first(channel_->seal(octets(datagram), octets(std::span(sealed_)), now)));
    else
      send(datagram);
  }
}

void UdpClient::send(std::span<const std::byte> datagram) {
  asio::error_code fault;
  // The first call may report the ICMP message to an earlier datagram in place of sending this one.
  for (int tries = 0; tries == 0 || (fault == asio::error::connection_refused && tries < 2); ++tries)
    socket_.send_to(asio::buffer(datagram.data(), datagram.size()), server_, 0, fault);
  if (!fault) return;
  ++send_failed_;
  nobody_listens_ = nobody_listens_ || fault == asio::error::connection_refused;
  address_gone_ = address_gone_ || fault == asio::error::network_unreachable || fault == asio::error::invalid_argument;
}

void UdpClient::note() {
  ClientStatus status{core_.link(),           core_.welcome(),
                      core_.refusal(),        core_.refuse_reason(),
                      core_.clock().locked(), core_.clock().rtt(),
                      core_.counts().joins,   core_.server_pace(),
                      core_.in_use(),         core_.guidance(monotonic_now()),
                      core_.tool_released(),  core_.patches_refused(),
                      nobody_listens_,        {}};
  LinkState before;
  bool changed;
  {
    const std::lock_guard lock(mutex_);
    before = status_.link;
    changed = before != status.link || status.refusal != status_.refusal || (status.joins != status_.joins);
    status_ = status;
  }
  if (say_ && (changed || !waiting_said_)) tell(before, status);
  waiting_said_ = true;
}

void UdpClient::tell(LinkState before, const ClientStatus& after) {
  if (after.link == LinkState::joined)
    say_(joined_text(after));
  else if (after.link == LinkState::refused)
    say_("refused: " + after.refusal);
  else if (before == LinkState::joined)
    say_("server silent, trying again");
  else
    say_("waiting for server at " + server_name_ + (channel_ ? ", which answers only a key that it knows" : ""));
}

}  // namespace palpate
