// Messages and time limits of an Inverse3, in virtual time: no socket, no thread.
#include "client/device/inverse3/inverse3_session.hpp"

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "common/base/error.hpp"

using namespace palpate;
using nlohmann::json;

namespace {

constexpr Micros kTurn{500}, kStart = Inverse3Session::kSettle + Micros{100'000};

std::string state_of(const std::string& id, const std::string& position, const std::string& status = R"({"calibrated":true})") {
  return R"({"inverse3":[{"device_id":")" + id + R"(","state":{"cursor_position":)" + position + R"(},"status":)" + status +
         "}]}";
}

std::string at(double x, double y, double z) { return json{{"x", x}, {"y", y}, {"z", z}}.dump(); }

/// A session, its loop and a service that answers a turn later.
struct Bench {
  DriverExchange exchange{Inverse3Session::kTurnHz};
  ExchangeCounter counter;
  Micros now{1'000'000};
  Inverse3Session session{"049D", Inverse3Format::v3_5, exchange, counter, now};
  std::vector<json> sent;

  /// The loop reads and writes, the session turns, `answer` (when not empty) comes.
  DeviceReading turn(const Vec3& force, const std::string& answer) {
    now += kTurn;
    if (!answer.empty()) session.receive(answer, now);
    const DeviceReading reading = exchange.read();
    exchange.write(force);
    session.turn(now);
    if (const auto command = session.command(now)) sent.push_back(json::parse(*command));
    return reading;
  }
  /// Turns for that long; returns the last reading.
  DeviceReading turns(Micros time, const Vec3& force, const std::string& answer) {
    DeviceReading last;
    for (Micros passed{}; passed < time; passed += kTurn) last = turn(force, answer);
    return last;
  }
  Vec3 newest_force() const {
    const json& v = sent.back()["inverse3"][0]["commands"]["set_cursor_force"]["vector"];
    return {v["x"].get<double>(), v["y"].get<double>(), v["z"].get<double>()};
  }
};

}  // namespace

TEST_CASE("The first message lists devices and tells the versions apart", "[inverse3]") {
  const auto listed = read_inverse3_inventory(
      R"({"session_id":7,"inverse3":[{"device_id":"049D","config":{"type":"minverse"}},{"device_id":"A14"},{"device_id":5},7,
          {"device_id":"a,b"}],"verse_grip":[]})");
  CHECK(listed.format == Inverse3Format::v3_5);
  REQUIRE(listed.devices.size() == 2);
  CHECK(listed.devices[0].id == "049D");
  CHECK(listed.devices[0].type == "minverse");
  CHECK(listed.devices[1].id == "A14");
  CHECK(listed.devices[1].type.empty());
  CHECK(read_inverse3_inventory("{}").devices.empty());
  CHECK(read_inverse3_inventory("{}").format == Inverse3Format::v3_1);
  for (const char* text : {"", "[]", "null", "{\"inverse3\":[", "\xff\xfe", "NaN"})
    CHECK_THROWS_WITH(read_inverse3_inventory(text), Catch::Contains("its first message is no JSON object; expected"));
}

