#include "common/record/block_decode.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "common/wire/sense.hpp"
#include "common/wire/task_wire.hpp"
#include "recording_generated.h"

namespace palpate {
namespace {

constexpr std::size_t kMaxText = 1u << 24;
constexpr std::size_t kMostCutPoints = 16;  // of the path of a cut; a blade's has at most kNeedlePoints + 1

constexpr std::size_t kOffsetBytes = 4, kTableBytes = 2 * kOffsetBytes;  // least size: its offset, and that of its layout

/// Limits the decoded size: FlatBuffers allow a thing to be stored once and referenced many times, so that a part of megabytes
/// could decode to gigabytes, although no writer does this. Everything read from a part is counted, and must not exceed the size
/// of the part.
class PartSense : public MessageValidator {
 public:
  explicit PartSense(std::span<const std::byte> part) : left_(part.size()) {}

  /// Returns false, and refuses the part, when this many items of this size exceed the rest.
  bool take(std::size_t count, std::size_t bytes_each) {
    const bool there = ok() && count <= left_ / bytes_each;
    that(there);
    left_ -= there ? count * bytes_each : 0;
    return there;
  }
  template <class Number>
  std::vector<Number> numbers(const flatbuffers::Vector<Number>* vector) {
    if (!vector || !take(vector->size(), sizeof(Number))) return {};
    return {vector->begin(), vector->end()};
  }
  std::string text(const flatbuffers::String* text) {
    return text && take(kOffsetBytes + text->size(), 1) ? text->str() : std::string();
  }
  using MessageValidator::text;

 private:
  std::size_t left_;
};

/// A part, verified. The verifier and the accessors need aligned numbers, so it is copied.
class Verified {
 public:
  explicit Verified(std::span<const std::byte> part) : bytes_(part.begin(), part.end()) {
    const auto* data = reinterpret_cast<const std::uint8_t*>(bytes_.data());
    constexpr unsigned kDepth = 16;
    const auto tables = static_cast<flatbuffers::uoffset_t>(2 + bytes_.size() / kTableBytes);
    flatbuffers::Verifier verifier(data, bytes_.size(), kDepth, tables);
    if (record::VerifySizePrefixedPartBuffer(verifier)) part_ = record::GetSizePrefixedPart(data);
  }
  const record::Part* operator->() const { return part_; }
  explicit operator bool() const { return part_ != nullptr; }

