// A WebSocket to a service of this machine (Boost.Beast). One thread: the caller runs it.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "common/base/types.hpp"

namespace palpate {

class ServiceLink {
 public:
  static constexpr std::size_t kMessageBytesMost = 256 * 1024;
  static constexpr Micros kPatience{2'000'000};  ///< for the connection and the first message

  /// Connects to that port of 127.0.0.1, or of ::1 where nothing listens there. Throws InputError, also soon after `give_up` was
  /// set.
  ServiceLink(std::uint16_t port, const std::atomic<bool>& give_up);
  ~ServiceLink();

  /// Waits for a message. Throws InputError when none came within kPatience or the connection broke.
  std::string first_message();
  /// Passes each further message to `receive` and calls `turn` every `period`, until `turn` returns false or the connection
  /// broke. Missed turns are not made up for.
  void run(std::chrono::nanoseconds period, std::function<void(std::string_view)> receive, std::function<bool()> turn);
  bool writing() const;
  /// Sends the message. Not while writing().
  void send(std::string message);
  /// Sends a last message and closes the connection, within a tenth of a second.
  void end(std::string message);
  /// Fault that broke the connection, in a few words; empty: none.
  const std::string& fault() const;

 private:
  struct Inside;
  std::unique_ptr<Inside> inside_;
};

}  // namespace palpate
