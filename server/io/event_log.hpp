// The server's log: one line per event, as text for a person or as JSON for a program.
//
//     14:03:22 palpate-server: station "OR 3" joined as hand from 10.0.0.7:40112
//     {"time":"2026-11-26T14:03:22.118Z","level":"info","event":"joined","text":"...","station":"OR 3",...}
//
// Each kind and sort of event is limited by event_limit.hpp, so strangers cannot fill the disk. Each line is written as a whole.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <utility>

#include "server/io/event_limit.hpp"
#include "server/io/server_event.hpp"

namespace palpate {

enum class LogFormat : std::uint8_t { text, json };

class EventLog {
 public:
  using Write = std::function<void(const std::string& line)>;  ///< the line includes its newline

  EventLog(LogFormat format, std::string program, Write write)
      : format_(format), program_(std::move(program)), write_(std::move(write)) {}

  /// Writes an event that the operator caused; never limited. `unix_time`: microseconds since 1970.
  void say(const ServerEvent& event, Micros unix_time) { put(event, unix_time, 0); }
  /// Writes an event that others can cause, within the limit of its kind.
  void tell(const ServerEvent& event, Micros unix_time, Micros now);

 private:
  void put(const ServerEvent& event, Micros unix_time, std::uint64_t left_out) const;

  LogFormat format_;
  std::string program_;
  Write write_;
  EventLimit limit_;
};

/// Formats one line of JSON without its newline; text that is not UTF-8 becomes U+FFFD.
std::string json_line(const ServerEvent& event, Micros unix_time, std::uint64_t left_out);
/// Formats one line of text without its newline, in local time; unprintable characters become question marks.
std::string text_line(const ServerEvent& event, const std::string& program, Micros unix_time, std::uint64_t left_out);

}  // namespace palpate
