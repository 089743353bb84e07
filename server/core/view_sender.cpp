#include "server/core/view_sender.hpp"

#include <algorithm>
#include <utility>

#include "common/wire/codec.hpp"
#include "server/core/mesh_pieces.hpp"
#include "server/core/patch_sender.hpp"

namespace palpate {
namespace {

constexpr std::size_t kMostNamedBytes = 900;  // bytes for names and states in a datagram; a larger room shows its first stations

}  // namespace

void ViewSender::take(const FrameResult& result, Stations& stations, const BodyNow& body, Micros now) {
  body_ = body;
  for (auto& [id, station] : stations) {
    if (!station.views() || now < station.next_report) continue;
    station.next_report = now + kLinkReportEvery;
    station.outbox.room = true;
    station.outbox.beat = beat_for(stations, station, body);
    if (now < station.next_task) continue;
    station.next_task = now + kTaskEvery;
    station.outbox.task = facts_.task.has_value();
    station.outbox.rooms = rooms_.size() > 1;
  }
  if (result.positions.empty()) return;
  if (mesh_.take(result.surface)) shapes_.extend(mesh_.mesh().vertices, mesh_.vertex_of());
  ShapeFrame frame{body.time, result.positions, {}, {}};
  std::copy(result.fields.begin(), result.fields.end(), frame.fields.begin());
  for (const StationFrame& station : result.stations)
    if (station.contact) frame.tools.push_back(station.tool);
  shapes_.take(frame);
  const auto viewers = std::count_if(stations.begin(), stations.end(), [](const auto& entry) { return entry.second.views(); });
  for (auto& [id, station] : stations)
    if (station.views()) shapes_.begin(station.shape, now, static_cast<int>(viewers));
}

bool ViewSender::asked(Station& viewer, const MeshRequest& request) const {
  const std::uint32_t part = request.piece / kPartPieces;
  if (part > facts_.parts.size() || (part == 0 && !viewer.views())) return false;
  if (request.piece % kPartPieces >= (part == 0 ? mesh_.pieces() : part_pieces(facts_.parts[part - 1]))) return false;
  auto& pieces = viewer.outbox.mesh_pieces;
  if (pieces.size() < kMostMeshPieces && std::find(pieces.begin(), pieces.end(), request.piece) == pieces.end())
    pieces.push_back(request.piece);
  return true;
}

std::size_t ViewSender::emit(const Stations& stations, Station& viewer, std::span<std::byte> out, Micros now) {
  auto& box = viewer.outbox;
  if (viewer.shape.due)
    if (const auto size = emit_shape(stations, viewer, out, now)) return size;
  if (std::exchange(box.room, false))
    if (const auto size = encode_for(viewer, room_view(stations), out, now)) return size;
  if (std::exchange(box.task, false))
    if (const auto size = encode_for(viewer, *facts_.task, out, now)) return size;
  if (std::exchange(box.rooms, false))
    if (const auto size = encode_for(viewer, rooms_for(viewer), out, now)) return size;
  if (box.mesh_pieces.empty() || !may_have_mesh(viewer, now)) return 0;
  const auto piece = box.mesh_pieces.front();
  box.mesh_pieces.pop_front();
  const std::uint32_t part = piece / kPartPieces;
  const auto size =
      part > 0 ? encode_for(viewer, part_piece(facts_.parts[part - 1], part, piece % kPartPieces), out, now)
               : encode_for(viewer, piece < mesh_.scene_pieces() ? mesh_piece(facts_, piece) : mesh_.change(piece), out, now);
  *box.mesh_bytes -= static_cast<double>(size);
  return size;
}

/// Allows the whole mesh at once, and as much again for lost datagrams; further pieces at the viewer's rate.
bool ViewSender::may_have_mesh(Station& viewer, Micros now) const {
  std::uint32_t pieces = mesh_pieces(facts_.mesh);
  for (const PartMesh& part : facts_.parts) pieces += part_pieces(part);
  const double most = 2.0 * pieces * kMaxDatagramBytes;
  auto& left = viewer.outbox.mesh_bytes;
  const double more = left ? viewer.shape.kbit_s * 125 * seconds(now - std::exchange(viewer.outbox.mesh_bytes_at, now)) : 0;
  if (!left) viewer.outbox.mesh_bytes_at = now;
  left = std::min(most, left.value_or(most) + more);
  return *left > 0;
}

/// Emits the pieces of the newest frame, then the tools with the number of pieces.
std::size_t ViewSender::emit_shape(const Stations& stations, Station& viewer, std::span<std::byte> out, Micros now) {
  ShapePiece piece;
  while (shapes_.next(viewer.shape, piece)) {
    const auto size = encode_for(viewer, std::move(piece), out, now);
    if (size == 0) continue;
    shapes_.sent(viewer.shape, viewer.seq_out - 1, now);
    return size;
  }
  viewer.shape.due = false;
  return encode_for(viewer, tools(stations, viewer), out, now);
}

Tools ViewSender::tools(const Stations& stations, const Station& viewer) const {
  Tools list{shapes_.frame(), shapes_.body_time(), viewer.shape.pieces, {}, mesh_.pieces()};
  std::size_t bytes = 0;
  for (const auto& [id, station] : stations) {
    if (!station.pushes() || !station.has_shown) continue;
    const auto guided = station.guidance.held ? stations.find(station.guidance.partner) : stations.end();
    const std::string guides = guided != stations.end() ? guided->second.hello.station : std::string();
    bytes += station.hello.station.size() + guides.size() + 92;
    if (bytes > kMostNamedBytes) break;
    list.tools.push_back(station.shown);
    list.tools.back().guides = guides;
  }
  return list;
}

RoomList ViewSender::rooms_for(const Station& viewer) const {
  const std::vector<std::string>& may = viewer.hello.may_join;
  RoomList rooms{room_, {}};
  std::size_t bytes = room_.size();
  for (const std::string& name : rooms_) {
    if (!may.empty() && std::find(may.begin(), may.end(), name) == may.end()) continue;
    bytes += name.size() + 12;
    if (bytes > kMostNamedBytes || rooms.names.size() == kMaxRoomNames) break;
    rooms.names.push_back(name);
  }
  return rooms;
}

RoomView ViewSender::room_view(const Stations& stations) const {
  const FrameMeter::Figures& lately = body_.lately;
  RoomView view{facts_.nodes,
                lately.took_mean,
                std::min<double>(lately.frames, kMaxRateHz),
                lately.real_time_factor,
                {},
                body_.asleep,
                starved_,
                facts_.tool,
                facts_.bodies};
  std::size_t bytes = 8 * facts_.tool.size();
  for (const BodyName& body : facts_.bodies) bytes += body.name.size() + 20;
  for (const auto& [id, station] : stations) {
    if (station.views()) continue;
    bytes += station.hello.station.size() + 64;
    const HeldTool& tool = station.tool_held;
    if (!tool.name.empty()) bytes += tool.name.size() + 36 + (has_jaws(tool.shape) ? 14 : 8) * tool.shape.size();
    if (bytes > kMostNamedBytes) break;
    LinkReport link;
    station.loss.fill(link);
    const RttStats rtt = station.clock.rtt();
    view.stations.push_back({station.hello.station, rtt.mean, rtt.jitter, station.link.patch_age, link.judged, link.lost,
                             station.link.ticks_late, station.states, station.in_use, tool});
  }
  return view;
}

}  // namespace palpate