 private:
  std::vector<std::byte> bytes_;
  const record::Part* part_ = nullptr;
};

/// Visits every item of a vector that may be missing: structs lie in it, tables elsewhere.
template <class Item, class Take>
void each(const flatbuffers::Vector<const Item*>* vector, PartSense& sense, Take take) {
  if (!vector || !sense.take(vector->size(), sizeof(Item))) return;
  // The verifier checks only the alignment of the length.
  sense.that(reinterpret_cast<std::uintptr_t>(vector->Data()) % alignof(Item) == 0);
  if (!sense.ok()) return;
  for (const Item* item : *vector) take(*item);
}
template <class Item, class Take>
void each(const flatbuffers::Vector<flatbuffers::Offset<Item>>* vector, PartSense& sense, Take take) {
  if (!vector || !sense.take(vector->size(), kTableBytes)) return;
  for (const Item* item : *vector) take(*item);
}

/// Returns true for UTF-8. JSON has several lines, so line ends are allowed.
bool is_utf8(std::string_view text) {
  while (!text.empty()) {
    const std::size_t length = character_bytes(text);
    if (length == 0) return false;
    text.remove_prefix(length);
  }
  return true;
}

template <class Kind>
Kind kind_of(std::uint8_t value, std::size_t kinds, MessageValidator& sense) {
  sense.that(value < kinds);
  return sense.ok() ? static_cast<Kind>(value) : Kind{};
}

Scheme scheme_of(std::uint8_t value, MessageValidator& sense) { return kind_of<Scheme>(value, kSchemeNames.size(), sense); }

Vec3 position_of(const wire::Point& point, MessageValidator& sense) {
  const Vec3 position = pack::from(point);
  sense.position(position);
  return position;
}

Vec3 finite_of(const wire::Vec& vec, MessageValidator& sense) {
  const Vec3 vector = pack::from(vec);
  sense.that(vector.allFinite(), WireFault::not_finite);
  return vector;
}

Rotation orientation_of(const wire::Turn& turn, MessageValidator& sense) {
  sense.turn(turn);
  return pack::from(turn);
}

Micros time_of(std::int64_t t, MessageValidator& sense) {
  sense.time(Micros{t});
  return sense.ok() ? Micros{t} : Micros{};
}

/// Returns three numbers for each triangle; an incomplete one is a fault.
std::vector<Triangle> triangles_of(const flatbuffers::Vector<std::uint32_t>* table, PartSense& sense) {
  const std::vector<std::uint32_t> corners = sense.numbers(table);
  sense.that(corners.size() % 3 == 0);
  std::vector<Triangle> triangles;
  for (std::size_t i = 0; i + 2 < corners.size(); i += 3) triangles.push_back({corners[i], corners[i + 1], corners[i + 2]});
  return triangles;
}

/// Decodes a surface. A sheet has no triangles, a station's recording no surface at all; FlatBuffers omit empty fields.
bool decode(const record::Surface& table, RecordedSurface& surface, PartSense& sense) {
  surface.body_vertices = table.body_vertices();
  surface.body_nodes = table.body_nodes();
  surface.mesh_hash = table.mesh_hash();
  surface.nodes = sense.numbers(table.nodes());
  surface.marks = sense.numbers(table.marks());
  surface.triangles = triangles_of(table.triangles(), sense);
  each(table.rest(), sense, [&](const wire::Point& rest) { surface.rest.push_back(position_of(rest, sense)); });
  const std::size_t vertices = surface.nodes.size();
  sense.that(surface.rest.size() == vertices);
  for (const std::uint32_t node : surface.nodes) sense.that(node < surface.body_vertices);
  for (const Triangle& triangle : surface.triangles)
    for (const std::uint32_t corner : triangle) sense.that(corner < vertices);
  sense.that(surface.marks.size() == vertices);
  MeshVertex marked;
  for (const std::uint8_t mark : surface.marks) sense.that(read_mark(mark, marked));
  return sense.ok();
}

void decode(const record::RigidPart& table, PartMesh& part, PartSense& sense) {
  part.name = sense.text(table.name());
  sense.text(part.name, 1, kMaxNameBytes);
  part.colour = table.colour();
  part.friction = table.friction();
  sense.that(part.colour <= 0xffffff);
  sense.number(part.friction, 0, kMaxPartFriction);
  each(table.vertices(), sense, [&](const wire::Point& vertex) { part.mesh.vertices.push_back({position_of(vertex, sense)}); });
  part.mesh.triangles = triangles_of(table.triangles(), sense);
  for (const Triangle& triangle : part.mesh.triangles)
    for (const std::uint32_t corner : triangle) sense.that(corner < part.mesh.vertices.size());
}

ToolShape shape_of(const flatbuffers::Vector<const wire::Sphere*>* spheres, const flatbuffers::Vector<const wire::Jaw*>* jaws,
                   PartSense& sense) {
  ToolShape shape;
  if (!spheres) return shape;
  sense.that(spheres->size() <= kMaxToolSpheres && (!jaws || jaws->size() == spheres->size()));
  for (flatbuffers::uoffset_t j = 0; j < spheres->size() && sense.ok(); ++j)
    shape.push_back(sense.sphere(*spheres->Get(j), jaws ? jaws->Get(j) : nullptr));
  return shape;
}

RecordedEvent event_of(const record::Event& table, Micros base, PartSense& sense) {
  RecordedEvent event;
  event.t = base + Micros{table.at()};
  event.kind = kind_of<RecordedEventKind>(table.kind(), kRecordedEventKinds, sense);
  event.station = table.station();
  event.role = kind_of<RecordedRole>(table.role(), 3, sense);
  event.scheme = scheme_of(table.scheme(), sense);
  event.name = sense.text(table.name());
  event.text = sense.text(table.text());
  sense.text(event.name, 0, kMaxNameBytes);
  sense.text(event.text, 0, kMaxText);
  if (const wire::HeldTool* const held = table.tool()) {
    event.tool.name = sense.text(held->name());
    sense.name(event.tool.name, 1);
    event.tool.shape = shape_of(held->spheres(), held->jaws(), sense);
  }
  return event;
}

RecordedNote note_of(const record::Note& table, Micros base, PartSense& sense) {
  RecordedNote note{base + Micros{table.at()}, table.station(), time_of(table.about(), sense), sense.text(table.author()),
                    sense.text(table.text())};
  sense.name(note.author, 0);
  sense.text(note.text, 0, kMaxNoteBytes);
  return note;
}

std::optional<RecordedShape> shape_of(const record::Shape& table, Micros base, std::size_t vertices, PartSense& sense) {
  if (!table.low() || !table.high() || !table.positions()) return std::nullopt;
  const std::size_t numbers = table.positions()->size();
  if (table.mesh() == 0 ? numbers != 3 * vertices : numbers % 3 != 0 || numbers < 3 * vertices) return std::nullopt;
  if (!sense.take(table.positions()->size(), sizeof(std::uint16_t))) return std::nullopt;
  RecordedShape shape{base + Micros{table.at()}, {}, table.mesh()};
  const Vec3 low = position_of(*table.low(), sense), step = (position_of(*table.high(), sense) - low) / 65535;
  sense.that((step.array() >= 0).all());
  shape.positions.resize(numbers / 3);
  flatbuffers::uoffset_t at = 0;
  for (Vec3& x : shape.positions)
    for (int k = 0; k < 3; ++k) x[k] = low[k] + step[k] * table.positions()->Get(at++);
  return shape;
}

RecordedMeshChange mesh_change_of(const record::MeshChange& table, Micros base, PartSense& sense) {
  RecordedMeshChange change{base + Micros{table.at()}, table.number(), table.whole(), {}};
  MeshPiece& piece = change.piece;
  each(table.rest(), sense, [&](const wire::Point& rest) { piece.vertices.push_back({position_of(rest, sense)}); });
  const std::vector<std::uint8_t> marks = sense.numbers(table.marks());
  sense.that(marks.size() == piece.vertices.size());
  for (std::size_t i = 0; sense.ok() && i < marks.size(); ++i) sense.that(read_mark(marks[i], piece.vertices[i]));
  piece.removed = sense.numbers(table.removed());
  piece.triangles = triangles_of(table.triangles(), sense);
  sense.that(change.number > 0);
  return change;
}

RecordedTouch touch_of(const record::Touch& t, Micros base, MessageValidator& sense) {
  return {base + Micros{t.at()},
          t.station(),
          position_of(t.tool(), sense),
          finite_of(t.force(), sense),
          (t.flags() & 1) != 0,
          (t.flags() & 2) != 0,
          scheme_of(t.scheme(), sense),
          t.states(),
          t.bytes(),
          Micros{t.bridge()},
          finite_of(t.torque(), sense)};
}

RecordedTick tick_of(const record::Tick& t, Micros base, MessageValidator& sense) {
  return {base + Micros{t.at()},
          position_of(t.position(), sense),
          finite_of(t.model_force(), sense),
          finite_of(t.force(), sense),
          Micros{t.patch_age()},
          (t.flags() & 1) != 0,
          (t.flags() & 2) != 0,
          (t.flags() & 4) != 0};
}

Eigen::MatrixXf relaxed_of(const record::Checkpoint& table, PartSense& sense) {
  sense.that(!table.relaxed() == !table.relaxed_steps());
  if (!table.relaxed() || !sense.ok()) return {};
  const auto elements = static_cast<Eigen::Index>(table.relaxed_steps()->size());
  const auto numbers = static_cast<Eigen::Index>(table.relaxed()->size());
  sense.that(elements > 0 && numbers % elements == 0);
  if (!sense.ok()) return {};
  Eigen::MatrixXf relaxed(numbers / elements, elements);
  for (Eigen::Index k = 0; k < numbers; ++k)
    relaxed(k % relaxed.rows(), k / relaxed.rows()) = static_cast<float>(table.relaxed()->Get(static_cast<unsigned>(k))) *
                                                      table.relaxed_steps()->Get(static_cast<unsigned>(k / relaxed.rows()));
  sense.that(relaxed.allFinite());
  return relaxed;
}

/// Returns points of the world from three numbers each.
std::vector<Vec3> points_of(const flatbuffers::Vector<double>* table, PartSense& sense) {
  const std::vector<double> numbers = sense.numbers(table);
  sense.that(numbers.size() % 3 == 0);
  std::vector<Vec3> points;
  for (std::size_t i = 0; i + 2 < numbers.size(); i += 3) {
    points.emplace_back(numbers[i], numbers[i + 1], numbers[i + 2]);
    sense.position(points.back());
  }
  return points;
}

NeedleInBody needle_of(const record::Needle& table, PartSense& sense) {
  NeedleInBody needle;
  const std::vector<Vec3> path = points_of(table.path(), sense), edge = points_of(table.edge(), sense);
  const std::vector<double> layers = sense.numbers(table.layers());
  const std::size_t count = layers.size() / 4;
  sense.that(path.size() == needle.rest.size() && edge.size() <= 1 && layers.size() == 4 * count);
  sense.that(table.layer() < count && count <= std::size_t{kMaxNeedleLayers});
  sense.that(table.depth() >= 0 && table.depth() <= table.front() && table.front() <= table.length());
  sense.number(table.length(), kMinNeedleLengthM, kMaxNeedleLengthM);
  for (std::size_t k = 0; k < layers.size(); ++k) sense.number(layers[k], 0, k % 4 == 0 ? table.length() : kMaxForceN);
  if (!sense.ok()) return needle;
  needle.layers.count = static_cast<int>(count);
  needle.layers.length_m = table.length();
  for (std::size_t k = 0; k < count; ++k)
    needle.layers.of[k] = {layers[4 * k], layers[4 * k + 1], layers[4 * k + 2], layers[4 * k + 3]};
  std::copy(path.begin(), path.end(), needle.rest.begin());
  if (!edge.empty()) needle.edge = edge.front();
  needle.tip = {true, table.depth(), table.front(), static_cast<int>(table.layer())};
  return needle;
}

RecordedHold hold_of(const record::Hold& table, PartSense& sense) {
  RecordedHold hold;
  sense.that(table.tool() != nullptr && table.turn() != nullptr);
  if (!sense.ok()) return hold;
  hold = {sense.text(table.station()), position_of(*table.tool(), sense), orientation_of(*table.turn(), sense),
          pack::opening_from(table.opening())};
  sense.text(hold.station, 0, kMaxNameBytes);
  hold.held = sense.text(table.held());
  sense.name(hold.held, 0);
  if (table.needle()) hold.needle = needle_of(*table.needle(), sense);
  return hold;
}

/// Adds a cut to those before it. A path is short, so that a small file does not become large.
void add_cut(const record::Cut& table, std::vector<RecordedCut>& cuts, PartSense& sense) {
  RecordedCut cut{table.number(), table.parts(), {}};
  const auto before = std::find_if(cuts.rbegin(), cuts.rend(), [&](const RecordedCut& c) { return c.number == cut.number; });
  const bool is_known = before != cuts.rend();
  const std::vector<Vec3> direction = points_of(table.direction(), sense);
  sense.that(direction.size() <= 1 && (is_known || direction.size() == 1));
  sense.that(table.kept() <= (is_known ? before->path.size() : 0) && table.kept() <= kMostCutPoints);
  const std::vector<Vec3> path = points_of(table.path(), sense);
  sense.that(path.size() <= kMostCutPoints);
  if (!sense.ok()) return;
  cut.direction = direction.empty() ? before->direction : direction.front();
  cut.depth_m = direction.empty() ? before->depth_m : table.depth();
  sense.number(cut.depth_m, 0, kWorldExtentM);
  if (is_known) cut.path.assign(before->path.begin(), before->path.begin() + table.kept());
  cut.path.insert(cut.path.end(), path.begin(), path.end());
  cuts.push_back(std::move(cut));
}

RecordedThread thread_of(const record::Thread& table, PartSense& sense) {
  RecordedThread thread{table.suture(), (table.flags() & 1) != 0, (table.flags() & 2) != 0, (table.flags() & 4) == 0, {}, {}};
  sense.that(table.flags() < 8);
  thread.length_m = sense.numbers(table.lengths());
  for (const double length_m : thread.length_m) sense.number(length_m, 0, kWorldExtentM);
  each(table.bites(), sense, [&](const record::Bite& bite) {
    const std::vector<Vec3> at = points_of(bite.at(), sense);
    sense.that(at.size() == 1 && thread.bites.size() < RecordedThread::kMostBites);
    if (sense.ok()) thread.bites.push_back({bite.number(), bite.cell(), at.front()});
  });
  sense.that(thread.length_m.size() == thread.bites.size() + 1);
  return thread;
}

RecordedCheckpoint checkpoint_of(const record::Checkpoint& table, Micros base, PartSense& sense) {
  RecordedCheckpoint checkpoint{base + Micros{table.at()}, {}, {}, {}, relaxed_of(table, sense)};
  each(table.positions(), sense, [&](const wire::Point& x) { checkpoint.positions.push_back(position_of(x, sense)); });
  each(table.velocities(), sense, [&](const wire::Vec& v) { checkpoint.velocities.push_back(finite_of(v, sense)); });
  sense.that(checkpoint.positions.size() == checkpoint.velocities.size());
  each(table.holds(), sense, [&](const record::Hold& hold) { checkpoint.holds.push_back(hold_of(hold, sense)); });
  each(table.cuts(), sense, [&](const record::Cut& cut) { add_cut(cut, checkpoint.cuts, sense); });
  each(table.threads(), sense, [&](const record::Thread& thread) { checkpoint.threads.push_back(thread_of(thread, sense)); });
  return checkpoint;
}

/// Decodes the lists of a room's recording.
bool decode_room(const record::Block& table, Micros base, std::size_t vertices, RecordedBlock& block, PartSense& sense) {
  each(table.paths(), sense, [&](const record::Path& path) {
    RecordedPath& ours = block.paths.emplace_back();
    ours.station = path.station();
    each(path.samples(), sense, [&](const record::Sample& s) {
      ours.samples.push_back({base + Micros{s.at()}, position_of(s.position(), sense)});
    });
  });
  each(table.frames(), sense, [&](const record::Frame& f) {
    block.frames.push_back({base + Micros{f.at()}, Micros{f.took()}, Micros{f.behind()}, f.skipped(), f.steps(), f.cut_steps(),
                            static_cast<int>(f.newton() & 0x7fffffff), (f.flags() & 1) != 0});
  });
  each(table.touches(), sense, [&](const record::Touch& t) { block.touches.push_back(touch_of(t, base, sense)); });
  bool whole = true;
  each(table.shapes(), sense, [&](const record::Shape& s) {
    auto shape = shape_of(s, base, vertices, sense);
    whole = whole && shape;
    if (whole) block.shapes.push_back(std::move(*shape));
  });
  each(table.mesh_changes(), sense,
       [&](const record::MeshChange& c) { block.mesh_changes.push_back(mesh_change_of(c, base, sense)); });
  each(table.checkpoints(), sense,
       [&](const record::Checkpoint& c) { block.checkpoints.push_back(checkpoint_of(c, base, sense)); });
  return whole;
}

/// Decodes the lists of a station's recording.
void decode_station(const record::Block& table, Micros base, RecordedBlock& block, PartSense& sense) {
  each(table.ticks(), sense, [&](const record::Tick& t) { block.ticks.push_back(tick_of(t, base, sense)); });
  auto tick = block.ticks.begin();
  each(table.torques(), sense, [&](const record::TickTorque& t) {
    const Micros at = base + Micros{t.at()};
    while (tick != block.ticks.end() && tick->t < at) ++tick;
    sense.that(tick != block.ticks.end() && tick->t == at);
    if (!sense.ok()) return;
    tick->model_torque = finite_of(t.model_torque(), sense);
    tick->torque = finite_of(t.torque(), sense);
  });
  each(table.hand_overs(), sense, [&](const record::HandOver& h) {
    sense.that(std::isfinite(h.step()), WireFault::not_finite);
    block.hand_overs.push_back({base + Micros{h.at()}, time_of(h.stamp(), sense), h.step()});
  });
  each(table.packets(), sense, [&](const record::Packet& p) {
    if (!p.bytes() || !sense.take(p.bytes()->size(), 1)) return;
    sense.that(p.bytes()->size() <= kMaxDatagramBytes);
    const auto bytes = std::as_bytes(std::span(p.bytes()->data(), p.bytes()->size()));
    block.packets.push_back({base + Micros{p.at()}, {bytes.begin(), bytes.end()}});
  });
}

}  // namespace

std::optional<RecordingHead> decode_head(std::span<const std::byte> part) {
  const Verified verified(part);
  const record::Head* table = verified ? verified->content_as_Head() : nullptr;
  if (!table) return std::nullopt;
  PartSense sense(part);
  RecordingHead head;
  head.kind = kind_of<RecordingKind>(table->kind(), 2, sense);
  head.program = sense.text(table->program());
  head.name = sense.text(table->name());
  head.unix_time = time_of(table->unix_time(), sense);
  head.clock_time = time_of(table->clock_time(), sense);
  head.rate_hz = table->rate_hz();
  head.shapes_hz = table->shapes_hz();
  head.scene = sense.text(table->scene());
  head.scene_file = sense.text(table->scene_file());
  for (const std::string& text : {head.program, head.name, head.scene_file}) sense.text(text, 0, kMaxText);
  sense.that(is_utf8(head.scene));
  sense.number(head.rate_hz, 0, kMaxRateHz);
  sense.number(head.shapes_hz, 0, kMaxRateHz);
  if (table->surface() && !decode(*table->surface(), head.surface, sense)) return std::nullopt;
  if (table->task()) sense.that(read_task(*table->task(), head.task.emplace()) == WireFault::none);
  head.tool = shape_of(table->tool(), table->jaws(), sense);
  if (table->parts()) {
    sense.that(table->parts()->size() <= kMaxParts);
    each(table->parts(), sense, [&](const record::RigidPart& one) { decode(one, head.parts.emplace_back(), sense); });
  }
  if (table->bodies()) {
    sense.that(table->bodies()->size() <= kMostBodies);
    each(table->bodies(), sense, [&](const wire::BodyName& one) {
      head.bodies.push_back({sense.text(one.name()), one.colour()});
      sense.text(head.bodies.back().name, 1, kMaxNameBytes);
      sense.that(one.colour() <= 0xffffff);
    });
  }
  return sense.ok() ? std::optional(std::move(head)) : std::nullopt;
}

std::optional<RecordedBlock> decode_block(std::span<const std::byte> part, std::size_t vertices) {
  const Verified verified(part);
  const record::Block* table = verified ? verified->content_as_Block() : nullptr;
  if (!table) return std::nullopt;
  PartSense sense(part);
  const Micros base = time_of(table->base(), sense);
  RecordedBlock block;
  if (!decode_room(*table, base, vertices, block, sense)) return std::nullopt;
  decode_station(*table, base, block, sense);
  each(table->turns(), sense, [&](const record::Turn& t) {
    block.turns.push_back({base + Micros{t.at()}, t.station(), orientation_of(t.turn(), sense), pack::opening_from(t.opening())});
  });
  each(table->buttons(), sense, [&](const record::Buttons& b) {
    block.buttons.push_back({base + Micros{b.at()}, b.station(), b.pressed()});
  });
  each(table->guidances(), sense, [&](const record::Guidance& g) {
    sense.number(g.guide_force(), 0, kMaxForceN);
    sense.number(g.guided_force(), 0, kMaxForceN);
    block.guidances.push_back({base + Micros{g.at()}, g.guide(), g.guided(), g.guide_force(), g.guided_force()});
  });
  each(table->events(), sense, [&](const record::Event& event) { block.events.push_back(event_of(event, base, sense)); });
  each(table->notes(), sense, [&](const record::Note& note) { block.notes.push_back(note_of(note, base, sense)); });
  each(table->links(), sense, [&](const record::Link& l) {
    block.links.push_back({base + Micros{l.at()}, l.station(), Micros{l.rtt()}, Micros{l.rtt_min()}, Micros{l.jitter()},
                           Micros{l.patch_age()}, time_of(l.offset(), sense), l.received(), l.lost()});
  });
  return sense.ok() ? std::optional(std::move(block)) : std::nullopt;
}

std::optional<RecordingIndex> decode_index(std::span<const std::byte> part) {
  const Verified verified(part);
  const record::Index* table = verified ? verified->content_as_Index() : nullptr;
  if (!table) return std::nullopt;
  PartSense sense(part);
  RecordingIndex index;
  each(table->entries(), sense, [&](const record::Entry& e) {
    index.blocks.push_back({e.offset(), time_of(e.first(), sense), time_of(e.last(), sense)});
  });
  each(table->joins(), sense, [&](const record::Event& event) { index.joins.push_back(event_of(event, Micros{}, sense)); });
  return sense.ok() ? std::optional(std::move(index)) : std::nullopt;
}

}  // namespace palpate
