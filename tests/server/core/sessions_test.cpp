// Sessions of a room without frames: answers of Sessions alone to strangers and stations.
#include "server/core/sessions.hpp"

#include <catch2/catch.hpp>

#include "fake_room.hpp"

using namespace palpate;
using namespace std::chrono_literals;

namespace {

struct Door {
  Sessions sessions{test_facts(), ServerOptions{.draw = repeatable(42)}};
  Micros now{1s};
  std::vector<std::byte> answer;  ///< the last one, empty if there was none
  PeerId answered = 0;

  Station* say(PeerId from, const Message& message, std::size_t size = kHelloBytes) {
    Station* const station = sessions.take(WireFault::none, message, size, from, now);
    std::array<std::byte, kMaxDatagramBytes> bytes;
    answer.clear();
    while (const auto length = sessions.emit(bytes, answered, now)) answer.assign(bytes.begin(), bytes.begin() + length);
    return station;
  }
  Message heard() const {
    Message message;
    REQUIRE(decode(answer, message) == WireFault::none);
    return message;
  }
  static Message hello(const std::string& name) {
    Message message;
    message.body = Hello{name, Role::haptic, Scheme::port, 0, ""};
    return message;
  }
};

}  // namespace

TEST_CASE("Sessions answer a Hello to whom it came from, and hand on what the station says then") {
  Door door;
  CHECK_FALSE(door.say(7, Door::hello("hand")));
  CHECK(door.answered == 7);
  const Message welcome = door.heard();
  REQUIRE(std::holds_alternative<Welcome>(welcome.body));
  Station* const station = door.say(7, {welcome.instance, welcome.station, 1, {}, Beat{}});
  REQUIRE(station);
  CHECK(station->hello.station == "hand");
  CHECK(door.answer.empty());
  CHECK_FALSE(door.say(8, {welcome.instance, welcome.station, 1, {}, Beat{}}));
  CHECK_FALSE(door.say(7, {welcome.instance, welcome.station + 1, 1, {}, Beat{}}));
  CHECK(door.sessions.counts().unknown_station == 2);
}

TEST_CASE("Sessions say when the first of their stations will have been silent for too long, and drop it then") {
  Door door;
  CHECK(door.sessions.deadline() == Micros::max());
  for (const char* name : {"first", "second"}) {
    door.say(1, Door::hello(name));
    const Message welcome = door.heard();
    REQUIRE(door.say(1, {welcome.instance, welcome.station, 1, {}, Beat{}}));
    door.now += 500ms;
  }
  CHECK(door.sessions.deadline() == 1s + kGoneAfter);
  door.sessions.drop_silent(1s + kGoneAfter - 1us);
  CHECK(door.sessions.stations().size() == 2);
  door.sessions.drop_silent(1s + kGoneAfter);
  CHECK(door.sessions.stations().size() == 1);
  CHECK(door.sessions.stations().named("second"));
  CHECK(door.sessions.counts().timeouts == 1);
}

TEST_CASE("An answer that does not fit into the bytes of its question is withheld") {
  Door door;
  door.say(1, Door::hello("hand"), 100);
  CHECK(door.answer.empty());
  CHECK(door.sessions.counts().answers_withheld == 1);
  door.say(1, Door::hello("hand"));
  CHECK(std::holds_alternative<Welcome>(door.heard().body));
}
