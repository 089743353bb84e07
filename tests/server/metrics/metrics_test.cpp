// Metrics of a state, and the conditions for a server to be well and ready.
#include "server/metrics/metrics.hpp"

#include <prometheus/text_serializer.h>

#include <catch2/catch.hpp>
#include <regex>
#include <set>
#include <sstream>

using namespace palpate;
using namespace std::chrono_literals;

namespace {

ServerState two_rooms() {
  ServerState state;
  state.at = 100s;
  for (const char* name : {"liver", "a \"quoted\\\" room\n"}) {
    RoomState room;
    room.name = name;
    room.rate_hz = 20;
    room.hands = 2;
    room.viewers = 1;
    room.counts.frame_seconds.add(0.02);
    room.counts.frame_seconds.add(0.02);
    room.counts.frame_seconds.add(5);
    room.counts.refused[static_cast<std::size_t>(RefuseReason::room_full)] = 3;
    room.recording = RecordingState::failed;
    state.rooms.push_back(room);
  }
  state.traffic.bytes_in = 7;
  state.channel.emplace();
  state.channel->faults[static_cast<std::size_t>(ChannelFault::unknown_key)] = 4;
  return state;
}

std::vector<std::string> lines_of(const ServerState& state) {
  std::istringstream text(prometheus::TextSerializer().Serialize(metrics_of(state, "0.1.0")));
  std::vector<std::string> lines;
  for (std::string line; std::getline(text, line);) lines.push_back(line);
  return lines;
}

bool has(const std::vector<std::string>& lines, const std::string& line) {
  return std::find(lines.begin(), lines.end(), line) != lines.end();
}

}  // namespace

TEST_CASE("names follow the conventions, each family is there once with its help and type") {
  std::set<std::string> names;
  for (const prometheus::MetricFamily& family : metrics_of(two_rooms(), "0.1.0")) {
    INFO(family.name);
    CHECK(names.insert(family.name).second);
    CHECK_FALSE(family.help.empty());
    CHECK(std::regex_match(family.name, std::regex("palpate_[a-z]+(_[a-z]+)*")));
    CHECK((family.type == prometheus::MetricType::Counter) == family.name.ends_with("_total"));
    if (family.type == prometheus::MetricType::Histogram)
      CHECK((family.name.ends_with("_seconds") || family.name.ends_with("_ratio")));
  }
}

TEST_CASE("every series is there once, and labels are of few values whatever stations are called") {
  std::set<std::string> series;
  for (const std::string& line : lines_of(two_rooms())) {
    if (line.starts_with('#')) continue;
    INFO(line);
    CHECK(series.insert(line.substr(0, line.rfind(' '))).second);
  }
  const std::set<std::string> allowed{"room", "role", "reason", "kind", "direction", "version"};
  for (const prometheus::MetricFamily& family : metrics_of(two_rooms(), "0.1.0"))
    for (const auto& metric : family.metric)
      for (const auto& label : metric.label) CHECK(allowed.contains(label.name));
}

TEST_CASE("counts of the state arrive under their room, reason and kind, and a histogram is cumulative") {
  const auto lines = lines_of(two_rooms());
  CHECK(has(lines, "palpate_stations{room=\"liver\",role=\"hand\"} 2"));
  CHECK(has(lines, "palpate_stations{room=\"a \\\"quoted\\\\\\\" room\\n\",role=\"viewer\"} 1"));
  CHECK(has(lines, "palpate_refusals_total{room=\"liver\",reason=\"room_full\"} 3"));
  CHECK(has(lines, "palpate_auth_failures_total{kind=\"unknown_key\"} 4"));
  CHECK(has(lines, "palpate_bytes_total{direction=\"in\"} 7"));
  CHECK(has(lines, "palpate_recording{room=\"liver\"} 0"));
  CHECK(has(lines, "palpate_recording_failed{room=\"liver\"} 1"));
  CHECK(has(lines, "palpate_frame_seconds_bucket{room=\"liver\",le=\"0.01\"} 0"));
  CHECK(has(lines, "palpate_frame_seconds_bucket{room=\"liver\",le=\"0.02\"} 2"));
  CHECK(has(lines, "palpate_frame_seconds_bucket{room=\"liver\",le=\"2\"} 2"));
  CHECK(has(lines, "palpate_frame_seconds_bucket{room=\"liver\",le=\"+Inf\"} 3"));
  CHECK(has(lines, "palpate_frame_seconds_count{room=\"liver\"} 3"));
}

TEST_CASE("a server without keys says nothing of authentication") {
  ServerState state = two_rooms();
  state.channel.reset();
  for (const std::string& line : lines_of(state)) CHECK(line.find("auth") == std::string::npos);
}

TEST_CASE("a server is well while its network loop turns and no frame takes for ever") {
  ServerState state = two_rooms();
  CHECK_FALSE(not_well(std::nullopt, 0s));
  CHECK_FALSE(not_well(state, state.at + kLoopMost));
  CHECK(not_well(state, state.at + kLoopMost + 1us));
  state.rooms[1].computing_for = kFrameMost;
  CHECK_FALSE(not_well(state, state.at));
  state.rooms[1].computing_for = kFrameMost + 1us;
  CHECK(not_well(state, state.at)->find("has computed one frame for 5000 ms") != std::string::npos);
}

TEST_CASE("a server is ready when it is loaded, lets newcomers in and is well") {
  ServerState state = two_rooms();
  CHECK(not_ready(std::nullopt, 0s) == "loading");
  CHECK_FALSE(not_ready(state, state.at));
  CHECK(not_ready(state, state.at + 3s));
  state.draining = true;
  CHECK(not_ready(state, state.at) == "draining");
  CHECK_FALSE(not_well(state, state.at));
}
