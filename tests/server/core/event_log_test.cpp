// The lines of the server's log, and their limits.
#include "server/io/event_log.hpp"

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>
#include <vector>

using namespace palpate;
using namespace std::chrono_literals;

namespace {

constexpr Micros kNoon{1'780'000'000'123'000};  // 2026-05-28T20:26:40.123Z

struct WrittenLog {
  std::vector<std::string> lines;
  EventLog log{LogFormat::json, "program", [this](const std::string& line) { lines.push_back(line); }};
  std::size_t tell(const std::string& kind, int times, Micros now, const std::string& sort = "") {
    const std::size_t before = lines.size();
    for (int k = 0; k < times; ++k) log.tell({kind, "text", {}, EventLevel::info, sort}, kNoon, now);
    return lines.size() - before;
  }
};

}  // namespace

TEST_CASE("a line of JSON has time, level, event, text and the event's own figures") {
  const ServerEvent event{
      "joined", "station \"OR 3\" joined\n", {{"station", "OR 3"}, {"rtt_ms", 1.5}, {"id", 7.0}}, EventLevel::warning};
  const std::string line = json_line(event, kNoon, 0);
  CHECK(line.find('\n') == std::string::npos);
  const auto said = nlohmann::json::parse(line);
  CHECK(said.at("time") == "2026-05-28T20:26:40.123Z");
  CHECK(said.at("level") == "warning");
  CHECK(said.at("event") == "joined");
  CHECK(said.at("text") == event.text);
  CHECK(said.at("station") == "OR 3");
  CHECK(said.at("rtt_ms") == 1.5);
  CHECK(said.at("id").is_number_integer());
  CHECK_FALSE(said.contains("left_out"));
}

TEST_CASE("a name that is no UTF-8, and one that would begin a line of its own, leave the log readable") {
  const ServerEvent event{"joined", "station \xff\n12:00:00 program: nothing happened", {{"station", "\xff"}}};
  CHECK_NOTHROW(nlohmann::json::parse(json_line(event, kNoon, 0)));
  const std::string line = text_line(event, "program", kNoon, 0);
  CHECK(line.find('\n') == std::string::npos);
  CHECK(line.find(" program: station ??12:00:00") != std::string::npos);
}

TEST_CASE("a flood of one kind of event gets its burst and then a line a second, others beside it are not touched") {
  WrittenLog log;
  const Micros begin{5s};
  CHECK(log.tell("refused", 1'000, begin) == EventLimit::kBurst);
  CHECK(log.tell("refused", 1'000, begin + 999'999us) == 0);
  CHECK(log.tell("joined", 3, begin + 999'999us) == 3);
  CHECK(log.tell("refused", 1'000, begin + 1s) == 1);
  CHECK(nlohmann::json::parse(log.lines.back()).at("left_out") == 1'980);
  std::size_t in_a_day = 0;
  for (int second = 2; second < 86'400; ++second) in_a_day += log.tell("refused", 2, begin + std::chrono::seconds(second));
  CHECK(in_a_day == 86'398);
  CHECK(log.tell("refused", 1'000, begin + 100'000s) == EventLimit::kBurst);  // it has refilled, up to its size
}

TEST_CASE("sorts of one kind do not take each other's lines, and what the operator began is always said") {
  WrittenLog log;
  CHECK(log.tell("no_session", 1'000, 0s, "mac") == EventLimit::kBurst);
  CHECK(log.tell("no_session", 1, 0s, "key not known") == 1);
  const std::size_t before = log.lines.size();
  for (int k = 0; k < 100; ++k) log.log.say({"room", "text"}, kNoon);
  CHECK(log.lines.size() - before == 100);
}
