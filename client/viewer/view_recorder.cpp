#include "client/viewer/view_recorder.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

namespace palpate {
namespace {

RecordedSurface surface_of(const ViewCore& core) {
  RecordedSurface surface;
  const BodyMesh& mesh = core.mesh();
  const auto vertices = static_cast<std::uint32_t>(mesh.vertices.size());
  surface.body_vertices = vertices;
  surface.body_nodes = core.room().nodes;
  surface.mesh_hash = core.welcome().mesh_hash;
  for (std::uint32_t v = 0; v < vertices; ++v) {
    surface.nodes.push_back(v);
    surface.rest.push_back(mesh.vertices[v].rest);
    surface.marks.push_back(mark_of(mesh.vertices[v]));
  }
  surface.triangles = mesh.triangles;
  return surface;
}

RecordingHead head_of(const ViewCore& core, const std::string& program, Micros unix_time) {
  RecordingHead head;
  head.kind = RecordingKind::room;
  head.program = program;
  head.name = core.welcome().scene;
  head.unix_time = unix_time;
  head.clock_time = core.playback().shapes().back().body_time;
  head.rate_hz = head.shapes_hz = 1 / seconds(core.playback().period());
  head.surface = surface_of(core);
  if (const Task* task = core.task().task()) head.task = *task;
  head.tool = core.room().tool;
  head.parts = core.parts();
  head.bodies = core.room().bodies;
  return head;
}

const StationView* find(const RoomView& room, const std::string& name) {
  for (const StationView& station : room.stations)
    if (station.station == name) return &station;
  return nullptr;
}

}  // namespace

ViewRecorder::ViewRecorder(const ViewCore& core, const std::string& program, Micros unix_time)
    : mesh_version_(core.mesh_version()),
      mesh_hash_(core.welcome().mesh_hash),
      vertices_(core.mesh().vertices.size()),
      writer_(head_of(core, program, unix_time)) {}

void ViewRecorder::take(const ViewCore& core, Micros now) {
  if (std::exchange(mesh_version_, core.mesh_version()) != core.mesh_version()) {
    vertices_ = core.mesh().vertices.size();
    std::vector<std::uint32_t> same(vertices_);
    std::iota(same.begin(), same.end(), 0U);
    writer_.add_mesh(std::max(shape_until_, core.playback().shapes().front().body_time), core.mesh(), same);
  }
  std::vector<Vec3> positions;
  for (const Shape& shape : core.playback().shapes()) {
    if (shape.body_time <= shape_until_) continue;
    shape_until_ = shape.body_time;
    positions.clear();
    for (const auto& x : shape.positions) positions.push_back(x.cast<double>());
    writer_.add_shape(shape.body_time, positions);
  }
  for (const Tools& tools : core.playback().tools()) {
    if (tools.body_time <= tools_until_) continue;
    tools_until_ = tools.body_time;
    take_tools(tools, core.room());
  }
  if (now >= next_links_) {
    next_links_ = now + kLinksEvery;
    take_links(core.room());
  }
  writer_.tick(now);
}

StationId ViewRecorder::station(const std::string& name, const RoomView& room) {
  const auto [at, fresh] = stations_.try_emplace(name, stations_ever_ + 1);
  if (!fresh) return at->second;
  ++stations_ever_;
  const StationView* known = find(room, name);
  writer_.add(RecordedEvent{tools_until_, RecordedEventKind::joined, at->second, RecordedRole::hand,
                            known != nullptr ? known->in_use.scheme : Scheme::port, name, "",
                            known != nullptr ? known->tool : HeldTool()});
  return at->second;
}

void ViewRecorder::take_tools(const Tools& tools, const RoomView& room) {
  RecordedFrame frame;
  frame.t = tools.body_time;
  frame.took = room.frame_time;
  writer_.add(frame);
  for (const ToolView& tool : tools.tools) {
    RecordedTouch touch;
    touch.t = tools.body_time;
    touch.station = station(tool.station, room);
    touch.tool = tool.position;
    touch.force = tool.force;
    touch.torque = tool.torque;
    touch.contact = tool.contact;
    if (const StationView* known = find(room, tool.station)) {
      touch.has_patch = known->states > 0;
      touch.scheme = known->in_use.scheme;
      touch.states = known->states;
    }
    writer_.add(touch);
    writer_.add(RecordedPath{touch.station, {{tools.body_time, tool.position}}});
    if (tool.orientation || tool.opening != 0)
      writer_.add(
          RecordedTurn{touch.t, touch.station, tool.orientation.value_or(Rotation::Identity()).normalized(), tool.opening});
    if (tool.buttons != std::exchange(buttons_[touch.station], tool.buttons))
      writer_.add(RecordedButtons{touch.t, touch.station, tool.buttons});
  }
  std::erase_if(stations_, [&](const auto& entry) {
    const auto here = [&](const ToolView& tool) { return tool.station == entry.first; };
    if (std::any_of(tools.tools.begin(), tools.tools.end(), here)) return false;
    writer_.add(
        RecordedEvent{tools.body_time, RecordedEventKind::left, entry.second, RecordedRole::hand, Scheme::port, entry.first, ""});
    return true;
  });
}

void ViewRecorder::take_links(const RoomView& room) {
  if (tools_until_ == Micros::min()) return;
  for (const StationView& known : room.stations) {
    const auto at = stations_.find(known.station);
    if (at == stations_.end()) continue;
    RecordedLink link;
    link.t = tools_until_;
    link.station = at->second;
    link.rtt = known.rtt;
    link.jitter = known.jitter;
    link.patch_age = known.patch_age;
    writer_.add(link);
  }
}

}  // namespace palpate
