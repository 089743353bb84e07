#include "server/trust/rights_gate.hpp"

#include <catch2/catch.hpp>

#include "tests/common/trust/channel_pair.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

struct Gated {
  RightsGate gate;
  PublicKey key = public_of(secret_of(kStationSeed));
  Rights rights = rights_of("OR 3");
  Micros now{1'000'000};
  bool anew = false;  ///< result of the last Hello

  std::optional<Refuse> ask(Hello& hello, ChannelPeer from = 1) {
    Message message;
    message.body = hello;
    Ruling ruling = gate.cap(message, from, key, rights, now);
    hello = std::get<Hello>(message.body);
    anew = ruling.anew;
    return ruling.refused;
  }
  std::optional<Refuse> say(Payload body, ChannelPeer from = 1) {
    Message message;
    message.body = std::move(body);
    return gate.cap(message, from, key, rights, now).refused;
  }
};

Hello hand(const std::string& name, const std::string& room = "") {
  Hello hello;
  hello.station = name;
  hello.room = room;
  return hello;
}

}  // namespace

TEST_CASE("a key for hands may not look on, one for viewers may not touch") {
  Gated gated;
  Hello touching = hand("OR 3"), looking = touching;
  looking.role = Role::viewer;
  gated.rights.viewer = false;
  CHECK_FALSE(gated.ask(touching));
  CHECK(gated.ask(looking)->reason == RefuseReason::bad_request);
  gated.rights.viewer = true;
  gated.rights.hand = false;
  CHECK(gated.ask(touching)->reason == RefuseReason::bad_request);
  CHECK_FALSE(gated.ask(looking));
}

TEST_CASE("a station has the key's name where it left that open, and is refused under another's") {
  Gated gated;
  Hello open = hand("hand");
  open.alike = true;
  CHECK_FALSE(gated.ask(open));
  CHECK(open.station == "OR 3");
  Hello numbered = hand("OR 3-2");
  CHECK_FALSE(gated.ask(numbered, 2));
  CHECK(numbered.station == "OR 3-2");
  Hello other = hand("OR 4");
  CHECK(gated.ask(other)->message == "this key's stations are \"OR 3\", or with - or / and more behind it");
}

TEST_CASE("a key for one room joins that one where it names none, and no other") {
  Gated gated;
  gated.rights.rooms = {"liver", "lung"};
  Hello open = hand("OR 3"), second = hand("OR 3", "lung"), other = hand("OR 3", "heart");
  CHECK_FALSE(gated.ask(open));
  CHECK(open.room == "liver");
  CHECK_FALSE(gated.ask(second));
  CHECK(gated.ask(other)->message == "this key is for room \"liver\", \"lung\"");
  gated.rights.rooms.clear();
  CHECK_FALSE(gated.ask(other));
}

TEST_CASE("a shadow shares a tool of its own key only") {
  Gated gated;
  Hello own = hand("OR 3/port"), other = own;
  own.shadow_of = "OR 3";
  other.shadow_of = "OR 4";
  CHECK_FALSE(gated.ask(own));
  CHECK(gated.ask(other)->reason == RefuseReason::bad_request);
}

TEST_CASE("only a key that may guide guides, and a station that is to guide another one is another station") {
  Gated gated;
  Hello guide = hand("OR 3");
  guide.guides = "OR 1";
  const auto no = gated.ask(guide);
  REQUIRE(no);
  CHECK(no->reason == RefuseReason::bad_request);
  CHECK(no->message == "this key may not guide others");
  gated.rights.guide = true;
  CHECK_FALSE(gated.ask(guide));
  guide.guides = "OR 2";
  CHECK_FALSE(gated.ask(guide));
  CHECK(gated.anew);
}

TEST_CASE("only a key that may write notes writes them, and a viewer hears of the rooms of its key alone") {
  Gated gated;
  gated.rights.viewer = true;
  gated.rights.rooms = {"liver", "lung"};
  Hello viewer = hand("OR 3", "lung");
  viewer.role = Role::viewer;
  REQUIRE_FALSE(gated.ask(viewer));
  CHECK(viewer.may_join == gated.rights.rooms);
  const Note note{1, Micros{5}, "", "too deep"};
  const auto no = gated.say(note);
  REQUIRE(no);
  CHECK(no->reason == RefuseReason::bad_request);
  CHECK(no->message == "this key may not write notes (role note)");
  gated.rights.note = true;
  CHECK_FALSE(gated.say(note));
}

