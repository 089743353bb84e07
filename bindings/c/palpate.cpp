// The C interface over bindings/core: handles hold its objects, and exceptions become results with a text.
#include "bindings/c/palpate.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <exception>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "bindings/core/live_station.hpp"
#include "bindings/core/live_viewer.hpp"
#include "bindings/core/local_room.hpp"
#include "client/core/haptic_tick.hpp"
#include "common/base/error.hpp"
#include "common/base/tool_pose.hpp"
#include "common/player/player.hpp"
#include "server/body/unload.hpp"
#include "server/io/threaded_server.hpp"

struct palpate_scene {
  palpate::Scene scene;
  std::vector<palpate::Vec3> vertices = vertices_at_rest(scene.body);
};
struct palpate_body {
  palpate::LocalRoom room;
  palpate::FrameResult frame = {};
};
struct palpate_player {
  palpate::PatchPlayer player;
  palpate::ToolSample at;
};
struct palpate_client {
  palpate::LiveStation station;
};
struct palpate_server {
  palpate::ThreadedServer server;
};
struct palpate_viewer {
  palpate::LiveViewer viewer;
};

namespace palpate {
namespace {

std::string& error_text() {
  thread_local std::string text;
  return text;
}

int fail(int result, const char* text) noexcept {
  try {
    error_text() = text;
  } catch (...) {  // no memory for the text: the one before stays
  }
  return result;
}

/// Runs `body`; an exception becomes a result.
template <class Body>
int guarded(Body body) noexcept {
  try {
    body();
    return PALPATE_OK;
  } catch (const InputError& error) {
    return fail(PALPATE_BAD_INPUT, error.what());
  } catch (const std::exception& error) {
    return fail(PALPATE_FAILED, error.what());
  } catch (...) {
    return fail(PALPATE_FAILED, "an unknown exception");
  }
}

template <class T>
T& needed(T* pointer, const char* name) {
  if (!pointer) throw InputError(name, "is null", "a pointer");
  return *pointer;
}

/// A struct of the caller's version, as one of this version: what it lacks is zero.
template <class Struct>
Struct read(const Struct& given) {
  if (given.size < sizeof(given.size) || given.size > 4096)
    throw InputError("size of a struct", "is " + std::to_string(given.size), std::to_string(sizeof(Struct)) + ", its sizeof");
  Struct whole{};
  std::memcpy(&whole, &given, std::min<std::size_t>(given.size, sizeof(Struct)));
  return whole;
}

/// Writes as much of `value` as the caller's version has.
template <class Struct>
void write(Struct value, Struct& out) {
  read(out);
  value.size = out.size;
  std::memcpy(&out, &value, std::min<std::size_t>(out.size, sizeof(Struct)));
}

std::string text_or(const char* text, const std::string& usual) { return text ? text : usual; }
void put(const Vec3& v, double* out) { std::copy_n(v.data(), 3, out); }

ToolSample sample_of(const palpate_pose& pose) {
  const double *x = pose.position_m, *q = pose.orientation;
  ToolSample sample{.position = {x[0], x[1], x[2]}, .opening = pose.opening};
  if (q[0] != 0 || q[1] != 0 || q[2] != 0 || q[3] != 0) sample.orientation = Rotation(q[3], q[0], q[1], q[2]);
  return sample;
}

palpate_tool tool_at(const Vec3& position, const Vec3& force, const Vec3& torque, const Orientation& turn, double opening) {
  palpate_tool tool{};
  put(position, tool.position_m);
  put(force, tool.force_n);
  put(torque, tool.torque_n_m);
  if (turn) std::copy_n(turn->coeffs().data(), 4, tool.orientation);
  tool.opening = opening;
  return tool;
}

palpate_tick tick_of(const Vec3& force, const Vec3& torque, double grip) {
  palpate_tick tick{};
  put(force, tick.force_n);
  put(torque, tick.torque_n_m);
  tick.grip_n_m = grip;
  return tick;
}

template <class Item, class Number>
void give(const std::vector<Item>& items, const Number** data, std::size_t* count) {
  static_assert(sizeof(Item) == 3 * sizeof(Number));
  needed(data, "data") = items.empty() ? nullptr : reinterpret_cast<const Number*>(items.data());
  needed(count, "count") = items.size();
}

Micros time_of(double s, const char* name) {
  if (!(s >= 0 && s <= 1e6)) throw InputError(name, "is " + std::to_string(s), "0 to 1e6 s");
  return from_seconds(s);
}

LocalStep step_options(const palpate_step_options* given) {
  LocalStep options;
  if (!given) return options;
  const palpate_step_options o = read(*given);
  options.patches = o.no_patches == 0;
  options.shape = o.no_shape == 0;
  if (o.scheme) options.scheme = scheme_named(o.scheme);
  if (o.order < 0 || o.order > 2 * kMaxModes)
    throw InputError("order", "is " + std::to_string(o.order), "0 to " + std::to_string(2 * kMaxModes));
  options.order = o.order;
  if (!(o.horizon_s >= 0 && o.horizon_s <= 1)) throw InputError("horizon_s", "is " + std::to_string(o.horizon_s), "0 to 1");
  if (o.horizon_s > 0) options.horizon = from_seconds(o.horizon_s);
  return options;
}

const StationFrame& tool_of(const palpate_body& body, std::uint32_t id) {
  for (const StationFrame& tool : body.frame.stations)
    if (tool.id == id) return tool;
  throw InputError("tool " + std::to_string(id), "was not in the last step", "the number of one that was");
}

std::vector<NamedScene> rooms_of(const palpate_server_options& o) {
  if (o.rooms < 1 || o.rooms > 64) throw InputError("rooms", "is " + std::to_string(o.rooms), "1 to 64");
  std::vector<NamedScene> rooms;
  for (std::size_t k = 0; k < o.rooms; ++k) {
    const std::string where = "scenes[" + std::to_string(k) + "]";
    const Scene& scene = needed((&needed(o.scenes, "scenes"))[k], where.c_str()).scene;
    const std::string name = o.names ? &needed(o.names[k], "a name of names") : scene.name;
    check_room_name(where, name, rooms);
    rooms.push_back({name, scene});
  }
  return rooms;
}

const ViewMoment& moment_of(const palpate_viewer* viewer) {
  const auto& moment = needed(viewer, "viewer").viewer.moment();
  if (!moment) throw InputError("viewer", "has nothing to show", "palpate_viewer_update() with *shown 1 before");
  return *moment;
}

}  // namespace
}  // namespace palpate

