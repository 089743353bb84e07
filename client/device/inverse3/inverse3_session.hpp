// One Inverse3 through a connection to its service, without the connection: messages and the time are arguments.
//
// The service answers each command with one state, so the commands' rate is the rate of readings. A turn, kTurnHz times a second,
// exchanges the newest reading for the newest force (driver_exchange.hpp), and sends that as soon as the last command is
// answered. An answer counts within kAnswerMost of its command; without one for that long the device is gone, until a second
// after the answers are in time again. Then a command of zero force is sent without waiting: the service meets it first when it
// continues.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>

#include "client/device/driver_exchange.hpp"
#include "client/device/exchange_counter.hpp"
#include "client/device/inverse3/inverse3_messages.hpp"
#include "client/device/reading_gate.hpp"

namespace palpate {

class Inverse3Session {
 public:
  static constexpr double kTurnHz = 2000;
  static constexpr Micros kAnswerMost{20'000};
  static constexpr Micros kSilenceMost{1'000'000};  ///< without a valid answer for this long the connection is of no use
  static constexpr Micros kSettle{200'000};    ///< after the first command, which moves the origin: positions do not count yet
  static constexpr double kVelocityMaxMS = 5;  ///< faster than people move a handle
  static constexpr double kFarthestM = 1;      ///< a coordinate beyond this is no position of an Inverse3 [m]

  Inverse3Session(std::string id, Inverse3Format format, DriverExchange& exchange, ExchangeCounter& counter, Micros now);

  void receive(std::string_view message, Micros now);
  /// Exchanges reading and force.
  void turn(Micros now);
  /// Returns the command that is to be sent after turn(), if any.
  std::optional<std::string> command(Micros now);
  /// Returns a command of zero force, for the end.
  std::string last_command() const;
  bool lost(Micros now) const { return now - fresh_at_ > kSilenceMost; }

 private:
  DeviceReading measure(Micros now) noexcept;
  bool silent(Micros now) const { return now - fresh_at_ > kAnswerMost; }

  std::string id_;
  Inverse3Format format_;
  DriverExchange& exchange_;
  ExchangeCounter& counter_;
  ReadingGate gate_;
  Vec3 force_ = Vec3::Zero();
  Inverse3State newest_;
  Micros settled_at_ = Micros::max();
  Micros fresh_at_;  ///< arrival of the newest answer that counts
  const char* fault_;
  std::array<Micros, 2> sent_{};  ///< when the commands without an answer were sent, oldest first
  std::size_t unanswered_ = 0;
  bool first_ = true;
};

}  // namespace palpate