TEST_CASE("A state is that of the device with the id, with what it lacks as not a number", "[inverse3]") {
  const std::string both = R"({"inverse3":[{"device_id":"A14","state":{"cursor_position":{"x":9,"y":9,"z":9}}},
                               {"device_id":"049D","state":{"cursor_position":{"x":0.01,"y":-0.02,"z":3e-2}}}]})";
  const Inverse3State state = read_inverse3_state(both, "049D");
  CHECK(state.kind == Inverse3State::Kind::listed);
  CHECK(state.position == Vec3(0.01, -0.02, 0.03));
  CHECK(state.calibrated);
  CHECK(read_inverse3_state(both, "049").kind == Inverse3State::Kind::unlisted);
  CHECK_FALSE(read_inverse3_state(state_of("a", at(0, 0, 0), R"({"calibrated":false})"), "a").calibrated);
  for (const char* position :
       {R"({"x":1,"y":2})", R"({"x":null,"y":0,"z":0})", R"({"x":"0","y":0,"z":0})", "[0,0,0]", "null", "3"}) {
    const Inverse3State lacking = read_inverse3_state(state_of("a", position), "a");
    CHECK(lacking.kind == Inverse3State::Kind::listed);
    CHECK_FALSE(lacking.position.allFinite());
  }
  for (const char* text :
       {"", "{", "[]", "{\"inverse3\":{}}", R"({"inverse3":[{"device_id":"a","state":{"cursor_position":{"x":1e999}}}]})"})
    CHECK(read_inverse3_state(text, "a").kind == Inverse3State::Kind::malformed);
  CHECK(read_inverse3_state(std::string(100'000, '['), "a").kind == Inverse3State::Kind::malformed);
}

TEST_CASE("Commands have the form of their version, and the first one of 3.5 configures the session", "[inverse3]") {
  const json first = json::parse(inverse3_command(Inverse3Format::v3_5, "049D", Vec3(1, -2, 0.25), true));
  CHECK(first["session"]["configure"]["profile"]["name"] == "palpate");
  CHECK(first["inverse3"][0]["configure"]["preset"] == "arm_front_centered");
  const json next = json::parse(inverse3_command(Inverse3Format::v3_5, "049D", Vec3(1, -2, 0.25), false));
  CHECK(next == json::parse(R"({"inverse3":[{"device_id":"049D","commands":
                                {"set_cursor_force":{"vector":{"x":1.0,"y":-2.0,"z":0.25}}}}]})"));
  for (const bool is_first : {true, false})
    CHECK(json::parse(inverse3_command(Inverse3Format::v3_1, "049D", Vec3::Zero(), is_first)) ==
          json::parse(
              R"({"inverse3":[{"device_id":"049D","commands":{"set_cursor_force":{"values":{"x":0.0,"y":0.0,"z":0.0}}}}]})"));
}

TEST_CASE("One command is on its way at a time, with the newest force, and answers are counted with their time", "[inverse3]") {
  Bench hand;
  const std::string here = state_of("049D", at(0.01, 0, 0));
  hand.turn(Vec3::Zero(), "");
  CHECK(hand.sent.size() == 1);
  hand.turns(Micros{5'000}, Vec3::Zero(), "");
  CHECK(hand.sent.size() == 1);
  hand.turn(Vec3::Zero(), here);
  CHECK(hand.sent.size() == 2);
  hand.turns(Micros{5'000}, Vec3(1, 2, 3), here);
  CHECK(hand.sent.size() == 12);
  CHECK(hand.counter.figures().answers == 11);
  CHECK(hand.counter.figures().most == Micros{5'500});
  CHECK(hand.counter.figures().total == Micros{5'500 + 10 * 500});
  const DeviceReading reading = hand.turns(kStart, Vec3(1, 2, 3), here);
  CHECK(reading.ok());
  CHECK(reading.position == Vec3(0.01, 0, 0));
  CHECK(hand.newest_force() == Vec3(1, 2, 3));
}

TEST_CASE("Positions before the first command has moved the origin are not used, and the move is no jump", "[inverse3]") {
  Bench hand;
  for (Micros passed{}; passed < kStart; passed += kTurn) {
    const bool moved = passed >= Micros{50'000};
    const DeviceReading reading = hand.turn(Vec3(1, 0, 0), state_of("049D", moved ? at(0, 0, 0) : at(0, -0.12, 0.15)));
    CHECK(reading.state != DeviceState::fault);
    if (reading.ok()) CHECK(reading.position == Vec3::Zero());
  }
  CHECK(hand.turn(Vec3(1, 0, 0), "").ok());
}

TEST_CASE("A service that stalls is gone after 20 ms and gets zero force, and a second of answers brings it back", "[inverse3]") {
  Bench hand;
  const std::string here = state_of("049D", at(0, 0, 0));
  REQUIRE(hand.turns(kStart, Vec3(1, 0, 0), here).ok());
  REQUIRE(hand.newest_force() == Vec3(1, 0, 0));
  const std::size_t before = hand.sent.size();
  CHECK(hand.turns(Inverse3Session::kAnswerMost - kTurn, Vec3(1, 0, 0), "").ok());
  CHECK(hand.sent.size() == before);
  const DeviceReading gone = hand.turns(3 * kTurn, Vec3(1, 0, 0), "");
  CHECK(gone.state == DeviceState::gone);
  CHECK(gone.reason.text() == "its service has not answered for 20 ms");
  CHECK(hand.sent.size() == before + 1);
  CHECK(hand.newest_force() == Vec3::Zero());
  CHECK_FALSE(hand.session.lost(hand.now));
  hand.turn(Vec3::Zero(), here);  // of the command before the stall: too late to count
  CHECK(hand.turns(Micros{900'000}, Vec3(1, 0, 0), here).state == DeviceState::fault);
  CHECK(hand.newest_force() == Vec3::Zero());
  CHECK(hand.turns(Micros{150'000}, Vec3(1, 0, 0), here).ok());
  CHECK(hand.newest_force() == Vec3(1, 0, 0));
}

TEST_CASE("A service that always answers after 30 ms never becomes ok", "[inverse3]") {
  Bench hand;
  const std::string here = state_of("049D", at(0, 0, 0));
  for (int n = 0; n < 50; ++n) {
    for (int turn = 0; turn < 59; ++turn) CHECK_FALSE(hand.turn(Vec3(1, 0, 0), "").ok());
    hand.turn(Vec3(1, 0, 0), here);
    CHECK(hand.newest_force() == Vec3::Zero());
  }
  CHECK(hand.turn(Vec3::Zero(), "").reason.text() == "its service takes more than 20 ms to answer");
  CHECK(hand.session.lost(hand.now));
}

TEST_CASE("Whatever else comes than a state of the device ends its force within 20 ms, with the reason", "[inverse3]") {
  const auto [answer, reason] = GENERATE(table<std::string, std::string>(
      {{state_of("A14", at(0, 0, 0)), "its service does not list it: is it plugged in and switched on?"},
       {R"({"inverse3":[]})", "its service does not list it: is it plugged in and switched on?"},
       {"{\"inverse3\":[{", "its service sends what is no state of devices"},
       {R"({"verse_grip":[]})", "its service sends what is no state of devices"},
       {state_of("049D", R"({"x":1e999,"y":0,"z":0})"), "its service sends what is no state of devices"}}));
  Bench hand;
  REQUIRE(hand.turns(kStart, Vec3(1, 0, 0), state_of("049D", at(0, 0, 0))).ok());
  const DeviceReading gone = hand.turns(Inverse3Session::kAnswerMost + 3 * kTurn, Vec3(1, 0, 0), answer);
  CHECK(gone.state == DeviceState::gone);
  CHECK(gone.reason.text() == reason);
  CHECK(hand.newest_force() == Vec3::Zero());
  CHECK(hand.turns(Micros{1'000'000}, Vec3(1, 0, 0), answer).state == DeviceState::gone);
  CHECK(hand.session.lost(hand.now));
}

TEST_CASE("A position that cannot be ends the force with the next turn, and never reaches the loop as ok", "[inverse3]") {
  const auto [position, reason] = GENERATE(
      table<std::string, std::string>({{R"({"x":null,"y":0,"z":0})", "its position is not a number"},
                                       {R"({"x":0,"y":1e300,"z":0})", "its service reports a position out of its reach"},
                                       {R"({"x":0,"y":0,"z":-1.5})", "its service reports a position out of its reach"},
                                       {R"({"x":0.05,"y":0,"z":0})", "its position jumped: no force until it is steady again"}}));
  Bench hand;
  REQUIRE(hand.turns(kStart, Vec3(1, 0, 0), state_of("049D", at(0, 0, 0))).ok());
  hand.turn(Vec3(1, 0, 0), state_of("049D", position));
  const DeviceReading fault = hand.turn(Vec3(1, 0, 0), state_of("049D", position));
  CHECK(fault.state == DeviceState::fault);
  CHECK(fault.reason.text() == reason);
  CHECK(hand.newest_force() == Vec3::Zero());
}

TEST_CASE("A device that is not calibrated is not ready, and says what to do", "[inverse3]") {
  Bench hand;
  const DeviceReading reading = hand.turns(kStart, Vec3(1, 0, 0), state_of("049D", at(0, 0, 0), R"({"calibrated":false})"));
  CHECK(reading.state == DeviceState::not_ready);
  CHECK(reading.reason.text() == "it is not calibrated: leave its handle in the inkwell until its light is steady");
  CHECK(hand.newest_force() == Vec3::Zero());
  CHECK(hand.turns(Micros{10'000}, Vec3(1, 0, 0), state_of("049D", at(0, 0, 0))).ok());
}

TEST_CASE("A loop that stops writing loses its force within 20 ms, and a force that is not finite counts as none", "[inverse3]") {
  Bench hand;
  const std::string here = state_of("049D", at(0, 0, 0));
  REQUIRE(hand.turns(kStart, Vec3(1, 0, 0), here).ok());
  for (Micros passed{}; passed <= DriverExchange::kStaleAfter; passed += kTurn) {
    hand.now += kTurn;
    hand.session.receive(here, hand.now);
    hand.session.turn(hand.now);
    if (const auto command = hand.session.command(hand.now)) hand.sent.push_back(json::parse(*command));
  }
  CHECK(hand.newest_force() == Vec3::Zero());
  hand.turns(Micros{2'000}, Vec3(1, 0, 0), here);
  CHECK(hand.newest_force() == Vec3(1, 0, 0));
  hand.turns(Micros{1'000}, Vec3(std::nan(""), 0, 0), here);
  CHECK(hand.newest_force() == Vec3::Zero());
}
