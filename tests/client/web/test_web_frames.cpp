// Messages to browsers, read back by the bytes of docs/reference/web.md.
#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>

#include "client/viewer/color.hpp"
#include "client/web/summary_message.hpp"
#include "client/web/web_frames.hpp"
#include "common/assessment/session_metrics.hpp"
#include "common/assessment/task_attempts.hpp"
#include "tests/client/view/demo_body.hpp"
#include "tests/common/record/small_recording.hpp"

using namespace palpate;
using nlohmann::json;

namespace {

/// Reads little-endian values one after the other.
struct Bytes {
  const std::string& all;
  std::size_t at = 0;

  template <class Value>
  Value next() {
    Value value{};
    REQUIRE(at + sizeof value <= all.size());
    std::memcpy(&value, all.data() + at, sizeof value);
    at += sizeof value;
    return value;
  }
  Vec3f vector() {
    const auto x = next<float>(), y = next<float>(), z = next<float>();
    return {x, y, z};
  }
  std::string text(std::size_t bytes) {
    REQUIRE(at + bytes <= all.size());
    at += bytes;
    return all.substr(at - bytes, bytes);
  }
};

struct Decoded {
  std::uint32_t version = 0;
  double t_s = 0;
  std::vector<ToolView> tools;
  std::vector<Vec3f> positions;
};

Decoded decoded(const std::string& frame, const std::vector<Vec3f>& rest, float unit_m) {
  Bytes bytes{frame};
  REQUIRE(bytes.next<std::uint8_t>() == 2);
  Decoded out;
  out.version = bytes.next<std::uint32_t>();
  out.t_s = bytes.next<double>();
  for (int tools = bytes.next<std::uint8_t>(); tools > 0; --tools) {
    ToolView tool;
    const auto flags = bytes.next<std::uint8_t>();
    tool.contact = (flags & 1) != 0;
    tool.buttons = bytes.next<std::uint32_t>();
    tool.position = bytes.vector().cast<double>();
    tool.force = bytes.vector().cast<double>();
    if ((flags & 2) != 0) {
      const Vec3f xyz = bytes.vector();
      const auto w = bytes.next<float>();
      tool.orientation = Eigen::Quaterniond(w, xyz.x(), xyz.y(), xyz.z());
    }
    if ((flags & 4) != 0) tool.torque = bytes.vector().cast<double>();
    tool.station = bytes.text(bytes.next<std::uint8_t>());
    out.tools.push_back(std::move(tool));
  }
  out.positions = rest;
  const auto* blocks = reinterpret_cast<const std::uint8_t*>(frame.data());
  BlockReader reader({blocks + bytes.at, blocks + frame.size()}, 3);
  ShapeBlock block;
  while (reader.next(block))
    for (std::uint32_t v = 0; v < block.vertices; ++v)
      for (int k = 0; k < 3; ++k)
        out.positions.at(kBlockVertices * block.index + v)[k] +=
            unit_m * static_cast<float>(block.numbers[3 * v + static_cast<std::uint32_t>(k)]);
  REQUIRE(reader.ok());
  return out;
}

ViewMoment moment_of(const demo::Body& body) {
  ViewMoment moment;
  moment.shape.positions = body.positions;
  moment.shape.body_time = Micros{12'345'678};
  moment.tools = body.tools;
  return moment;
}

}  // namespace

TEST_CASE("A browser's shape is within half a unit of the body in every coordinate, and has its tools", "[web]") {
  demo::Body body = demo::pressed_organ(0.012F, 2.5);
  body.tools[0].station = "or 3 \xc3\xa4";
  body.tools[0].buttons = 5;
  body.tools[0].orientation = Eigen::Quaterniond(0.5, 0.5, -0.5, 0.5);
  body.tools[0].torque = Vec3(0.02, -0.01, 0.005);
  body.tools.push_back({"free", Vec3(0.01, 0.02, 0.1), Vec3::Zero(), false});
  const float unit_m = shape_unit_m(body.triangles, body.rest);
  CHECK(unit_m == Approx(bounds(body.triangles, body.rest).diagonal() / 8192));
  const Decoded seen = decoded(shape_frame(moment_of(body), body.rest, 7, unit_m), body.rest, unit_m);
  CHECK(seen.version == 7);
  CHECK(seen.t_s == 12.345678);
  float off_m = 0;
  for (std::size_t v = 0; v < body.rest.size(); ++v)
    off_m = std::max(off_m, (seen.positions[v] - body.positions[v]).cwiseAbs().maxCoeff());
  CHECK(off_m <= 0.501F * unit_m);
  REQUIRE(seen.tools.size() == 2);
  for (std::size_t k = 0; k < 2; ++k) {
    CHECK(seen.tools[k].station == body.tools[k].station);
    CHECK(seen.tools[k].contact == body.tools[k].contact);
    CHECK(seen.tools[k].buttons == body.tools[k].buttons);
    CHECK((seen.tools[k].position - body.tools[k].position).norm() < 1e-7);
    CHECK((seen.tools[k].force - body.tools[k].force).norm() < 1e-6);
    CHECK((seen.tools[k].torque - body.tools[k].torque).norm() < 1e-8);
    REQUIRE(seen.tools[k].orientation.has_value() == body.tools[k].orientation.has_value());
  }
  CHECK(seen.tools[0].orientation->angularDistance(*body.tools[0].orientation) < 1e-6);
}

