// Stand-in for Haply's Inverse Service: a WebSocket on a port of the loopback over simulated Phantoms, with the messages and
// rules of the documentation (client/device/inverse3/inverse3_messages.hpp), that can misbehave. In version 3.5 the origin is at
// the base until the answer after the one to the command with the preset. It contains no vendor's code, and none was run next to
// it. Arms are controlled through Standin and the environment (standin.hpp): `silent` stalls the service, `lost` unlists the arm.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "client/device/inverse3/inverse3_messages.hpp"
#include "tests/client/device/standin/standin.hpp"

namespace palpate::test {

enum class ServiceFault : std::uint8_t {
  none,
  refuses,    ///< answers HTTP 403 instead of a WebSocket
  deaf,       ///< accepts a connection and never answers
  mute,       ///< opens the WebSocket and sends nothing by itself
  not_json,   ///< sends a text that is cut off
  no_list,    ///< sends JSON without devices
  text,       ///< a coordinate is a text
  far_away,   ///< a coordinate is 1e300
  too_large,  ///< a coordinate is 1e999, which no double holds
  other,      ///< sends the state of another device only
  huge,       ///< sends messages of 1 MB
  slow,       ///< answers after 40 ms
  closes      ///< closes the connection at the next command
};

class Inverse3Service {
 public:
  explicit Inverse3Service(std::vector<std::string> ids, Inverse3Format format = Inverse3Format::v3_5, std::uint16_t port = 0);
  ~Inverse3Service();
  std::uint16_t port() const { return port_; }
  void misbehave(ServiceFault fault) { fault_ = fault; }
  /// Type of all devices, "inverse3" by default.
  void set_type(std::string type);
  Standin& arm(std::size_t k);
  /// Newest commanded force of an arm [N]; zero when its connection has closed.
  Vec3 force(std::size_t k) const;
  /// Commands received.
  std::uint64_t commands() const { return commands_; }
  /// Violations of the service's rules by its user.
  std::vector<std::string> breaches() const;

 private:
  class ServiceArm;
  struct Inside;
  void accept();
  void serve(std::size_t connection);
  std::string state(bool with_config, bool centred) const;
  void obey(std::string_view command, bool first);
  void breach(const std::string& what);

  std::vector<std::unique_ptr<ServiceArm>> arms_;
  Inverse3Format format_;
  std::uint16_t port_ = 0;
  std::string type_ = "inverse3";
  std::atomic<ServiceFault> fault_{ServiceFault::none};
  std::atomic<std::uint64_t> commands_{0};
  std::atomic<bool> ends_{false};
  mutable std::mutex mutex_;
  std::vector<std::string> breaches_;
  std::unique_ptr<Inside> inside_;
};

}  // namespace palpate::test
