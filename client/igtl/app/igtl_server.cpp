#include "client/igtl/app/igtl_server.hpp"

#include <netinet/tcp.h>
#include <sys/socket.h>

#include <array>
#include <asio/buffer.hpp>
#include <asio/write.hpp>
#include <cstdio>
#include <utility>

#include "common/base/error.hpp"
#include "common/io/endpoint.hpp"

namespace palpate {

namespace {

using asio::ip::tcp;

constexpr std::size_t kReadBytes = 65'536;
constexpr int kUnsentBytesMost = 65'536;  // in the operating system, per client

}  // namespace

class IgtlServer::Client : public std::enable_shared_from_this<Client> {
 public:
  Client(IgtlServer& server, tcp::socket socket) : server_(server), socket_(std::move(socket)) {
    asio::error_code ignored;
    socket_.set_option(tcp::no_delay(true), ignored);
    ::setsockopt(socket_.native_handle(), IPPROTO_TCP, TCP_NOTSENT_LOWAT, &kUnsentBytesMost, sizeof kUnsentBytesMost);
  }

  void read() {
    socket_.async_read_some(asio::buffer(in_), [self = shared_from_this()](asio::error_code fault, std::size_t bytes) {
      if (fault || !self->heard(bytes)) return self->leave();
      self->read();
    });
  }

  void send(std::shared_ptr<const std::string> batch) {
    waiting_ = std::move(batch);
    write();
  }

  void close() {
    asio::error_code ignored;
    socket_.close(ignored);
  }

 private:
  /// Returns false for bytes that are no OpenIGTLink.
  bool heard(std::size_t bytes) {
    if (!server_.received_) return true;
    try {
      reader_.add({in_.data(), bytes});
      while (const auto message = reader_.next()) server_.received_(*message);
      return true;
    } catch (const InputError& fault) {
      std::fprintf(stderr, "palpate-bridge: a client was disconnected: %s\n", fault.what());
      return false;
    }
  }

  void write() {
    if (writing_ || !waiting_) return;
    writing_ = std::exchange(waiting_, nullptr);
    asio::async_write(socket_, asio::buffer(*writing_), [self = shared_from_this()](asio::error_code fault, std::size_t) {
      self->writing_ = nullptr;
      if (fault) return self->leave();
      self->write();
    });
  }

  void leave() {
    close();
    server_.clients_.erase(shared_from_this());
  }

  IgtlServer& server_;
  tcp::socket socket_;
  std::array<char, kReadBytes> in_{};
  IgtlReader reader_;
  std::shared_ptr<const std::string> waiting_, writing_;
};

IgtlServer::IgtlServer(const std::string& listen, bool insecure, Received received) : received_(std::move(received)) {
  const UdpEndpoint place = resolve_udp("--listen", listen);
  if (!insecure && !place.address().is_loopback())
    throw InputError("--listen " + listen,
                     "can be reached from other machines, and OpenIGTLink neither encrypts nor asks who is there",
                     "an address of the loopback, or --insecure");
  const tcp::endpoint at(place.address(), place.port());
  asio::error_code fault;
  acceptor_.open(at.protocol());
  acceptor_.set_option(tcp::acceptor::reuse_address(true));
  acceptor_.bind(at, fault);
  if (!fault) acceptor_.listen(tcp::acceptor::max_listen_connections, fault);
  if (fault) throw InputError("--listen " + listen, fault.message(), "a free port of this machine");
  accept();
}

IgtlServer::~IgtlServer() {
  for (const auto& client : clients_) client->close();
  clients_.clear();
}

std::string IgtlServer::address() const {
  const tcp::endpoint at = acceptor_.local_endpoint();
  return to_string(UdpEndpoint(at.address(), at.port()));
}

void IgtlServer::accept() {
  acceptor_.async_accept([this](asio::error_code fault, tcp::socket socket) {
    if (fault == asio::error::operation_aborted) return;
    if (!fault && clients_.size() < kClientsMost)
      (*clients_.insert(std::make_shared<Client>(*this, std::move(socket))).first)->read();
    accept();
  });
}

void IgtlServer::run_for(Micros time) { io_.run_one_for(time); }

void IgtlServer::send(std::string batch) {
  const auto shared = std::make_shared<const std::string>(std::move(batch));
  for (const auto& client : clients_) client->send(shared);
}

}  // namespace palpate
