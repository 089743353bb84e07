// A session read from a recording, and its metrics.
#include "common/assessment/session.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>
#include <numeric>

#include "common/assessment/session_metrics.hpp"
#include "tests/common/record/small_recording.hpp"

using namespace palpate;

namespace {

/// A stroke of 1 m in 1 s.
double stroke(double u) {
  u = std::clamp(u, 0.0, 1.0);
  return u * u * u * (10 + u * (6 * u - 15));
}

template <class Position>
std::vector<double> speeds_of(double length_s, Position x) {
  std::vector<Vec3> positions;
  for (int i = 0; i <= std::lround(length_s * kResampleHz); ++i) positions.push_back(Vec3(x(i / kResampleHz), 0, 0));
  return speeds(positions);
}

}  // namespace

TEST_CASE("the spectral arc length is that of its authors' own program", "[session]") {
  // numpy, with sparc() as published: a stroke, two overlapping strokes, a slow one with tremor.
  CHECK(spectral_arc_length(speeds_of(1, [](double t) { return stroke(t); }), 100) == Approx(-1.40584585));
  CHECK(spectral_arc_length(speeds_of(3, [](double t) { return stroke(t) + stroke(t - 1.7); }), 100) == Approx(-3.42955505));
  const auto tremor = [](double t) { return stroke(t / 3) + 0.003 * std::sin(2 * std::numbers::pi * 8 * t); };
  CHECK(spectral_arc_length(speeds_of(3, tremor), 100) == Approx(-2.32238122));
}

TEST_CASE("smoothness depends on neither size nor duration, and rest has none", "[session]") {
  const double once = spectral_arc_length(speeds_of(1, [](double t) { return stroke(t); }), 100);
  CHECK(spectral_arc_length(speeds_of(1, [](double t) { return 0.03 * stroke(t); }), 100) == Approx(once));
  CHECK(spectral_arc_length(speeds_of(2, [](double t) { return stroke(t / 2); }), 100) == Approx(once).epsilon(0.02));
  CHECK(spectral_arc_length(speeds_of(1, [](double) { return 0.3; }), 100) == 0);
  CHECK(spectral_arc_length({}, 100) == 0);
}

TEST_CASE("contact, force and path are what a pencil makes of them", "[session]") {
  SessionHand hand{"hand", {}, {}};
  for (int i = 0; i <= 1000; ++i) hand.path.push_back({i * 1e-3, Vec3(0.1 * i * 1e-3, 0, 0)});
  hand.forces = {{0, Vec3::Zero(), false},   {0.1, Vec3(0, 0, 1), true}, {0.3, Vec3(0, 3, 0), true}, {0.4, Vec3::Zero(), false},
                 {0.5, Vec3(0, 0, 2), true}, {1.0, Vec3::Zero(), false}};  // 0.5 s without data count as 0.25 s
  const SessionMetrics m = session_metrics(hand, 1.5);
  CHECK(m.duration_s == Approx(1));
  CHECK(m.path_m == Approx(0.1));
  CHECK(m.speed_mean_m_s == Approx(0.1));
  CHECK(m.contacts == 2);
  CHECK(m.contact_s == Approx(0.2 + 0.1 + 0.25));
  CHECK(m.force_peak_n == 3);
  CHECK(m.force_mean_n == Approx((0.2 * 1 + 0.1 * 3 + 0.25 * 2) / 0.55));
  CHECK(m.overs == 2);
  CHECK(m.over_s == Approx(0.1 + 0.25));
}

TEST_CASE("a force that trembles about the threshold exceeds it once", "[session]") {
  SessionHand hand{"hand", {{0, Vec3::Zero()}}, {}};
  for (int i = 0; i < 100; ++i) hand.forces.push_back({i * 0.01, Vec3(0, 0, i % 2 ? 2.1 : 1.9), true});
  hand.forces.push_back({1, Vec3(0, 0, 1.7), true});
  hand.forces.push_back({1.1, Vec3(0, 0, 2.1), true});
  hand.forces.push_back({1.2, Vec3(0, 0, 0), true});
  const SessionMetrics m = session_metrics(hand, 2);
  CHECK(m.overs == 2);
  CHECK(m.over_s == Approx(0.6));
}