using namespace palpate;

const char* palpate_version(void) { return PALPATE_VERSION; }
const char* palpate_error(void) { return error_text().c_str(); }

int palpate_scene_open(const char* file, palpate_scene** scene) {
  return guarded([&] {
    palpate_scene*& made = needed(scene, "scene");
    made = new palpate_scene{open_scene(&needed(file, "file"))};
  });
}
void palpate_scene_free(palpate_scene* scene) { delete scene; }
int palpate_scene_home(const palpate_scene* scene, double home[3]) {
  return guarded([&] { put(home_of(needed(scene, "scene").scene), &needed(home, "home")); });
}
int palpate_scene_vertices(const palpate_scene* scene, const double** positions, size_t* count) {
  return guarded([&] { give(needed(scene, "scene").vertices, positions, count); });
}
int palpate_scene_triangles(const palpate_scene* scene, const uint32_t** triangles, size_t* count) {
  return guarded([&] { give(needed(scene, "scene").scene.body.triangles, triangles, count); });
}

int palpate_body_new(const palpate_scene* scene, palpate_body** body) {
  return guarded([&] {
    palpate_body*& made = needed(body, "body");
    made = new palpate_body{LocalRoom(needed(scene, "scene").scene)};
  });
}
void palpate_body_free(palpate_body* body) { delete body; }
int palpate_body_step(palpate_body* body, const palpate_step_options* options, size_t tools, const uint32_t* ids, size_t ticks,
                      const palpate_pose* poses) {
  return guarded([&] {
    const LocalStep step = step_options(options);
    if (tools > kMaxStations) throw InputError("tools", "is " + std::to_string(tools), "1 to " + std::to_string(kMaxStations));
    if (ticks > kMaxStepTicks) throw InputError("ticks", "is " + std::to_string(ticks), "1 to " + std::to_string(kMaxStepTicks));
    std::vector<ToolSample> samples;
    for (std::size_t k = 0; k < tools * ticks; ++k) samples.push_back(sample_of((&needed(poses, "poses"))[k]));
    const char* const* const held = options ? read(*options).held : nullptr;
    std::vector<LocalTool> paths;
    for (std::size_t k = 0; k < tools; ++k)
      paths.push_back(
          {(&needed(ids, "ids"))[k], std::span(samples).subspan(k * ticks, ticks), held ? text_or(held[k], "") : std::string()});
    palpate_body& moved = needed(body, "body");
    moved.frame = moved.room.step(paths, step);
  });
}
int palpate_body_step_alone(palpate_body* body, size_t ticks) {
  return guarded([&] {
    palpate_body& moved = needed(body, "body");
    moved.frame = moved.room.step_alone(ticks, {});
  });
}
int palpate_body_reset(palpate_body* body) {
  return guarded([&] { needed(body, "body").room.reset(); });
}
int palpate_body_time_us(const palpate_body* body, int64_t* time_us) {
  return guarded([&] { needed(time_us, "time_us") = needed(body, "body").room.now().count(); });
}
int palpate_body_tool(const palpate_body* body, uint32_t id, palpate_tool* tool) {
  return guarded([&] {
    const StationFrame& frame = tool_of(needed(body, "body"), id);
    palpate_tool out = tool_at(frame.tool, frame.force, frame.torque, frame.turn, frame.opening);
    out.id = id;
    out.contact = frame.contact;
    out.has_patch = frame.patch.has_value();
    write(out, needed(tool, "tool"));
  });
}
int palpate_body_shape(const palpate_body* body, const double** positions, size_t* count) {
  return guarded([&] { give(needed(body, "body").frame.positions, positions, count); });
}

