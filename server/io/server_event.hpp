// Events of a server: a line for a person, and the same as named fields for a program.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <variant>
#include <vector>

namespace palpate {

enum class EventLevel : std::uint8_t { info, warning, error };

struct EventField {
  std::string name;
  std::variant<std::string, double> value;
};

struct ServerEvent {
  std::string kind;  ///< one word of docs/reference/operation.md
  std::string text;
  std::vector<EventField> fields = {};
  EventLevel level = EventLevel::info;
  std::string sort = {};  ///< subdivides a kind, so that many events of one sort leave room for others in the log
};

using SayEvent = std::function<void(const ServerEvent&)>;

}  // namespace palpate