TEST_CASE("the hands of a recording become motions over one time", "[session]") {
  RecordingWriter writer(test::small_head());
  for (const StationId id : {3u, 4u, 5u}) {
    RecordedEvent joined;
    joined.station = id;
    joined.name = id == 5 ? "early" : id == 3 ? "early" : "late";  // 5 is 3 again
    writer.add(joined);
  }
  const auto path = [&](StationId id, int from_ms, int to_ms) {
    RecordedPath p{id, {}};
    for (int ms = from_ms; ms <= to_ms; ++ms) p.samples.push_back({Micros{1'000'000 + 1000 * ms}, Vec3(1e-3 * ms, id, 0)});
    writer.add(p);
  };
  path(3, 0, 400);
  path(4, 300, 900);
  path(5, 500, 800);
  const auto turned = [](double rad) { return Rotation(Eigen::AngleAxisd(rad, Vec3::UnitZ())); };
  for (const int ms : {400, 600}) writer.add(RecordedTurn{Micros{1'000'000 + 1000 * ms}, 4, turned(1e-3 * ms), 1e-3 * ms});
  writer.finish();
  const auto bytes = writer.take();
  const Session session = read_session(RecordingReader(bytes, "hands"));
  REQUIRE(session.hands.size() == 2);
  CHECK(session.hands[0].name == "early");
  const auto motions = motions_of(session, 1, "hands");
  REQUIRE(motions.size() == 2);
  const Motion &late = motions[0], &early = motions[1];
  CHECK(late.duration_s() == Approx(0.9));
  CHECK(early.duration_s() == Approx(0.9));
  CHECK(late.position(0.0).x() == Approx(0.3));
  CHECK(late.position(0.5).x() == Approx(0.5));
  CHECK(early.position(0.1).x() == Approx(0.1));
  CHECK(early.position(0.6).y() == Approx(5));
  CHECK(early.position(0.9).x() == Approx(0.8));
  CHECK_FALSE(early.has_orientation());
  CHECK_FALSE(early.has_opening());
  for (const auto& [ms, rad] : {std::pair{100, 0.4}, {450, 0.45}, {600, 0.6}, {900, 0.6}}) {
    CHECK(late.orientation(Micros{1000 * ms})->angularDistance(turned(rad)) < 1e-3);
    CHECK(late.opening(Micros{1000 * ms}) == Approx(rad).margin(1e-3));
  }
}

TEST_CASE("notes come in the order of the moments that they are about", "[session]") {
  RecordingWriter writer(test::small_head());
  for (int k = 0; k < 10; ++k) test::add_small_frame(writer, k);
  writer.add(RecordedNote{test::kSmallBegin + Micros{600'000}, 2, test::kSmallBegin + Micros{100'000}, "a", "earlier"});
  writer.finish();
  const auto bytes = writer.take();
  const RecordingReader recording(bytes, "notes");
  const Session session = read_session(recording);
  REQUIRE(session.notes.size() == 2);
  CHECK(session.notes[0].text == "too deep");
  CHECK(session.notes[0].t_s < 0);  // before the recording began
  CHECK(session.notes[1].t_s == Approx(seconds(test::kSmallBegin + Micros{100'000} - recording.begin())));
  CHECK(session.notes[1].written_s == Approx(session.notes[1].t_s + 0.5));
  CHECK(cut(session, 0, 10).notes.size() == 1);
}

TEST_CASE("a part of a session has what lies in it, and says when a hand was there", "[session]") {
  Session session;
  session.hands.resize(2);
  for (int i = 0; i <= 2000; ++i)
    if (i <= 500 || i >= 1500) session.hands[0].path.push_back({i * 1e-3, Vec3(i * 1e-6, 0, 0)});
  for (int i = 900; i <= 1000; ++i) session.hands[1].path.push_back({i * 1e-3, Vec3::Zero()});
  session.hands[0].forces = {{0.2, Vec3::UnitZ(), true}, {1.8, Vec3::UnitX(), true}};

  const std::vector<std::uint8_t> there = presence_of(session, 0);  // away from 0.5 to 1.5 s
  CHECK(there.size() == 2001);
  CHECK(std::accumulate(there.begin(), there.end(), 0) == 2 * 501);
  CHECK(there[500] == 1);
  CHECK(there[501] == 0);

  const Session part = cut(session, 1.2, 1.9005);
  REQUIRE(part.hands.size() == 1);  // the other hand was not present
  CHECK(part.hands[0].path.front().t_s == Approx(1.5));
  CHECK(part.hands[0].path.back().t_s == Approx(1.9));
  REQUIRE(part.hands[0].forces.size() == 1);
  CHECK(part.hands[0].forces[0].force == Vec3::UnitX());
  CHECK(motions_of(part, 0, "part").front().duration_s() == Approx(0.4));
}
