#include "common/record/writer.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "common/base/in_quotes.hpp"
#include "common/record/layout.hpp"
#include "common/record/surfaces.hpp"
#include "common/wire/mesh_change.hpp"
#include "common/wire/pack.hpp"
#include "common/wire/task_wire.hpp"
#include "recording_generated.h"

namespace palpate {
namespace {

constexpr int kSteps = 65535;
constexpr std::size_t kMostJoins = 4096;  // limit in the index; the blocks have all

/// Converts a position; a number that cannot be encoded counts as 0.
wire::Point point_of(const Vec3& position, bool* broken = nullptr) {
  pack::Packer packer;
  const wire::Point point = packer.point(position);
  if (packer.ok()) return point;
  if (broken) *broken = true;
  return {};
}
wire::Vec vec_of(const Vec3& force, bool* broken = nullptr) {
  pack::Packer packer;
  const wire::Vec vec = packer.vec(force);
  if (packer.ok()) return vec;
  if (broken) *broken = true;
  return {};
}

template <class Whole>
Whole clamped(std::int64_t value) {
  return static_cast<Whole>(
      std::clamp<std::int64_t>(value, std::numeric_limits<Whole>::min(), std::numeric_limits<Whole>::max()));
}
std::uint32_t micros_of(Micros t) { return clamped<std::uint32_t>(t.count()); }

std::unique_ptr<record::SurfaceT> table_of(const RecordedSurface& surface) {
  auto table = std::make_unique<record::SurfaceT>();
  table->body_vertices = surface.body_vertices;
  table->body_nodes = surface.body_nodes;
  table->mesh_hash = surface.mesh_hash;
  table->nodes = surface.nodes;
  for (const Vec3& x : surface.rest) table->rest.push_back(point_of(x));
  for (const Triangle& triangle : surface.triangles)
    table->triangles.insert(table->triangles.end(), triangle.begin(), triangle.end());
  table->marks = surface.marks;
  return table;
}

std::unique_ptr<record::RigidPartT> table_of(const PartMesh& part) {
  auto table = std::make_unique<record::RigidPartT>();
  table->name = made_plain(part.name);
  table->colour = part.colour;
  table->friction = static_cast<float>(part.friction);
  for (const MeshVertex& vertex : part.mesh.vertices) table->vertices.push_back(point_of(vertex.rest));
  for (const Triangle& triangle : part.mesh.triangles)
    table->triangles.insert(table->triangles.end(), triangle.begin(), triangle.end());
  return table;
}

std::unique_ptr<wire::TaskT> table_of(const Task& task) {
  flatbuffers::FlatBufferBuilder builder;
  pack::Packer packer;
  const auto written = write_task(builder, packer, task);
  if (!packer.ok()) return nullptr;
  builder.Finish(written);
  return std::unique_ptr<wire::TaskT>(flatbuffers::GetRoot<wire::Task>(builder.GetBufferPointer())->UnPack());
}

void add_shape_of(const ToolShape& tool, std::vector<wire::Sphere>& spheres, std::vector<wire::Jaw>& jaws) {
  pack::Packer packer;
  for (const ToolSphere& sphere : tool) spheres.push_back(packer.sphere(sphere));
  if (has_jaws(tool))
    for (const ToolSphere& sphere : tool) jaws.push_back(packer.jaw(sphere));
}

record::HeadT table_of(const RecordingHead& head) {
  record::HeadT table;
  table.kind = static_cast<std::uint8_t>(head.kind);
  table.program = made_plain(head.program);
  table.name = made_plain(head.name);
  table.unix_time = head.unix_time.count();
  table.clock_time = head.clock_time.count();
  table.rate_hz = head.rate_hz;
  table.shapes_hz = head.shapes_hz;
  table.scene = head.scene;
  table.scene_file = made_plain(head.scene_file);
  table.surface = table_of(head.surface);
  if (head.task) table.task = table_of(*head.task);
  add_shape_of(head.tool, table.tool, table.jaws);
  for (const PartMesh& part : head.parts) table.parts.push_back(table_of(part));
  for (const BodyName& body : head.bodies) {
    table.bodies.push_back(std::make_unique<wire::BodyNameT>());
    table.bodies.back()->name = made_plain(body.name);
    table.bodies.back()->colour = body.colour;
  }
  return table;
}

std::unique_ptr<record::EventT> table_of(const RecordedEvent& event, std::int32_t at) {
  auto table = std::make_unique<record::EventT>();
  table->at = at;
  table->kind = static_cast<std::uint8_t>(event.kind);
  table->station = event.station;
  table->role = static_cast<std::uint8_t>(event.role);
  table->scheme = static_cast<std::uint8_t>(event.scheme);
  table->name = event.name;
  table->text = event.text;
  if (!event.tool.name.empty()) {
    table->tool = std::make_unique<wire::HeldToolT>();
    table->tool->name = event.tool.name;
    add_shape_of(event.tool.shape, table->tool->spheres, table->tool->jaws);
  }
  return table;
}

std::unique_ptr<record::ShapeT> shape_of(const std::vector<std::uint32_t>& nodes, const std::vector<Vec3>& positions) {
  Vec3 low = positions[nodes.front()], high = low;
  for (const std::uint32_t node : nodes) {
    low = low.cwiseMin(positions[node]);
    high = high.cwiseMax(positions[node]);
  }
  auto table = std::make_unique<record::ShapeT>();
  table->low = std::make_unique<wire::Point>(point_of(low));
  table->high = std::make_unique<wire::Point>(point_of(high));
  const Vec3 corner = pack::from(*table->low), extent = pack::from(*table->high) - corner;
  table->positions.reserve(3 * nodes.size());
  for (const std::uint32_t node : nodes)
    for (int k = 0; k < 3; ++k) {
      const double share = extent[k] > 0 ? std::clamp((positions[node][k] - corner[k]) / extent[k], 0.0, 1.0) : 0;
      table->positions.push_back(static_cast<std::uint16_t>(std::lround(share * kSteps)));
    }
  return table;
}

std::unique_ptr<record::MeshChangeT> table_of(const MeshPiece& change, std::uint32_t number, bool whole) {
  auto table = std::make_unique<record::MeshChangeT>();
  table->number = number;
  table->whole = whole;
  for (const MeshVertex& vertex : change.vertices) {
    table->rest.push_back(point_of(vertex.rest));
    table->marks.push_back(mark_of(vertex));
  }
  table->removed = change.removed;
  for (const Triangle& triangle : change.triangles)
    table->triangles.insert(table->triangles.end(), triangle.begin(), triangle.end());
  return table;
}

void append(const Vec3& x, std::vector<double>& to) { to.insert(to.end(), x.begin(), x.end()); }

/// `before`: the same cut as it was stated last; null: it begins.
std::unique_ptr<record::CutT> table_of(const RecordedCut& cut, const RecordedCut* before) {
  auto table = std::make_unique<record::CutT>();
  table->number = cut.number;
  table->parts = cut.parts;
  if (before && before->direction == cut.direction && before->depth_m == cut.depth_m) {
    const auto parts = std::ranges::mismatch(before->path, cut.path);
    table->kept = static_cast<std::uint32_t>(parts.in2 - cut.path.begin());
  } else {
    append(cut.direction, table->direction);
    table->depth = cut.depth_m;
  }
  for (std::size_t k = table->kept; k < cut.path.size(); ++k) append(cut.path[k], table->path);
  return table;
}

std::unique_ptr<record::NeedleT> table_of(const NeedleInBody& needle) {
  auto table = std::make_unique<record::NeedleT>();
  for (const Vec3& x : needle.rest) append(x, table->path);
  if (!needle.edge.isZero(0)) append(needle.edge, table->edge);
  table->depth = needle.tip.depth_m;
  table->front = needle.tip.front_m;
  table->layer = static_cast<std::uint32_t>(needle.tip.layer);
  table->length = needle.layers.length_m;
  for (const NeedleLayer& layer : needle.layers.all())
    table->layers.insert(table->layers.end(), {layer.begins_m, layer.puncture_n, layer.cutting_n, layer.friction_n_m});
  return table;
}

std::unique_ptr<record::HoldT> table_of(const RecordedHold& hold, bool& broken) {
  auto table = std::make_unique<record::HoldT>();
  pack::Packer packer;
  table->station = hold.station;
  table->tool = std::make_unique<wire::Point>(point_of(hold.tool, &broken));
  table->turn = std::make_unique<wire::Turn>(packer.turn(hold.orientation));
  table->opening = packer.opening(hold.opening);
  if (hold.needle) table->needle = table_of(*hold.needle);
  table->held = hold.held;
  broken = broken || !packer.ok();
  return table;
}

std::unique_ptr<record::ThreadT> table_of(const RecordedThread& thread) {
  auto table = std::make_unique<record::ThreadT>();
  table->suture = thread.suture;
  table->flags = static_cast<std::uint8_t>((thread.first_tied ? 1 : 0) | (thread.last_tied ? 2 : 0) | (thread.has_end ? 0 : 4));
  table->lengths = thread.length_m;
  for (const RecordedThread::Bite& bite : thread.bites) {
    auto& to = table->bites.emplace_back(std::make_unique<record::BiteT>());
    to->number = bite.number;
    to->cell = bite.cell;
    append(bite.at, to->at);
  }
  return table;
}

std::size_t bytes_of(const record::MeshChangeT& t) {
  return t.rest.size() * sizeof(wire::Point) + t.marks.size() + (t.removed.size() + t.triangles.size()) * sizeof(std::uint32_t);
}

bool same(const record::ShapeT& a, const record::ShapeT& b) {
  return a.mesh == b.mesh && pack::from(*a.low) == pack::from(*b.low) && pack::from(*a.high) == pack::from(*b.high) &&
         a.positions == b.positions;
}

}  // namespace

struct RecordingWriter::State {
  std::vector<std::byte> waiting;  ///< bytes not taken yet
  std::size_t taken = 0;
  std::vector<std::uint32_t> nodes;
  BodyMesh first_mesh, mesh;  ///< surface of the head; now
  std::uint32_t mesh_number = 0;
  Micros mesh_stated{};  ///< as a whole
  record::BlockT block;
  record::IndexT index;
  bool empty = true, opened = false;
  Micros base{}, first{}, last{}, opened_at{};
  std::size_t gathered = 0;                    ///< approximate number of bytes in the block
  const record::ShapeT* last_shape = nullptr;  ///< last shape of the block
  std::map<StationId, record::Turn> turned;    ///< last one of each station that is present
  std::map<StationId, std::uint32_t> pressed;