TEST_CASE("Blocks at rest cost nothing, and a shape needs none before it", "[web]") {
  const demo::Body rest = demo::pressed_organ(0, 0);
  const float unit_m = shape_unit_m(rest.triangles, rest.rest);
  const std::size_t empty = shape_frame(moment_of(rest), rest.rest, 1, unit_m).size();
  CHECK(empty < 64);
  demo::Body one = rest;
  one.positions[70] += Vec3f(0, 0, 0.001F);
  const std::string frame = shape_frame(moment_of(one), one.rest, 1, unit_m);
  CHECK(frame.size() > empty);
  CHECK(frame.size() < empty + 16 + 64 * 2);
  const Decoded seen = decoded(frame, one.rest, unit_m);
  CHECK(std::abs(seen.positions[70].z() - one.positions[70].z()) <= unit_m);
  CHECK(seen.positions[0] == one.rest[0]);
}

TEST_CASE("A vertex that is nowhere does not leave palpate-web", "[web]") {
  demo::Body body = demo::pressed_organ(0.01F, 1);
  const float unit_m = shape_unit_m(body.triangles, body.rest);
  body.positions[3].x() = std::numeric_limits<float>::quiet_NaN();
  body.positions[4].y() = std::numeric_limits<float>::infinity();
  body.positions[5].z() = 1e30F;
  const Decoded seen = decoded(shape_frame(moment_of(body), body.rest, 1, unit_m), body.rest, unit_m);
  for (const Vec3f& p : seen.positions) CHECK(p.allFinite());
  CHECK(seen.positions[3].x() == body.rest[3].x());
}

TEST_CASE("The topology has every vertex at rest, the held ones marked, and every triangle", "[web]") {
  const demo::Body body = demo::pressed_organ(0, 0, 2);
  const RoomInfo facts = demo::facts_of(body);
  const std::string frame = mesh_frame(facts.mesh, body.rest, 9, 1e-5F);
  Bytes bytes{frame};
  CHECK(bytes.next<std::uint8_t>() == 1);
  CHECK(bytes.next<std::uint32_t>() == 9);
  CHECK(bytes.next<float>() == 1e-5F);
  REQUIRE(bytes.next<std::uint32_t>() == body.rest.size());
  REQUIRE(bytes.next<std::uint32_t>() == body.triangles.size());
  for (const Vec3f& p : body.rest) REQUIRE(bytes.vector() == p);
  for (const MeshVertex& v : facts.mesh.vertices) REQUIRE(bytes.next<std::uint8_t>() == mark_of(v));
  for (const Triangle& t : body.triangles)
    for (const std::uint32_t corner : t) REQUIRE(bytes.next<std::uint32_t>() == corner);
  CHECK(bytes.at == frame.size());
}

TEST_CASE("The page gets each rigid part with its name, colour and triangles", "[web]") {
  const std::vector<PartMesh> parts{
      {"table", 0x8fa3ad, 0.3, {{{Vec3(0.5, 0, 0)}, {Vec3(0, 0.25, 0)}, {Vec3(0, 0, 1)}}, {{0, 2, 1}}}},
      {"Röhre", 0xe8dcc0, 0, {{{Vec3(1, 2, 3)}}, {}}}};
  const std::string frame = parts_frame(parts);
  Bytes bytes{frame};
  CHECK(bytes.next<std::uint8_t>() == 3);
  REQUIRE(bytes.next<std::uint8_t>() == parts.size());
  for (const PartMesh& part : parts) {
    CHECK(bytes.text(bytes.next<std::uint8_t>()) == part.name);
    CHECK(bytes.next<std::uint32_t>() == part.colour);
    REQUIRE(bytes.next<std::uint32_t>() == part.mesh.vertices.size());
    REQUIRE(bytes.next<std::uint32_t>() == part.mesh.triangles.size());
    for (const MeshVertex& vertex : part.mesh.vertices) CHECK(bytes.vector() == Vec3f(vertex.rest.cast<float>()));
    for (const Triangle& t : part.mesh.triangles)
      for (const std::uint32_t corner : t) CHECK(bytes.next<std::uint32_t>() == corner);
  }
  CHECK(bytes.at == frame.size());
}