int palpate_player_new(const palpate_body* body, uint32_t id, palpate_player** player) {
  return guarded([&] {
    const StationFrame& tool = tool_of(needed(body, "body"), id);
    if (!tool.patch)
      throw InputError("tool " + std::to_string(id), "has no patch", "a step with patches and the tool in reach of the body");
    palpate_player*& made = needed(player, "player");
    made = new palpate_player{PatchPlayer(*tool.patch, tool.terms), {{}, tool.tool, tool.turn, tool.opening}};
  });
}
void palpate_player_free(palpate_player* player) { delete player; }
int palpate_player_tick(palpate_player* player, const palpate_pose* pose, palpate_tick* tick) {
  if (!player || !pose || !tick) return fail(PALPATE_BAD_INPUT, "player, pose or tick: is null; expected a pointer");
  return guarded([&] {
    ToolSample& at = player->at;
    const ToolSample given = sample_of(*pose);
    if (in_world(given.position)) at.position = given.position;
    if (given.orientation && is_unit(*given.orientation)) at.orientation = given.orientation;
    if (std::isfinite(given.opening)) at.opening = std::clamp(given.opening, 0.0, 1.0);
    at.t = player->player.time() + kTick;
    const PlayerOutput now = player->player.advance(at);
    palpate_tick out = tick_of(now.force, now.torque, now.grip);
    out.contact = now.contact;
    out.has_patch = 1;
    out.patch_age_s = seconds(at.t - player->player.patch().stamp);
    write(out, *tick);
  });
}