TEST_CASE("a key has as many streams as it may, and one more when one of them leaves or falls silent") {
  Gated gated;
  gated.rights.streams = 2;
  const auto ask = [&](int k) {
    Hello hello = hand("OR 3-" + std::to_string(k));
    return gated.ask(hello, static_cast<ChannelPeer>(k));
  };
  CHECK_FALSE(ask(1));
  CHECK_FALSE(ask(2));
  CHECK_FALSE(ask(1));  // again
  CHECK(ask(3)->reason == RefuseReason::room_full);
  gated.say(Leave{}, 2);
  CHECK_FALSE(ask(3));
  CHECK(ask(4)->reason == RefuseReason::room_full);
  gated.now += Micros{2'000'000};
  gated.say(Beat{}, 3);
  gated.now += Micros{1'500'000};
  CHECK_FALSE(ask(4));  // the first is silent, the third is not
  CHECK(ask(5)->reason == RefuseReason::room_full);
}

TEST_CASE("a newer session of the key under the same name in the same room is no stream more, an older one or another is") {
  Gated gated;
  gated.rights.streams = 1;
  Hello hello = hand("OR 3", "liver"), elsewhere = hand("OR 3", "lung"), alike = hello;
  alike.alike = true;
  CHECK_FALSE(gated.ask(hello, 5));
  CHECK(gated.ask(hello, 4)->reason == RefuseReason::room_full);
  CHECK(gated.ask(elsewhere, 6)->reason == RefuseReason::room_full);
  CHECK(gated.ask(alike, 6)->reason == RefuseReason::room_full);
  CHECK_FALSE(gated.ask(hello, 6));
}

TEST_CASE("a session is one station: asked for another one, the first goes") {
  Gated gated;
  Hello first = hand("OR 3"), second = hand("OR 3-2"), looking = first;
  looking.role = Role::viewer;
  CHECK_FALSE(gated.ask(first));
  CHECK_FALSE(gated.anew);
  CHECK_FALSE(gated.ask(first));
  CHECK_FALSE(gated.anew);
  CHECK_FALSE(gated.ask(second));
  CHECK(gated.anew);
  CHECK_FALSE(gated.ask(looking));
  CHECK(gated.anew);
  gated.say(Leave{});
  CHECK_FALSE(gated.ask(first));
  CHECK_FALSE(gated.anew);
}

TEST_CASE("two keys with one name are not in at the same time") {
  Gated gated;
  Hello hello = hand("OR 3"), second = hand("OR 3-2");
  CHECK_FALSE(gated.ask(hello, 1));
  gated.key = public_of(secret_of(kStrangerSeed));
  gated.rights = rights_of("OR 3-2");
  CHECK(gated.ask(second, 2)->reason == RefuseReason::name_taken);
  gated.gate.forget(1);
  CHECK_FALSE(gated.ask(second, 2));
}

TEST_CASE("two keys with one name are in at the same time where no room is both's") {
  Gated gated;
  Hello hello = hand("OR 3", "liver"), other = hand("OR 3", "spleen"), both = hand("OR 3", "spleen");
  gated.rights.rooms = {"liver"};
  CHECK_FALSE(gated.ask(hello, 1));
  gated.key = public_of(secret_of(kStrangerSeed));
  gated.rights.rooms = {"liver", "spleen"};
  CHECK(gated.ask(both, 2)->reason == RefuseReason::name_taken);
  gated.rights.rooms = {"spleen"};
  CHECK_FALSE(gated.ask(other, 2));
}

TEST_CASE("a key that may only look on may not have the body put back to rest") {
  Gated gated;
  const auto refused = [&](bool touches) {
    gated.rights.hand = touches;
    Message message;
    message.body = Reset{};
    return gated.gate.cap(message, 1, gated.key, gated.rights, gated.now).refused;
  };
  CHECK_FALSE(refused(true));
  REQUIRE(refused(false));
  CHECK(refused(false)->reason == RefuseReason::bad_request);
  CHECK_THAT(refused(false)->message, Catch::Contains("may not touch"));
}

TEST_CASE("a viewer gets no more shapes than its key may, whatever it asks for") {
  Gated gated;
  const auto granted = [&](int rights, int asked) {
    gated.rights.kbit_s = rights;
    Message message;
    message.body = ViewState{.newest = 0, .have = 0, .channels = 0, .kbit_s = static_cast<std::uint16_t>(asked)};
    gated.gate.cap(message, 1, gated.key, gated.rights, gated.now);
    return std::get<ViewState>(message.body).kbit_s;
  };
  CHECK(granted(500, 60'000) == 500);
  CHECK(granted(500, 0) == 500);
  CHECK(granted(2000, 0) == 900);
  CHECK(granted(2000, 100) == 100);
}
