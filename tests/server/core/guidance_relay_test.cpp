#include "raw_station.hpp"

using namespace palpate;
using namespace std::chrono_literals;

namespace {

struct GuidedRoom : Bench {
  std::vector<GuidanceNews> news;
  GuidedRoom() {
    core.on_guidance([this](const GuidanceNews& n) { news.push_back(n); });
  }
  int count(PeerId peer) const {
    return static_cast<int>(std::ranges::count_if(
        sent, [peer](const auto& entry) { return entry.first == peer && std::holds_alternative<Guidance>(entry.second.body); }));
  }
  Guidance newest(PeerId peer) {
    const auto message = last<Guidance>(peer);
    REQUIRE(message);
    return std::get<Guidance>(message->body);
  }
};

void live(GuidedRoom& room, std::initializer_list<RawStation*> stations, Micros time) {
  for (const Micros end = room.now + time; room.now < end;) {
    room.now += 1ms;
    for (RawStation* station : stations) station->say_samples({station->sample()});
    room.tick();
  }
}

GuidanceReport report(GuidanceHand hand, double force_n = 0) { return {hand, 30ms, force_n}; }

}  // namespace

TEST_CASE("each of a pair gets the other's newest sample in its own clock, at most every 7 ms") {
  GuidedRoom room;
  RawStation guide(room, 1, "OR 3"), trainee(room, 2, "OR 1");
  guide.clock_offset = 77s;
  trainee.clock_offset = -5s;
  guide.hello.guides = "OR 1";
  trainee.join();
  guide.join();
  trainee.say(Beat{.guidance = report(GuidanceHand::ready)});
  live(room, {&guide, &trainee}, 200ms);
  room.sent.clear();
  live(room, {&guide, &trainee}, 700ms);
  CHECK(room.count(1) == 100);
  CHECK(room.count(2) == 100);
  const auto sent = room.sent;
  const Guidance to_guide = room.newest(1);
  room.sent = sent;
  const Guidance to_trainee = room.newest(2);
  CHECK(to_guide.partner == "OR 1");
  CHECK(to_guide.guides);
  CHECK(to_guide.hand == GuidanceHand::ready);
  CHECK(to_guide.reach == 30ms);
  CHECK(std::chrono::abs(guide.clock() - to_guide.stamp) <= 8ms);
  CHECK(to_trainee.partner == "OR 3");
  CHECK_FALSE(to_trainee.guides);
  CHECK(std::chrono::abs(trainee.clock() - to_trainee.stamp) <= 8ms);
  CHECK(to_guide.position.z() == Approx(0.01 * seconds(to_guide.stamp - guide.clock_offset + trainee.clock_offset)).margin(1e-6));
}

TEST_CASE("where nobody guides, nobody gets a message about it") {
  GuidedRoom room;
  RawStation one(room, 1, "one"), two(room, 2, "two");
  one.join();
  two.join();
  live(room, {&one, &two}, 500ms);
  CHECK(room.count(1) == 0);
  CHECK(room.count(2) == 0);
  CHECK(room.news.empty());
}

TEST_CASE("a guide hears four times a second why it has no partner") {
  GuidedRoom room;
  RawStation guide(room, 1, "OR 3"), trainee(room, 2, "OR 1"), second(room, 3, "OR 4");
  guide.hello.guides = second.hello.guides = "OR 1";
  guide.join();
  live(room, {&guide}, 1s);
  CHECK(room.count(1) >= 4);
  CHECK(room.count(1) <= 6);
  CHECK(room.newest(1).hand == GuidanceHand::absent);
  trainee.join();
  trainee.say(Beat{.guidance = report(GuidanceHand::refuses)});
  live(room, {&guide, &trainee}, 300ms);
  const auto sent = room.sent;
  CHECK(room.newest(1).hand == GuidanceHand::refuses);
  room.sent = sent;
  CHECK(room.count(2) < 30);  // what came before it objected
  room.sent.clear();
  live(room, {&guide, &trainee}, 300ms);
  CHECK(room.count(2) == 0);
  trainee.say(Beat{.guidance = report(GuidanceHand::ready)});
  second.join();
  live(room, {&guide, &trainee, &second}, 300ms);
  const auto all = room.sent;
  CHECK(room.newest(1).hand == GuidanceHand::ready);
  room.sent = all;
  CHECK(room.newest(3).hand == GuidanceHand::busy);
  guide.say(Leave{});
  live(room, {&trainee, &second}, 300ms);
  CHECK(room.newest(3).hand == GuidanceHand::ready);
}

TEST_CASE("a station that guides is guided by nobody, and none guides itself or without a tool") {
  GuidedRoom room;
  RawStation first(room, 1, "first"), second(room, 2, "second"), self(room, 3, "self"), eye(room, 4, "eye");
  first.hello.guides = "second";
  second.hello.guides = "first";
  first.join();
  second.join();
  live(room, {&first, &second}, 300ms);
  CHECK(room.newest(1).hand == GuidanceHand::busy);
  self.hello.guides = "self";
  CHECK(reason(self.ask()) == RefuseReason::bad_request);
  eye.hello.guides = "first";
  eye.hello.role = Role::viewer;
  CHECK(reason(eye.ask()) == RefuseReason::bad_request);
}

TEST_CASE("a hold is there while both report it: viewers see it, listeners hear its begin, end and forces") {
  GuidedRoom room;
  RawStation guide(room, 1, "OR 3"), trainee(room, 2, "OR 1"), eye(room, 3, "eye");
  guide.hello.guides = "OR 1";
  eye.hello.role = Role::viewer;
  guide.join();
  trainee.join();
  eye.join();
  live(room, {&guide, &trainee}, 100ms);
  guide.say(Beat{.guidance = report(GuidanceHand::holds, 0.5)});
  CHECK(room.news.empty());
  trainee.say(Beat{.guidance = report(GuidanceHand::holds, 1)});
  REQUIRE(room.news.size() == 1);
  CHECK(room.news[0].begins);
  CHECK(room.news[0].guide == "OR 3");
  CHECK(room.news[0].guided == "OR 1");
  CHECK(room.core.stations()[0].guided == room.core.stations()[1].id);
  live(room, {&guide, &trainee}, 1s);
  eye.say(Beat{});
  const auto tools = std::get<Tools>(room.last<Tools>(3)->body).tools;
  REQUIRE(tools.size() == 2);
  CHECK(tools[0].guides == "OR 1");
  CHECK(tools[1].guides.empty());
  trainee.say(Beat{.guidance = report(GuidanceHand::holds, 2)});
  const bool leaves = GENERATE(false, true);
  leaves ? guide.say(Leave{}) : trainee.say(Beat{.guidance = report(GuidanceHand::released)});
  live(room, {&trainee}, 20ms);
  REQUIRE(room.news.size() == 2);
  CHECK_FALSE(room.news[1].begins);
  CHECK(room.news[1].lasted >= 1s);
  CHECK(room.news[1].lasted < 1100ms);
  CHECK(room.news[1].guide_force_n == Approx(0.5));
  CHECK(room.news[1].guided_force_n == Approx(1.5));
}