int palpate_client_join(const palpate_client_options* options, palpate_client** client) {
  return guarded([&] {
    const palpate_client_options o = read(needed(options, "options"));
    const LiveOptions usual;
    palpate_client*& made = needed(client, "client");
    made = new palpate_client{LiveStation({&needed(o.server, "server"), text_or(o.station, usual.station),
                                           text_or(o.room, usual.room), text_or(o.scheme, usual.scheme), text_or(o.key_file, ""),
                                           text_or(o.token_file, ""), o.force_max_n, o.slew_max_n_s, text_or(o.tool, "")})};
  });
}
void palpate_client_free(palpate_client* client) { delete client; }
int palpate_client_wait(palpate_client* client, double most_s) {
  return guarded([&] { needed(client, "client").station.wait(time_of(most_s, "most_s")); });
}
int palpate_client_home(const palpate_client* client, double home[3]) {
  return guarded([&] { put(needed(client, "client").station.status().welcome.home, &needed(home, "home")); });
}
int palpate_client_tick(palpate_client* client, const palpate_pose* pose, palpate_tick* tick) {
  if (!client || !pose || !tick) return fail(PALPATE_BAD_INPUT, "client, pose or tick: is null; expected a pointer");
  return guarded([&] {
    const TickOutput now = client->station.tick(sample_of(*pose));
    palpate_tick out = tick_of(now.force, now.torque, now.grip);
    out.contact = now.contact;
    out.has_patch = now.has_patch;
    out.patch_age_s = seconds(now.patch_age);
    write(out, *tick);
  });
}

int palpate_server_start(const palpate_server_options* options, palpate_server** server) {
  return guarded([&] {
    const palpate_server_options o = read(needed(options, "options"));
    const ThreadedServerOptions usual;
    palpate_server*& made = needed(server, "server");
    const std::vector<NamedScene> rooms = rooms_of(o);
    const ThreadedServerOptions serving{text_or(o.listen, usual.listen), text_or(o.key_file, ""),
                                        o.rate_hz == 0 ? usual.rate_hz : o.rate_hz};
    made = new palpate_server{ThreadedServer(rooms, serving)};
  });
}
void palpate_server_free(palpate_server* server) { delete server; }
int palpate_server_address(const palpate_server* server, const char** address) {
  return guarded([&] { needed(address, "address") = needed(server, "server").server.address().c_str(); });
}
int palpate_server_check(const palpate_server* server) {
  return guarded([&] { needed(server, "server").server.check(); });
}

int palpate_viewer_join(const palpate_viewer_options* options, palpate_viewer** viewer) {
  return guarded([&] {
    const palpate_viewer_options o = read(needed(options, "options"));
    const ViewerOptions usual;
    palpate_viewer*& made = needed(viewer, "viewer");
    made = new palpate_viewer{LiveViewer({&needed(o.server, "server"), text_or(o.station, usual.station),
                                          text_or(o.room, usual.room), text_or(o.key_file, ""), text_or(o.token_file, "")})};
  });
}
void palpate_viewer_free(palpate_viewer* viewer) { delete viewer; }
int palpate_viewer_wait(palpate_viewer* viewer, double most_s) {
  return guarded([&] { needed(viewer, "viewer").viewer.wait(time_of(most_s, "most_s")); });
}
int palpate_viewer_update(palpate_viewer* viewer, double most_s, int32_t* shown) {
  return guarded([&] { needed(shown, "shown") = needed(viewer, "viewer").viewer.update(time_of(most_s, "most_s")); });
}
int palpate_viewer_mesh_version(const palpate_viewer* viewer, uint64_t* version) {
  return guarded([&] { needed(version, "version") = needed(viewer, "viewer").viewer.mesh_version(); });
}
int palpate_viewer_triangles(const palpate_viewer* viewer, const uint32_t** triangles, size_t* count) {
  return guarded([&] { give(needed(viewer, "viewer").viewer.mesh().triangles, triangles, count); });
}
int palpate_viewer_shape(const palpate_viewer* viewer, const float** positions, size_t* count) {
  return guarded([&] { give(moment_of(viewer).shape.positions, positions, count); });
}
int palpate_viewer_tools(const palpate_viewer* viewer, size_t* count) {
  return guarded([&] { needed(count, "count") = moment_of(viewer).tools.size(); });
}
int palpate_viewer_tool(const palpate_viewer* viewer, size_t k, palpate_tool* tool, const char** station) {
  return guarded([&] {
    const auto& tools = moment_of(viewer).tools;
    if (k >= tools.size()) throw InputError("k", "is " + std::to_string(k), "below " + std::to_string(tools.size()));
    palpate_tool out = tool_at(tools[k].position, tools[k].force, tools[k].torque, tools[k].orientation, tools[k].opening);
    out.contact = tools[k].contact;
    write(out, needed(tool, "tool"));
    if (station) *station = tools[k].station.c_str();
  });
}
