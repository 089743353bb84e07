#include "client/web/web_frames.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <nlohmann/json.hpp>

#include "client/viewer/color.hpp"
#include "client/viewer/surface.hpp"
#include "common/wire/shape_blocks.hpp"

namespace palpate {
namespace {

using nlohmann::json;

constexpr std::uint8_t kMeshKind = 1, kShapeKind = 2, kPartsKind = 3;
constexpr int kPaletteColors = 64;

template <class Value>
void append(std::string& out, Value value) {
  static_assert(std::endian::native == std::endian::little);
  out.append(reinterpret_cast<const char*>(&value), sizeof value);
}

template <class Vector>
void append_vector(std::string& out, const Vector& v) {
  for (Eigen::Index k = 0; k < v.size(); ++k) append(out, static_cast<float>(v[k]));
}

void append_name(std::string& out, const std::string& name) {
  const std::size_t length = std::min<std::size_t>(name.size(), UINT8_MAX);
  append(out, static_cast<std::uint8_t>(length));
  out.append(name, 0, length);
}

void append_triangles(std::string& out, const std::vector<Triangle>& triangles) {
  for (const Triangle& t : triangles)
    for (const std::uint32_t v : t) append(out, v);
}

void append_tool(std::string& out, const ToolView& tool) {
  append(out, static_cast<std::uint8_t>((tool.contact ? 1 : 0) | (tool.orientation ? 2 : 0) | (tool.torque.isZero(0) ? 0 : 4)));
  append(out, tool.buttons);
  append_vector(out, tool.position);
  append_vector(out, tool.force);
  if (tool.orientation) append_vector(out, tool.orientation->coeffs());
  if (!tool.torque.isZero(0)) append_vector(out, tool.torque);
  append_name(out, tool.station);
}

json rounded(double value, int digits) {
  const double scale = std::pow(10.0, digits);
  return std::isfinite(value) ? json(std::round(value * scale) / scale) : json(nullptr);
}

json ms(Micros t) { return t.count() > 0 ? rounded(1e3 * seconds(t), 1) : json(nullptr); }

std::string css(const Vec3f& srgb) {
  std::string text = "#";
  for (const float c : srgb) {
    const int level = static_cast<int>(std::lround(255 * std::clamp(c, 0.0F, 1.0F)));
    for (const int digit : {level / 16, level % 16}) text += "0123456789abcdef"[digit];
  }
  return text;
}

json point_json(const Vec3& p) { return {rounded(p.x(), 5), rounded(p.y(), 5), rounded(p.z(), 5)}; }

json spheres_json(const ToolShape& tool) {
  json spheres = json::array();
  for (const ToolSphere& sphere : tool) {
    json ball = point_json(sphere.centre);
    ball.push_back(rounded(sphere.radius_m, 5));
    spheres.push_back(std::move(ball));
  }
  return spheres;
}

json station_json(const StationView& s, bool late_known) {
  json j{{"name", s.station},
         {"rtt_ms", ms(s.rtt)},
         {"jitter_ms", ms(s.jitter)},
         {"age_ms", ms(s.patch_age)},
         {"loss_pct", s.judged > 0 ? rounded(100.0 * s.lost / s.judged, 1) : json(nullptr)},
         {"scheme", name_of(s.in_use.scheme)},
         {"states", s.states}};
  if (s.in_use.reason > SchemeReason::asked) j["reason"] = describe(s.in_use);
  if (late_known) j["late"] = s.ticks_late;
  if (!s.tool.name.empty()) j["tool"] = {{"name", s.tool.name}, {"spheres", spheres_json(s.tool.shape)}};
  return j;
}

json task_json(const TaskWatch& watch) {
  const Task& task = *watch.task();
  json j{{"kind", kind_of(task)}, {"text", task.text}, {"hands", json::array()}};
  if (const auto* find = std::get_if<FindTask>(&task.goal)) {
    j["lump"] = point_json(find->lump);
    j["radius_m"] = rounded(find->radius_m, 5);
  } else if (const auto* press = std::get_if<PressTask>(&task.goal)) {
    j["min_n"] = rounded(press->min_n, 3);
    j["max_n"] = rounded(press->max_n, 3);
  } else {
    j["line"] = json::array();
    for (const LinePoint& point : std::get<TraceTask>(task.goal).line) j["line"].push_back(point_json(point.at));
  }
  for (const TaskWatch::Hand& hand : watch.hands()) {
    json one{{"station", hand.station},
             {"score", rounded(hand.progress.score, 1)},
             {"done", rounded(hand.progress.done, 3)},
             {"finished", hand.progress.finished()},
             {"force_n", rounded(hand.force_n, 2)},
             {"text", in_words(task, hand.progress)}};
    if (hand.progress.mark) one["mark"] = point_json(*hand.progress.mark);
    j["hands"].push_back(std::move(one));
  }
  return j;
}

/// Reads {"t": 1.5, "author": "Weber", "text": "too deep"}; kind none for another value.
PageRequest read_note(const json& value) {
  if (!value.is_object() || value.size() != 3) return {};
  const auto t = value.find("t"), author = value.find("author"), text = value.find("text");
  if (t == value.end() || author == value.end() || text == value.end()) return {};
  if (!t->is_number() || !std::isfinite(t->get<double>()) || !author->is_string() || !text->is_string()) return {};
  return {PageRequest::Kind::note, t->get<double>(), text->get<std::string>(), author->get<std::string>()};
}

/// Returns the text, with a replacement for bytes that are no UTF-8: names come from the network and from files.
std::string text_of(const json& j) { return j.dump(-1, ' ', false, json::error_handler_t::replace); }

}  // namespace

float shape_unit_m(std::span<const Triangle> triangles, std::span<const Vec3f> rest) {
  return std::max(0x1p-13F * bounds(triangles, rest).diagonal(), 1e-9F);
}

std::string mesh_frame(const BodyMesh& mesh, std::span<const Vec3f> rest, std::uint32_t version, float unit_m) {
  std::string out;
  out.reserve(32 + 13 * rest.size() + 12 * mesh.triangles.size());
  append(out, kMeshKind);
  append(out, version);
  append(out, unit_m);
  append(out, static_cast<std::uint32_t>(rest.size()));
  append(out, static_cast<std::uint32_t>(mesh.triangles.size()));
  for (const Vec3f& p : rest) append_vector(out, p);
  for (std::size_t v = 0; v < rest.size(); ++v)
    append(out, v < mesh.vertices.size() ? mark_of(mesh.vertices[v]) : std::uint8_t{0});
  append_triangles(out, mesh.triangles);
  return out;
}

std::string parts_frame(std::span<const PartMesh> parts) {
  std::string out;
  append(out, kPartsKind);
  append(out, static_cast<std::uint8_t>(parts.size()));
  for (const PartMesh& part : parts) {
    append_name(out, part.name);
    append(out, part.colour);
    append(out, static_cast<std::uint32_t>(part.mesh.vertices.size()));
    append(out, static_cast<std::uint32_t>(part.mesh.triangles.size()));
    for (const MeshVertex& vertex : part.mesh.vertices) append_vector(out, vertex.rest);
    append_triangles(out, part.mesh.triangles);
  }
  return out;
}

std::string shape_frame(const ViewMoment& moment, std::span<const Vec3f> rest, std::uint32_t version, float unit_m) {
  std::string out;
  append(out, kShapeKind);
  append(out, version);
  append(out, seconds(moment.shape.body_time));
  append(out, static_cast<std::uint8_t>(std::min<std::size_t>(moment.tools.size(), UINT8_MAX)));
  for (std::size_t k = 0; k < std::min<std::size_t>(moment.tools.size(), UINT8_MAX); ++k) append_tool(out, moment.tools[k]);
  const std::size_t vertices = std::min(rest.size(), moment.shape.positions.size());
  std::vector<std::uint8_t> blocks;
  std::vector<std::int32_t> numbers;
  for (std::size_t first = 0; first < vertices; first += kBlockVertices) {
    numbers.clear();
    for (std::size_t v = first; v < std::min(vertices, first + kBlockVertices); ++v)
      for (const float d : Vec3f(moment.shape.positions[v] - rest[v])) {
        const float steps = std::clamp(d / unit_m, -static_cast<float>(kMaxBlockNumber), static_cast<float>(kMaxBlockNumber));
        numbers.push_back(std::isfinite(steps) ? static_cast<std::int32_t>(std::lround(steps)) : 0);
      }
    if (std::any_of(numbers.begin(), numbers.end(), [](std::int32_t n) { return n != 0; }))
      append_block(static_cast<std::uint32_t>(first / kBlockVertices), numbers, 3, blocks);
  }
  out.append(blocks.begin(), blocks.end());
  return out;
}

std::string room_message(const PageState& state) {
  json j{{"type", "room"},       {"title", state.title},     {"status", state.status},
         {"live", state.live},   {"heard", state.heard},     {"t", rounded(state.t_s, 6)},
         {"speed", state.speed}, {"playing", state.playing}, {"stations", json::array()}};
  if (state.refused) j["refused"] = true;
  if (state.room != nullptr) {
    for (const StationView& station : state.room->stations) j["stations"].push_back(station_json(station, state.late_known));
    if (!state.room->tool.empty()) j["tool"] = spheres_json(state.room->tool);
    for (const BodyName& body : state.room->bodies)
      j["bodies"].push_back({{"name", body.name}, {"color", css(srgb_of(body.colour))}});
    j["nodes"] = state.room->nodes;
    j["rate_hz"] = rounded(state.room->rate_hz, 1);
    j["frame_ms"] = ms(state.room->frame_time);
    j["real_time"] = rounded(state.room->real_time_factor, 1);
    j["asleep"] = state.room->asleep;
    j["starved"] = state.room->starved;
  }
  if (state.rooms != nullptr && !state.rooms->names.empty()) {
    j["rooms"] = state.rooms->names;
    j["here"] = state.rooms->here;
  }
  if (state.task != nullptr && state.task->task() != nullptr) j["task"] = task_json(*state.task);
  return text_of(j);
}

std::string notes_message(std::span<const PageNote> notes) {
  json all = json::array();
  for (const PageNote& note : notes) {
    json one{{"t", rounded(note.t_s, 3)}, {"author", note.author}, {"text", note.text}};
    one["state"] = note.waiting ? "waiting" : note.refusal.empty() ? "recorded" : "refused";
    if (!note.refusal.empty()) one["why"] = note.refusal;
    all.push_back(std::move(one));
  }
  return text_of({{"type", "notes"}, {"notes", std::move(all)}});
}

std::string history_message(const History& forces) {
  json all = json::array();
  for (const History::Series& series : forces.series()) {
    json points = json::array();
    for (const History::Point& p : series.points) points.push_back({rounded(seconds(p.at), 3), rounded(p.value, 3)});
    all.push_back({{"station", series.station}, {"points", std::move(points)}});
  }
  return text_of({{"type", "history"}, {"span_s", seconds(History::kSpan)}, {"series", std::move(all)}});
}

std::string hello_message(const PageGreeting& greeting) {
  json palette = json::array(), stations = json::array(), course = json::array();
  for (int k = 0; k < kPaletteColors; ++k)
    palette.push_back(css(displacement_color(static_cast<float>(k) / static_cast<float>(kPaletteColors - 1))));
  for (std::size_t k = 0; k < kStationColors; ++k) stations.push_back(css(station_color(k)));
  for (const float share : greeting.course) course.push_back(rounded(share, 3));
  json j{{"type", "hello"},
         {"program", greeting.program},
         {"live", greeting.live},
         {"palette", std::move(palette)},
         {"stations", std::move(stations)},
         {"held", css(to_srgb(held_color()))},
         {"wall", css(to_srgb(wall_color()))},
         {"thread", css(to_srgb(thread_color()))}};
  if (!greeting.live)
    j["recording"] = {{"begin", rounded(greeting.begin_s, 6)},
                      {"end", rounded(greeting.end_s, 6)},
                      {"period", rounded(greeting.period_s, 6)},
                      {"course", std::move(course)},
                      {"force_max_n", rounded(greeting.force_max_n, 3)},
                      {"displacement_max_m", rounded(greeting.displacement_max_m, 6)},
                      {"hands", greeting.hands}};
  return text_of(j);
}

PageRequest read_request(std::string_view text) {
  const json j = json::parse(text, nullptr, false);
  if (!j.is_object() || j.size() != 1) return {};
  const auto& name = j.begin().key();
  const json& value = j.begin().value();
  if (name == "play" && value.is_boolean()) return {value.get<bool>() ? PageRequest::Kind::play : PageRequest::Kind::pause};
  if (name == "room" && value.is_string()) return {PageRequest::Kind::room, 0, value.get<std::string>()};
  if (name == "note") return read_note(value);
  if (!value.is_number() || !std::isfinite(value.get<double>())) return {};
  if (name == "seek") return {PageRequest::Kind::seek, value.get<double>()};
  if (name == "speed") return {PageRequest::Kind::speed, value.get<double>()};
  if (name == "step") return {PageRequest::Kind::step, value.get<double>()};
  return {};
}

}  // namespace palpate
