// One display on the network: a session with the server and the thread that drives it.
#pragma once

#include <memory>
#include <string>

#include "client/app/options.hpp"
#include "client/core/client_core.hpp"
#include "client/io/udp_client.hpp"

namespace palpate {

class ClientStation {
 public:
  /// `shadow_of`: empty for the felt display. Throws InputError when the server's name is not HOST:PORT or does not resolve.
  ClientStation(const AppOptions& options, SchemeAsked scheme, const std::string& shadow_of, UdpClient::Watch watch = {});

  void start() { udp_.start(); }
  /// Says goodbye and ends the thread; afterwards core() may be read.
  void stop() { udp_.stop(); }
  ClientStatus status() const { return udp_.status(); }

  const std::string& name() const { return name_; }
  SchemeAsked scheme() const { return scheme_; }
  ClientCore& core() { return core_; }

 private:
  std::string name_;
  SchemeAsked scheme_;
  ClientCore core_;
  UdpClient udp_;
};

}  // namespace palpate