TEST_CASE("The room's message has each station's link and scheme, and no number that is not known", "[web]") {
  RoomView room;
  room.nodes = 318;
  room.rate_hz = 20;
  StationView known;
  known.station = "or 3";
  known.rtt = Micros{121'460};
  known.judged = 200;
  known.lost = 5;
  known.states = 36;
  known.ticks_late = 4;
  known.in_use = {Scheme::hyper, SchemeReason::fits, Micros{9'000}, Micros{30'000}};
  StationView damaged;
  damaged.station = "\xff\xfe";
  room.stations = {known, damaged};
  PageState state;
  state.title = "organ";
  state.room = &room;
  const json said = json::parse(room_message(state));
  CHECK(said["type"] == "room");
  CHECK(said["nodes"] == 318);
  CHECK_FALSE(said.contains("bodies"));
  CHECK_FALSE(said.contains("tool"));
  const json& first = said["stations"][0];
  CHECK(first["rtt_ms"] == 121.5);
  CHECK(first["loss_pct"] == 2.5);
  CHECK(first["jitter_ms"].is_null());
  CHECK(first["scheme"] == "hyper");
  CHECK(first["states"] == 36);
  CHECK(first["late"] == 4);
  CHECK(first["reason"] == describe(known.in_use));
  CHECK(said["stations"][1]["loss_pct"].is_null());
  CHECK_FALSE(said["stations"][1].contains("reason"));
  room.bodies = {{"liver", 0x7a2f2a}, {"stomach", 0xd08a80}};
  room.tool = {{Vec3(0, 0, 0.004), 0.004}, {Vec3(0, 0, 0.012), 0.0025}};
  CHECK(json::parse(room_message(state))["tool"] == json{{0.0, 0.0, 0.004, 0.004}, {0.0, 0.0, 0.012, 0.0025}});
  CHECK(json::parse(room_message(state))["bodies"][1] == json{{"name", "stomach"}, {"color", "#d08a80"}});
  state.late_known = false;
  CHECK_FALSE(json::parse(room_message(state))["stations"][0].contains("late"));
}

TEST_CASE("The room's message has the training task, its target and the progress of each hand", "[web]") {
  TaskWatch watch;
  PageState state;
  state.task = &watch;
  CHECK_FALSE(json::parse(room_message(state)).contains("task"));
  watch.take(Task{"hold", PressTask{0.5, 2, 1}});
  for (std::uint32_t k = 0; k <= 10; ++k)
    watch.take(Tools{k, Micros{50'000 * k}, 0, {{"anna", Vec3::Zero(), Vec3(0, 0, 1), true}}});
  const json held = json::parse(room_message(state))["task"];
  CHECK(held["kind"] == "press");
  CHECK(held["text"] == "hold");
  CHECK(held["max_n"] == 2.0);
  CHECK(held["hands"] ==
        json::parse(R"([{"station":"anna","score":50.0,"done":0.5,"finished":false,"force_n":1.0,"text":"held 0.5 of 1 s"}])"));
  watch.take(Task{"find", FindTask{Vec3(0.01, 0, 0.02), Vec3(0.01, 0, 0.04), 0.005, 0.005}});
  watch.take(Tools{11, Micros{550'000}, 0, {{"anna", Vec3(0.02, 0, 0.04), Vec3(0, 0, 1), true, {}, 1}}});
  const json found = json::parse(room_message(state))["task"];
  CHECK(found["lump"] == json({0.01, 0.0, 0.02}));
  CHECK(found["hands"][0]["mark"] == json({0.02, 0.0, 0.04}));
  watch.take(Task{"trace", TraceTask{{{Vec3(0, 0, 0)}, {Vec3(0.1, 0, 0)}}, 0.002}});
  CHECK(json::parse(room_message(state))["task"]["line"] == json::parse("[[0.0,0.0,0.0],[0.1,0.0,0.0]]"));
}

TEST_CASE("A browser gets the viewer's own colours, and the extent of a recording", "[web]") {
  const json live = json::parse(hello_message({.program = "p"}));
  CHECK(live["live"] == true);
  CHECK_FALSE(live.contains("recording"));
  CHECK(live["stations"].size() == kStationColors);
  const auto palette = live["palette"].get<std::vector<std::string>>();
  const auto same = [](const std::string& css, const Vec3f& color) {
    for (int k = 0; k < 3; ++k)
      if (std::abs(std::stof("0x" + css.substr(1 + 2 * static_cast<std::size_t>(k), 2)) - 255 * color[k]) > 0.51F) return false;
    return css.size() == 7 && css[0] == '#';
  };
  CHECK(same(palette.front(), displacement_color(0)));
  CHECK(same(palette.back(), displacement_color(1)));
  CHECK(same(live["stations"][1].get<std::string>(), station_color(1)));
  const json played = json::parse(hello_message(
      {.program = "p", .live = false, .begin_s = 1.5, .end_s = 9, .course = {0, 0.5F, 1}, .hands = {"ben", "anna"}}));
  CHECK(played["recording"]["begin"] == 1.5);
  CHECK(played["recording"]["end"] == 9);
  CHECK(played["recording"]["course"] == json({0.0, 0.5, 1.0}));
  CHECK(played["recording"]["hands"] == json({"ben", "anna"}));
}

TEST_CASE("The plot's past has a point for each value", "[web]") {
  History forces;
  forces.add(Micros{1'000'000}, "a", 0.5F);
  forces.add(Micros{1'050'000}, "a", 0.75F);
  forces.add(Micros{1'050'000}, "b", 2);
  const json said = json::parse(history_message(forces));
  CHECK(said["span_s"] == 10.0);
  CHECK(said["series"] ==
        json::parse(R"([{"station":"a","points":[[1.0,0.5],[1.05,0.75]]},{"station":"b","points":[[1.05,2.0]]}])"));
}

TEST_CASE("Notes are listed with what became of them, and the summary has the figures of palpate-lab summary", "[web]") {
  const std::vector<PageNote> notes{
      {1.5, "Weber", "too deep"}, {2, "page", "", "nothing is recorded"}, {3, "page", "", "", true}};
  CHECK(json::parse(notes_message(notes))["notes"] == json::parse(R"([
    {"t":1.5,"author":"Weber","text":"too deep","state":"recorded"},
    {"t":2.0,"author":"page","text":"","state":"refused","why":"nothing is recorded"},
    {"t":3.0,"author":"page","text":"","state":"waiting"}])"));
  const auto bytes = test::small_recording(40, true);
  const RecordingReader recording(bytes, "small");
  const json said = json::parse(summary_message(recording));
  const Session session = read_session(recording);
  const SessionMetrics metrics = session_metrics(session.hands.at(0), 2);
  REQUIRE(said["hands"].size() == session.hands.size());
  CHECK(said["threshold_n"] == 2.0);
  CHECK(said["hands"][0]["name"] == session.hands[0].name);
  CHECK(said["hands"][0]["force_peak_n"] == metrics.force_peak_n);
  CHECK(said["hands"][0]["smoothness_sparc"] == metrics.sparc);
  const auto attempts = task_attempts(recording);
  REQUIRE(attempts.size() == 1);
  CHECK(said["attempts"][0]["score"] == attempts[0].progress.score);
  CHECK(said["guidance"].size() == 1);
}

TEST_CASE("A server's rooms are part of its message where there are several", "[web]") {
  RoomList rooms;
  PageState state;
  state.rooms = &rooms;
  CHECK_FALSE(json::parse(room_message(state)).contains("rooms"));
  rooms = {"left", {"left", "right"}};
  CHECK(json::parse(room_message(state))["rooms"] == json({"left", "right"}));
  CHECK(json::parse(room_message(state))["here"] == "left");
}

TEST_CASE("A browser asks in seven ways, and everything else is ignored", "[web]") {
  using Kind = PageRequest::Kind;
  CHECK(read_request(R"({"play":true})").kind == Kind::play);
  CHECK(read_request(R"({"play":false})").kind == Kind::pause);
  const PageRequest seek = read_request(R"({"seek":12.5})");
  CHECK(seek.kind == Kind::seek);
  CHECK(seek.value == 12.5);
  CHECK(read_request(R"({"speed":-1})").kind == Kind::speed);
  CHECK(read_request(R"({"step":3})").kind == Kind::step);
  const PageRequest room = read_request(R"({"room":"left lung"})");
  CHECK(room.kind == Kind::room);
  CHECK(room.text == "left lung");
  const PageRequest note = read_request(R"({"note":{"t":2.5,"author":"Weber","text":"too deep"}})");
  CHECK(note.kind == Kind::note);
  CHECK(note.value == 2.5);
  CHECK(note.author == "Weber");
  CHECK(note.text == "too deep");
  for (const char* text : {"", "{", "[]", "null", "7", R"({})", R"({"seek":"1"})", R"({"seek":null})", R"({"seek":1e999})",
                           R"({"play":1})", R"({"seek":1,"play":true})", R"({"reset":1})", R"({"room":1})", R"({"note":"x"})",
                           R"({"note":{"t":1,"author":"a"}})", R"({"note":{"t":"1","author":"a","text":"b"}})",
                           R"({"note":{"t":1,"author":"a","text":"b","more":1}})", "\xff\xfe", "[[[[[[[["})
    CHECK(read_request(text).kind == Kind::none);
}
