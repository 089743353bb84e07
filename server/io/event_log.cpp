#include "server/io/event_log.hpp"

#include <spdlog/fmt/chrono.h>
#include <spdlog/fmt/fmt.h>

#include <array>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>
#include <variant>

#include "common/base/in_quotes.hpp"

namespace palpate {
namespace {

const char* name_of(EventLevel level) {
  constexpr std::array kNames{"info", "warning", "error"};
  return kNames[static_cast<std::size_t>(level)];
}

std::string utc_text(Micros unix_time) {
  const auto ms = std::chrono::floor<std::chrono::milliseconds>(unix_time);
  const auto s = std::chrono::floor<std::chrono::seconds>(unix_time);
  return fmt::format("{:%Y-%m-%dT%H:%M:%S}.{:03}Z", fmt::gmtime(static_cast<std::time_t>(s.count())), (ms - s).count());
}

nlohmann::ordered_json json_value(const std::string& text) { return text; }
nlohmann::ordered_json json_value(double number) {
  const double short_of = std::round(number * 1e3) / 1e3;  // prints 32.41 instead of 32.410000000000004
  const auto whole = static_cast<std::int64_t>(short_of);
  return static_cast<double>(whole) == short_of ? nlohmann::ordered_json(whole) : nlohmann::ordered_json(short_of);
}

}  // namespace

std::string json_line(const ServerEvent& event, Micros unix_time, std::uint64_t left_out) {
  nlohmann::ordered_json line{
      {"time", utc_text(unix_time)}, {"level", name_of(event.level)}, {"event", event.kind}, {"text", event.text}};
  for (const EventField& field : event.fields)
    std::visit([&](const auto& value) { line[field.name] = json_value(value); }, field.value);
  if (left_out > 0) line["left_out"] = left_out;
  return line.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

std::string text_line(const ServerEvent& event, const std::string& program, Micros unix_time, std::uint64_t left_out) {
  const auto s = std::chrono::floor<std::chrono::seconds>(unix_time);
  std::string line = fmt::format("{:%H:%M:%S} {}: {}", fmt::localtime(static_cast<std::time_t>(s.count())), program, event.text);
  if (left_out > 0) line += fmt::format(" ({} more like this one left out before it)", left_out);
  return made_plain(line);
}

void EventLog::tell(const ServerEvent& event, Micros unix_time, Micros now) {
  if (const auto left_out = limit_.take(event.kind + "/" + event.sort, now)) put(event, unix_time, *left_out);
}

void EventLog::put(const ServerEvent& event, Micros unix_time, std::uint64_t left_out) const {
  write_((format_ == LogFormat::json ? json_line(event, unix_time, left_out) : text_line(event, program_, unix_time, left_out)) +
         "\n");
}

}  // namespace palpate
