// Notes of viewers for the recording.
#include <cmath>

#include "raw_station.hpp"

using namespace palpate;
using namespace std::chrono_literals;

namespace {

struct Desk {
  Bench bench;
  RawStation viewer{bench, 2, "page"};
  std::vector<RecordedNote> notes;
  bool recording = true;

  Desk() {
    viewer.hello.role = Role::viewer;
    viewer.join();
    bench.core.on_note([this](const RecordedNote& note) {
      if (recording) notes.push_back(note);
      return recording;
    });
    bench.wait(300ms);
  }
  std::uint32_t recorded() {
    bench.wait(100ms);
    const auto beat = bench.last<Beat>(2);
    REQUIRE(beat);
    return std::get<Beat>(beat->body).notes;
  }
};

}  // namespace

TEST_CASE("a note that is repeated is recorded once, with its moment and its author, and the beat says so") {
  Desk desk;
  const Micros moment = desk.bench.now - 2s;
  for (int k = 0; k < 3; ++k) desk.viewer.say(Note{1, moment, "Weber", "too deep"});
  CHECK(desk.recorded() == 1);
  REQUIRE(desk.notes.size() == 1);
  CHECK(desk.notes[0].about == moment);
  CHECK(desk.notes[0].t > moment);
  CHECK(desk.notes[0].author == "Weber");
  CHECK(desk.notes[0].text == "too deep");
  CHECK(desk.notes[0].station == desk.viewer.as.station);
  desk.viewer.say(Note{1, moment, "Weber", "too deep"});  // a late copy
  desk.viewer.say(Note{3, moment, "Weber", "out of turn"});
  desk.viewer.say(Note{2, moment, "", ""});
  CHECK(desk.recorded() == 2);
  CHECK(desk.notes.back().author == "page");
  CHECK(desk.bench.core.counts().notes == 2);
}

TEST_CASE("a note is about the ten minutes before it") {
  Desk desk;
  desk.bench.now += 700s;
  desk.viewer.join();
  desk.viewer.say(Note{1, Micros{0}, "", "long ago"});
  desk.viewer.say(Note{2, desk.bench.now + 5s, "", "to come"});
  REQUIRE(desk.notes.size() == 2);
  CHECK(desk.notes[0].about == desk.bench.now - 600s);
  CHECK(desk.notes[1].about == desk.bench.now);
}

TEST_CASE("where nothing is recorded a note is refused, and the viewer stays") {
  Desk desk;
  desk.recording = false;
  desk.bench.sent.clear();
  desk.viewer.say(Note{1, desk.bench.now, "", "lost"});
  const auto refusal = desk.bench.last<Refuse>(2);
  REQUIRE(refusal);
  CHECK(reason(*refusal) == RefuseReason::bad_request);
  CHECK(std::get<Refuse>(refusal->body).message == "the room is not being recorded (--record)");
  CHECK(refusal->station == desk.viewer.as.station);
  CHECK(desk.bench.core.station_count() == 1);
  CHECK(desk.recorded() == 0);
}

TEST_CASE("notes come eight at once and then one every two seconds, and those of hands and strangers are none") {
  Desk desk;
  RawStation hand(desk.bench, 1, "hand"), stranger(desk.bench, 3, "stranger");
  hand.join();
  hand.say(Note{1, desk.bench.now, "", "a hand"});
  stranger.say(Note{1, desk.bench.now, "", "nobody"});
  CHECK(desk.notes.empty());
  CHECK(desk.bench.core.counts().unexpected == 1);
  for (int k = 0; k < 200; ++k) {  // as a viewer repeats it: 10 s
    desk.viewer.say(Note{static_cast<std::uint32_t>(desk.notes.size() + 1), desk.bench.now, "", "again"});
    desk.bench.wait(50ms);
  }
  CHECK(desk.notes.size() >= 8 + 4);
  CHECK(desk.notes.size() <= 8 + 5);
  CHECK(desk.bench.core.counts().notes_withheld > 100);
}