  std::size_t size() const { return taken + waiting.size(); }

  template <class Table>
  void append(const Table& table, record::Content kind,
              flatbuffers::Offset<void> (*create)(flatbuffers::FlatBufferBuilder&, const Table&)) {
    flatbuffers::FlatBufferBuilder builder(gathered + 1024);
    const auto content = create(builder, table);
    builder.FinishSizePrefixed(record::CreatePart(builder, kind, content), record::PartIdentifier());
    layout::append_part(waiting, first, last, std::as_bytes(std::span(builder.GetBufferPointer(), builder.GetSize())));
  }

  /// Returns microseconds of t after the block's base.
  std::int32_t since_base(Micros t) {
    first = std::min(first, t);
    last = std::max(last, t);
    return clamped<std::int32_t>((t - base).count());
  }

  /// The same for the next item, of about that many bytes, which may begin a new block.
  std::int32_t at(Micros t, std::size_t bytes) {
    constexpr Micros kFar{1'000'000'000};
    if (!empty && (std::chrono::abs(t - base) > kFar || gathered >= kBlockBytes)) close();
    if (empty) open(t);
    gathered += bytes;
    return since_base(t);
  }

  void open(Micros t) {
    base = first = last = t;
    empty = false;
    for (const auto& [station, held] : turned) block.turns.emplace_back(0, station, held.turn(), held.opening());
    for (const auto& [station, buttons] : pressed)
      if (buttons != 0) block.buttons.emplace_back(0, station, buttons);
    if (mesh_number > 0 && t - mesh_stated >= kMeshEvery) {
      mesh_stated = t;
      block.mesh_changes.push_back(table_of(change_of(first_mesh, mesh), mesh_number, true));
      gathered += bytes_of(*block.mesh_changes.back());
    }
  }

  void close() {
    if (empty) return;
    block.base = base.count();
    index.entries.emplace_back(size(), first.count(), last.count());
    append<record::BlockT>(block, record::Content::Block, [](flatbuffers::FlatBufferBuilder& b, const record::BlockT& t) {
      return record::CreateBlock(b, &t).Union();
    });
    block = record::BlockT{};
    last_shape = nullptr;
    gathered = 0;
    empty = true;
    opened = false;
  }
};

RecordingWriter::RecordingWriter(const RecordingHead& head) : state_(std::make_unique<State>()) {
  state_->nodes = head.surface.nodes;
  state_->first_mesh = state_->mesh = in_order(mesh_of(head.surface));
  layout::append_preamble(state_->waiting);
  state_->append<record::HeadT>(
      table_of(head), record::Content::Head,
      [](flatbuffers::FlatBufferBuilder& b, const record::HeadT& t) { return record::CreateHead(b, &t).Union(); });
}
RecordingWriter::~RecordingWriter() = default;

void RecordingWriter::add(const RecordedPath& path) {
  if (path.samples.empty()) return;
  auto table = std::make_unique<record::PathT>();
  table->station = path.station;
  state_->at(path.samples.front().t, path.samples.size() * sizeof(record::Sample));
  for (const ToolSample& sample : path.samples)
    table->samples.emplace_back(state_->since_base(sample.t), point_of(sample.position));
  state_->block.paths.push_back(std::move(table));
}

void RecordingWriter::add(const RecordedFrame& f) {
  const std::int32_t at = state_->at(f.t, sizeof(record::Frame));
  state_->block.frames.emplace_back(at, micros_of(f.took), micros_of(f.behind), f.skipped,
                                    clamped<std::uint32_t>(f.newton_iterations), clamped<std::uint16_t>(f.steps),
                                    clamped<std::uint16_t>(f.cut_steps), f.failed ? 1u : 0u);
}

void RecordingWriter::add(const RecordedTouch& t) {
  const std::int32_t at = state_->at(t.t, sizeof(record::Touch));
  const auto flags = static_cast<std::uint8_t>((t.contact ? 1 : 0) | (t.has_patch ? 2 : 0));
  state_->block.touches.emplace_back(at, t.station, point_of(t.tool), vec_of(t.force), vec_of(t.torque), micros_of(t.horizon),
                                     t.bytes, clamped<std::uint16_t>(t.states), static_cast<std::uint8_t>(t.scheme), flags);
}

void RecordingWriter::add_shape(Micros t, const std::vector<Vec3>& positions) {
  const auto finite = [](const Vec3& x) { return x.allFinite(); };
  if (state_->nodes.empty() || !std::all_of(positions.begin(), positions.end(), finite)) return;
  auto table = shape_of(state_->nodes, positions);
  if (state_->last_shape && same(*table, *state_->last_shape)) return;
  table->mesh = state_->mesh_number;
  table->at = state_->at(t, 6 * state_->nodes.size());
  state_->last_shape = table.get();
  state_->block.shapes.push_back(std::move(table));
}

void RecordingWriter::add_mesh(Micros t, const BodyMesh& mesh, const std::vector<std::uint32_t>& vertex_of) {
  const MeshPiece change = change_of(state_->mesh, mesh);
  apply(change, state_->mesh);
  state_->mesh = in_order(std::move(state_->mesh));
  state_->nodes.insert(state_->nodes.end(), vertex_of.begin() + std::ssize(state_->nodes), vertex_of.end());
  if (state_->mesh_number++ == 0) state_->mesh_stated = t;
  auto table = table_of(change, state_->mesh_number, false);
  table->at = state_->at(t, bytes_of(*table));
  state_->block.mesh_changes.push_back(std::move(table));
}

void RecordingWriter::add(const RecordedEvent& event) {
  const std::int32_t at = state_->at(event.t, event.name.size() + event.text.size() + 64);
  state_->block.events.push_back(table_of(event, at));
  const bool gone = event.kind == RecordedEventKind::left || event.kind == RecordedEventKind::silent;
  if (gone && event.station != 0) {
    state_->turned.erase(event.station);
    state_->pressed.erase(event.station);
  }
  if (event.kind != RecordedEventKind::joined || state_->index.joins.size() >= kMostJoins) return;
  state_->index.joins.push_back(table_of(event, 0));
}

void RecordingWriter::add(const RecordedNote& note) {
  auto table = std::make_unique<record::NoteT>();
  table->at = state_->at(note.t, note.author.size() + note.text.size() + 64);
  table->station = note.station;
  table->about = note.about.count();
  table->author = note.author;
  table->text = note.text;
  state_->block.notes.push_back(std::move(table));
}

void RecordingWriter::add(const RecordedLink& l) {
  const std::int32_t at = state_->at(l.t, sizeof(record::Link));
  state_->block.links.emplace_back(l.offset.count(), l.received, l.lost, at, l.station, micros_of(l.rtt), micros_of(l.rtt_min),
                                   micros_of(l.jitter), micros_of(l.patch_age));
}

void RecordingWriter::add(const RecordedTick& t) {
  const bool has_torque = !t.model_torque.isZero(0) || !t.torque.isZero(0);
  const std::int32_t at = state_->at(t.t, sizeof(record::Tick) + (has_torque ? sizeof(record::TickTorque) : 0));
  bool broken = t.broken;
  const auto position = point_of(t.position, &broken);
  const auto model = vec_of(t.model_force, &broken), force = vec_of(t.force, &broken);
  if (has_torque) {
    const auto model_torque = vec_of(t.model_torque, &broken), torque = vec_of(t.torque, &broken);
    state_->block.torques.emplace_back(at, model_torque, torque);
  }
  const std::uint32_t flags = (t.has_patch ? 1u : 0u) | (t.contact ? 2u : 0u) | (broken ? 4u : 0u);
  state_->block.ticks.emplace_back(at, position, model, force, clamped<std::int32_t>(t.patch_age.count()), flags);
}

void RecordingWriter::add(const RecordedHandOver& h) {
  const std::int32_t at = state_->at(h.t, sizeof(record::HandOver));
  state_->block.hand_overs.emplace_back(h.stamp.count(), at, pack::Packer().number(h.step_n));
}

void RecordingWriter::add(const RecordedTurn& t) {
  pack::Packer packer;
  const wire::Turn turn = packer.turn(t.orientation);
  const std::uint16_t opening = packer.opening(t.opening);
  if (!packer.ok()) return;
  const std::int32_t at = state_->at(t.t, sizeof(record::Turn));
  state_->turned[t.station] = state_->block.turns.emplace_back(at, t.station, turn, opening);
}

void RecordingWriter::add(const RecordedButtons& b) {
  const std::int32_t at = state_->at(b.t, sizeof(record::Buttons));
  state_->block.buttons.emplace_back(at, b.station, b.pressed);
  state_->pressed[b.station] = b.pressed;
}

void RecordingWriter::add(const RecordedGuidance& g) {
  pack::Packer packer;
  const float guide = packer.number(g.guide_force_n), guided = packer.number(g.guided_force_n);
  if (!packer.ok()) return;
  const std::int32_t at = state_->at(g.t, sizeof(record::Guidance));
  state_->block.guidances.emplace_back(at, g.guide, g.guided, guide, guided);
}

void RecordingWriter::add(const RecordedPacket& packet) {
  auto table = std::make_unique<record::PacketT>();
  table->at = state_->at(packet.t, packet.bytes.size());
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(packet.bytes.data());
  table->bytes.assign(bytes, bytes + packet.bytes.size());
  state_->block.packets.push_back(std::move(table));
}

void RecordingWriter::add(const RecordedCheckpoint& c) {
  bool broken = false;
  auto table = std::make_unique<record::CheckpointT>();
  for (const Vec3& x : c.positions) table->positions.push_back(point_of(x, &broken));
  for (const Vec3& v : c.velocities) table->velocities.push_back(vec_of(v, &broken));
  for (const RecordedHold& hold : c.holds) table->holds.push_back(table_of(hold, broken));
  std::map<std::uint32_t, const RecordedCut*> stated;
  for (const RecordedCut& cut : c.cuts) {
    const RecordedCut*& before = stated[cut.number];
    table->cuts.push_back(table_of(cut, before));
    before = &cut;
  }
  for (const RecordedThread& thread : c.threads) table->threads.push_back(table_of(thread));
  broken = broken || !c.relaxed.allFinite();
  for (Eigen::Index e = 0; e < c.relaxed.cols() && !broken; ++e) {
    table->relaxed_steps.push_back(pack::short_step(c.relaxed.col(e).cwiseAbs().maxCoeff()));
    for (const float number : c.relaxed.col(e)) table->relaxed.push_back(pack::to_short(number, table->relaxed_steps.back()));
  }
  if (broken) return;
  std::size_t bytes_of_lists = 0;
  for (const auto& cut : table->cuts) bytes_of_lists += sizeof(double) * (cut->path.size() + cut->direction.size() + 4);
  for (const auto& thread : table->threads) bytes_of_lists += sizeof(double) * (5 * thread->bites.size() + 4);
  table->at = state_->at(c.t, bytes_of_lists + c.positions.size() * (sizeof(wire::Point) + sizeof(wire::Vec)) +
                                  table->relaxed.size() * sizeof(std::int16_t) + table->relaxed_steps.size() * sizeof(float));
  state_->block.checkpoints.push_back(std::move(table));
}

void RecordingWriter::tick(Micros now) {
  if (state_->empty) return;
  if (!std::exchange(state_->opened, true)) state_->opened_at = now;
  if (now - state_->opened_at >= kBlock) state_->close();
}

void RecordingWriter::finish() {
  state_->close();
  const std::uint64_t offset = state_->size();
  state_->append<record::IndexT>(
      state_->index, record::Content::Index,
      [](flatbuffers::FlatBufferBuilder& b, const record::IndexT& t) { return record::CreateIndex(b, &t).Union(); });
  layout::append_trailer(state_->waiting, offset);
}

std::vector<std::byte> RecordingWriter::take() {
  state_->taken += state_->waiting.size();
  return std::exchange(state_->waiting, {});
}

std::size_t RecordingWriter::bytes() const { return state_->size(); }

RecordedSurface recorded_surface(const std::vector<Vec3>& rest, const std::vector<Triangle>& triangles, std::uint64_t mesh_hash) {
  RecordedSurface surface;
  surface.body_vertices = surface.body_nodes = static_cast<std::uint32_t>(rest.size());
  surface.mesh_hash = mesh_hash;
  std::vector<std::uint32_t> place(rest.size(), triangles.empty() ? 1 : 0);
  for (const Triangle& triangle : triangles)
    for (const std::uint32_t vertex : triangle) place[vertex] = 1;
  for (std::uint32_t vertex = 0; vertex < place.size(); ++vertex) {
    if (place[vertex] == 0) continue;
    place[vertex] = static_cast<std::uint32_t>(surface.nodes.size());
    surface.nodes.push_back(vertex);
    surface.rest.push_back(rest[vertex]);
  }
  surface.marks.assign(surface.nodes.size(), 0);
  for (const Triangle& t : triangles) surface.triangles.push_back({place[t[0]], place[t[1]], place[t[2]]});
  return surface;
}

}  // namespace palpate
