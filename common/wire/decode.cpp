#include <algorithm>
#include <array>
#include <cstring>

#include "common/patch/packed_numbers.hpp"
#include "common/wire/codec.hpp"
#include "common/wire/patch_wire.hpp"
#include "common/wire/sense.hpp"
#include "common/wire/task_wire.hpp"

namespace palpate {
namespace {

constexpr std::size_t kLeastBytes = 20;  // root offset, identifier, a table with a version

template <class Enum>
bool to_enum(std::uint8_t value, Enum last, Enum& out) {
  if (value > static_cast<std::uint8_t>(last)) return false;
  out = static_cast<Enum>(value);
  return true;
}

std::string_view view_of(const flatbuffers::String* s) { return s ? s->string_view() : std::string_view(); }
Micros time_of(const wire::Wide* w) { return w ? pack::time_from(*w) : Micros{}; }

// One overload per kind of message: reads its table, then returns the fault of the result.

WireFault read(const wire::Hello& table, Hello& m) {
  MessageValidator sense;
  sense.name(view_of(table.station()), 1);
  sense.name(view_of(table.shadow_of()), 0);
  sense.name(view_of(table.room()), 0);
  sense.name(view_of(table.guides()), 0);
  sense.name(view_of(table.tool()), 0);
  sense.that(to_enum(table.role(), Role::viewer, m.role));
  Scheme scheme{};
  sense.that(to_enum(table.scheme(), Scheme::hyper, scheme));
  sense.that(!table.choose() || scheme == kWithoutChoice);
  if (!sense.ok()) return sense.fault();
  m.scheme = table.choose() ? SchemeAsked{} : scheme;
  m.station = view_of(table.station());
  m.shadow_of = view_of(table.shadow_of());
  m.room = view_of(table.room());
  m.guides = view_of(table.guides());
  m.tool = view_of(table.tool());
  m.alike = table.alike();
  m.order = table.order();
  return WireFault::none;
}

WireFault read_tool(const flatbuffers::Vector<const wire::Sphere*>* spheres, const flatbuffers::Vector<const wire::Jaw*>* jaws,
                    ToolShape& tool) {
  if (!spheres) return jaws ? WireFault::malformed : WireFault::none;
  const auto count = spheres->size();
  if (count < 1 || count > kMaxToolSpheres || (jaws && jaws->size() != count)) return WireFault::malformed;
  MessageValidator sense;
  for (flatbuffers::uoffset_t j = 0; j < count; ++j)
    tool.push_back(sense.sphere(*spheres->Get(j), jaws ? jaws->Get(j) : nullptr));
  return sense.fault();
}

WireFault read(const wire::Welcome& table, Welcome& m) {
  if (!table.home() || !table.mesh_hash()) return WireFault::malformed;
  MessageValidator sense;
  sense.name(view_of(table.scene()), 0);
  sense.name(view_of(table.station()), 0);
  sense.that(to_enum(table.contact(), ContactKind::touch, m.contact));
  sense.number(table.rate_hz(), kMinRateHz, kMaxRateHz);
  sense.number(table.deadband(), 0, kMaxDeadband);
  m.home = pack::from(*table.home());
  sense.position(m.home);
  sense.that(table.vertices() <= kMaxMeshVertices && table.triangles() <= 4 * kMaxMeshVertices);
  sense.that(table.parts() <= kMaxParts);
  sense.number(table.coupling(), 0, kMaxPartStiffnessNM);
  if (!sense.ok()) return sense.fault();
  if (const WireFault fault = read_tool(table.tool(), table.tool_jaws(), m.tool); fault != WireFault::none) return fault;
  m.parts = table.parts();
  m.coupling_n_m = table.coupling();
  m.scene = view_of(table.scene());
  m.station = view_of(table.station());
  m.rate_hz = table.rate_hz();
  m.deadband = table.deadband();
  m.vertices = table.vertices();
  m.triangles = table.triangles();
  m.mesh_hash = pack::from(*table.mesh_hash());
  m.turns = table.turns();
  m.jaws = table.jaws();
  m.scene_hash = table.scene_hash() ? pack::from(*table.scene_hash()) : 0;
  return WireFault::none;
}

WireFault read(const wire::Refuse& table, Refuse& m) {
  MessageValidator sense;
  sense.that(to_enum(table.reason(), RefuseReason::shutting_down, m.reason));
  sense.text(view_of(table.message()), 0, kMaxRefuseBytes);
  if (!sense.ok()) return sense.fault();
  m.message = view_of(table.message());
  return WireFault::none;
}

/// Reads orientations, openings and buttons of the tool.
WireFault read_hold(const wire::Samples& table, Samples& m) {
  MessageValidator sense;
  const auto take = [&](const wire::Turn& turn, ToolSample& sample) {
    sense.turn(turn);
    sample.orientation = pack::from(turn);
  };
  if (table.turn() && m.samples.empty()) return WireFault::malformed;
  if (table.turn()) take(*table.turn(), m.samples.back());
  if (const auto* turns = table.turns()) {
    if (!table.turn() || turns->size() + 1 != m.samples.size() || m.samples.size() > std::size_t{kMaxTurnsPerDatagram})
      return WireFault::malformed;
    for (flatbuffers::uoffset_t i = 0; i < turns->size(); ++i) take(*turns->Get(i), m.samples[i]);
  }
  if (const auto* openings = table.openings()) {
    if (openings->size() != m.samples.size() || openings->size() > std::size_t{kMaxOpeningsPerDatagram})
      return WireFault::malformed;
    for (flatbuffers::uoffset_t i = 0; i < openings->size(); ++i) m.samples[i].opening = pack::opening_from(openings->Get(i));
  }
  if (!table.buttons()) return sense.fault();
  if (table.buttons()->size() > std::size_t{kMaxButtonChanges}) return WireFault::malformed;
  for (const wire::Buttons* change : *table.buttons()) {
    const ButtonChange read{pack::time_from(change->at()), change->pressed()};
    sense.time(read.t);
    sense.that(m.buttons.empty() || read.t > m.buttons.back().t);
    m.buttons.push_back(read);
  }
  return sense.fault();
}

WireFault read(const wire::Samples& table, Samples& m) {
  m.playing = table.playing();
  if (!table.samples()) return read_hold(table, m);
  const auto count = table.samples()->size();
  if (!table.base() || count < 1 || count > std::size_t{kMaxSamplesPerDatagram}) return WireFault::malformed;
  MessageValidator sense;
  const Micros base = time_of(table.base());
  sense.time(base);
  if (!sense.ok()) return sense.fault();
  m.samples.reserve(count);
  for (const wire::Sample* sample : *table.samples()) {
    const ToolSample read{base + Micros{sample->offset()}, pack::from(sample->position())};
    sense.that(m.samples.empty() ? sample->offset() == 0 : read.t > m.samples.back().t);
    sense.position(read.position);
    m.samples.push_back(read);
  }
  return sense.ok() ? read_hold(table, m) : sense.fault();
}

WireFault read(const wire::Patch& table, PatchMessage& m) { return read_patch(table, m.patch); }

WireFault read(const wire::Beat& table, Beat& m) {
  m = {time_of(table.body_time()),
       table.contact_in_reach(),
       table.rate_hz(),
       Micros{table.behind()},
       {table.judged(), table.lost(), table.longest_run(), Micros{table.patch_age()}},
       table.ticks_late(),
       table.renewed_from(),
       table.resets(),
       {Scheme::hold, SchemeReason::unknown, Micros{table.patch_cost()}, Micros{table.patch_limit()}},
       {GuidanceHand::ready, Micros{table.reach()}, table.guidance_force()},
       table.notes(),
       table.released()};
  MessageValidator sense;
  sense.that(to_enum(table.scheme(), Scheme::hyper, m.in_use.scheme));
  sense.that(to_enum(table.scheme_reason(), SchemeReason::link_lossy, m.in_use.reason));
  sense.time(m.body_time);
  sense.number(m.rate_hz, 0, kMaxRateHz);
  sense.that(m.link.lost <= m.link.judged && m.link.longest_run <= m.link.lost);
  sense.that(to_enum(table.guidance(), GuidanceHand::refuses, m.guidance.hand));
  sense.number(m.guidance.force_n, 0, kMaxForceN);
  return sense.fault();
}

WireFault read(const wire::Guidance& table, Guidance& m) {
  if (!table.stamp() || !table.position()) return WireFault::malformed;
  MessageValidator sense;
  sense.name(view_of(table.partner()), 1);
  sense.that(to_enum(table.hand(), GuidanceHand::absent, m.hand));
  m.stamp = time_of(table.stamp());
  m.position = pack::from(*table.position());
  sense.time(m.stamp);
  sense.position(m.position);
  if (!sense.ok()) return sense.fault();
  m.partner = view_of(table.partner());
  m.guides = table.guides();
  m.reach = Micros{table.reach()};
  return WireFault::none;
}

WireFault read(const wire::Leave&, Leave&) { return WireFault::none; }

WireFault read(const wire::Reset& table, Reset& m) {
  m.resets = table.resets();
  return WireFault::none;
}

WireFault read(const wire::Note& table, Note& m) {
  if (!table.at()) return WireFault::malformed;
  MessageValidator sense;
  m.number = table.number();
  m.at = time_of(table.at());
  sense.time(m.at);
  sense.name(view_of(table.author()), 0);
  sense.text(view_of(table.text()), 0, kMaxNoteBytes);
  if (!sense.ok()) return sense.fault();
  m.author = view_of(table.author());
  m.text = view_of(table.text());
  return WireFault::none;
}

WireFault read(const wire::RoomList& table, RoomList& m) {
  if (!table.rooms() || table.rooms()->size() > kMaxRoomNames) return WireFault::malformed;
  MessageValidator sense;
  sense.name(view_of(table.here()), 1);
  if (sense.ok()) m.here = view_of(table.here());
  for (const flatbuffers::String* name : *table.rooms()) {
    sense.name(view_of(name), 1);
    if (!sense.ok()) return sense.fault();
    m.names.emplace_back(view_of(name));
  }
  return sense.fault();
}

WireFault read(const wire::Task& table, Task& m) { return read_task(table, m); }

WireFault read(const wire::MeshRequest& table, MeshRequest& m) {
  m.piece = table.piece();
  return m.piece < (kMaxParts + 1) * kPartPieces ? WireFault::none : WireFault::out_of_range;
}

std::uint32_t read_24(const flatbuffers::Vector<std::uint8_t>& bytes, std::size_t at) {
  const auto byte = [&](std::size_t k) { return std::uint32_t{bytes[static_cast<flatbuffers::uoffset_t>(at + k)]}; };
  return byte(0) | byte(1) << 8 | byte(2) << 16;
}

WireFault read_vertices(const flatbuffers::Vector<std::uint8_t>& bytes, std::vector<MeshVertex>& vertices) {
  if (bytes.size() % kVertexBytes != 0 || bytes.size() > kMaxPieceVertices * kVertexBytes) return WireFault::malformed;
  MessageValidator sense;
  vertices.resize(bytes.size() / kVertexBytes);
  for (std::size_t i = 0, at = 0; i < vertices.size(); ++i, at += kVertexBytes) {
    for (int k = 0; k < 3; ++k) {
      const auto bits = read_24(bytes, at + 3 * static_cast<std::size_t>(k));
      vertices[i].rest[k] = (static_cast<std::int32_t>(bits << 8) >> 8) * kRestStepM;
    }
    sense.position(vertices[i].rest);
    sense.that(read_mark(bytes[static_cast<flatbuffers::uoffset_t>(at + 9)], vertices[i]));
  }
  return sense.fault();
}

WireFault read_triangles(const flatbuffers::Vector<std::uint8_t>& bytes, std::vector<Triangle>& triangles) {
  if (bytes.size() % kTriangleBytes != 0 || bytes.size() > kMaxPieceTriangles * kTriangleBytes) return WireFault::malformed;
  triangles.resize(bytes.size() / kTriangleBytes);
  std::size_t at = 0;
  for (auto& triangle : triangles)
    for (auto& index : triangle) {
      index = read_24(bytes, at);
      at += 3;
    }
  return WireFault::none;
}

WireFault read_numbers(const flatbuffers::Vector<std::uint8_t>& bytes, std::vector<std::uint32_t>& numbers) {
  if (bytes.size() % kRemovedBytes != 0 || bytes.size() > kMaxPieceRemoved * kRemovedBytes) return WireFault::malformed;
  for (std::size_t at = 0; at < bytes.size(); at += kRemovedBytes) numbers.push_back(read_24(bytes, at));
  return WireFault::none;
}

WireFault read(const wire::MeshPiece& table, MeshPiece& m) {
  const int kinds = (table.vertices() != nullptr) + (table.triangles() != nullptr) + (table.removed() != nullptr);
  if (!table.mesh_hash() || kinds > 1) return WireFault::malformed;
  MessageValidator sense;
  sense.that(table.piece() < table.pieces() && table.pieces() <= kMaxMeshVertices && table.first() <= 4 * kMaxMeshVertices);
  if (!sense.ok()) return sense.fault();
  m.mesh_hash = pack::from(*table.mesh_hash());
  m.piece = table.piece();
  m.pieces = table.pieces();
  m.first = table.first();
  if (table.vertices()) return read_vertices(*table.vertices(), m.vertices);
  if (table.removed()) return read_numbers(*table.removed(), m.removed);
  return table.triangles() ? read_triangles(*table.triangles(), m.triangles) : WireFault::none;
}

WireFault read(const wire::PartPiece& table, PartPiece& m) {
  if ((table.vertices() != nullptr) == (table.triangles() != nullptr)) return WireFault::malformed;
  const std::size_t bytes =
      table.vertices() ? table.vertices()->size() / kVertexBytes : table.triangles()->size() / kTriangleBytes;
  if (bytes > kMaxPartItems) return WireFault::malformed;
  MessageValidator sense;
  sense.name(view_of(table.name()), 1);
  sense.that(table.part() >= 1 && table.part() <= kMaxParts && table.piece() < kPartPieces);
  sense.that(table.all_vertices() <= kMaxPartVertices && table.all_triangles() <= kMaxPartTriangles &&
             table.colour() <= 0xffffff);
  sense.number(table.friction(), 0, kMaxPartFriction);
  if (!sense.ok()) return sense.fault();
  m.part = table.part();
  m.name = view_of(table.name());
  m.colour = table.colour();
  m.friction = table.friction();
  m.all_vertices = table.all_vertices();
  m.all_triangles = table.all_triangles();
  m.piece = table.piece();
  return table.vertices() ? read_vertices(*table.vertices(), m.vertices) : read_triangles(*table.triangles(), m.triangles);
}

WireFault read(const wire::ShapePiece& table, ShapePiece& m) {
  if (!table.body_time() || !table.blocks() || table.blocks()->size() > kMaxPieceBytes) return WireFault::malformed;
  MessageValidator sense;
  m.frame = table.frame();
  m.body_time = time_of(table.body_time());
  m.unit = table.unit();
  sense.time(m.body_time);
  sense.number(m.unit, 0, kMaxShapeUnit);
  sense.that(to_enum(table.channel(), ShapeChannel::pressure, m.channel));
  if (!sense.ok()) return sense.fault();
  m.blocks.assign(table.blocks()->begin(), table.blocks()->end());
  BlockReader reader(m.blocks, components_of(m.channel));
  for (ShapeBlock block; reader.next(block);) {
  }
  return reader.ok() ? WireFault::none : WireFault::malformed;
}

WireFault read(const wire::ViewState& table, ViewState& m) {
  if (!table.have()) return WireFault::malformed;
  m = {table.newest(), pack::from(*table.have()), table.channels(), table.kbit_s()};
  return m.channels < 1u << kShapeChannels ? WireFault::none : WireFault::out_of_range;
}

WireFault read(const wire::StationFigures& f, StationView& view) {
  MessageValidator sense;
  sense.that(f.lost() <= f.judged() && f.states() <= 2 * kMaxModes && to_enum(f.scheme(), Scheme::hyper, view.in_use.scheme));
  view.rtt = Micros{f.rtt()};
  view.jitter = Micros{f.jitter()};
  view.patch_age = Micros{f.patch_age()};
  view.judged = f.judged();
  view.lost = f.lost();
  view.ticks_late = f.ticks_late();
  view.states = f.states();
  return sense.fault();
}

void read_bodies(const flatbuffers::Vector<flatbuffers::Offset<wire::BodyName>>* table, std::vector<BodyName>& bodies,
                 MessageValidator& sense) {
  if (!table) return;
  sense.that(table->size() <= kMostBodies);
  for (const wire::BodyName* body : *table) {
    sense.name(view_of(body->name()), 1);
    sense.that(body->colour() <= 0xffffff);
    if (!sense.ok()) return;
    bodies.push_back({std::string(view_of(body->name())), body->colour()});
  }
}

WireFault read(const wire::RoomView& table, RoomView& m) {
  if (!table.stations() || table.stations()->size() > std::size_t{kMaxStations}) return WireFault::malformed;
  m.nodes = table.nodes();
  m.frame_time = Micros{table.frame_time()};
  m.rate_hz = table.rate_hz();
  m.real_time_factor = table.real_time_factor();
  m.asleep = table.asleep();
  m.starved = table.starved();
  MessageValidator sense;
  sense.number(m.rate_hz, 0, kMaxRateHz);
  sense.number(m.real_time_factor, 0, 1e9);
  for (const wire::StationView* station : *table.stations()) {
    if (!station->figures()) return WireFault::malformed;
    sense.name(view_of(station->station()), 1);
    if (!sense.ok()) return sense.fault();
    StationView view;
    if (const auto fault = read(*station->figures(), view); fault != WireFault::none) return fault;
    view.station = view_of(station->station());
    sense.that(to_enum(station->scheme_reason(), SchemeReason::link_lossy, view.in_use.reason));
    view.in_use.cost = Micros{station->patch_cost()};
    view.in_use.limit = Micros{station->patch_limit()};
    if (const wire::HeldTool* const held = station->tool()) {
      sense.name(view_of(held->name()), 1);
      if (!sense.ok()) return sense.fault();
      view.tool.name = view_of(held->name());
      if (const auto fault = read_tool(held->spheres(), held->jaws(), view.tool.shape); fault != WireFault::none) return fault;
    }
    m.stations.push_back(std::move(view));
  }
  read_bodies(table.bodies(), m.bodies, sense);
  return sense.ok() ? read_tool(table.tool(), table.jaws(), m.tool) : sense.fault();
}

WireFault read(const wire::Tools& table, Tools& m) {
  if (!table.body_time() || !table.tools()) return WireFault::malformed;
  if (table.tools()->size() > std::size_t{kMaxStations}) return WireFault::malformed;
  MessageValidator sense;
  m.frame = table.frame();
  m.body_time = time_of(table.body_time());
  m.pieces = table.pieces();
  m.mesh_pieces = table.mesh_pieces();
  sense.time(m.body_time);
  sense.that(m.mesh_pieces <= kMaxMeshVertices);
  for (const wire::ToolView* tool : *table.tools()) {
    if (!tool->state()) return WireFault::malformed;
    sense.name(view_of(tool->station()), 1);
    sense.that(tool->state()->contact() <= 1);
    ToolView view{std::string(), pack::from(tool->state()->position()), pack::from(tool->state()->force()),
                  tool->state()->contact() == 1};
    sense.position(view.position);
    sense.force(view.force);
    if (tool->turn()) {
      sense.turn(*tool->turn());
      view.orientation = pack::from(*tool->turn());
    }
    if (tool->torque()) {
      view.torque = pack::from(*tool->torque());
      sense.torque(view.torque);
    }
    view.buttons = tool->buttons();
    view.opening = pack::opening_from(tool->opening());
    sense.name(view_of(tool->guides()), 0);
    if (!sense.ok()) return sense.fault();
    view.station = view_of(tool->station());
    view.guides = view_of(tool->guides());
    m.tools.push_back(std::move(view));
  }
  return sense.fault();
}

WireFault read(const wire::PatchTerms& table, PatchTerms& m) {
  if (!table.head() || !table.numbers()) return WireFault::malformed;
  const wire::TermsHead& head = *table.head();
  if (table.numbers()->size() > std::size_t{kPieceNumbers}) return WireFault::malformed;
  m.patch_seq = head.patch_seq();
  m.unit = {head.unit_scale(), head.unit_2(), head.unit_3(), head.unit_4(), head.unit_q()};
  m.piece = head.piece();
  m.pieces = head.pieces();
  m.variables = head.variables();
  m.vertices = head.vertices();
  m.triangles = head.triangles();
  m.grasp = (head.flags() & kGraspFlag) != 0;
  m.repaired = (head.flags() & kRepairedFlag) != 0;
  m.solid = (head.flags() & kSolidFlag) != 0;
  m.elements = head.elements();
  m.nodes = head.nodes();
  m.tool = head.tool();
  m.tool_axes = head.tool_axes();
  m.law = {};
  m.law.kind = static_cast<SolidLaw>(head.law());  // check() refuses one that is unknown
  m.stiffening = m.solid ? 0 : head.shape();
  if (m.solid) m.law.shape = static_cast<double>(head.shape());
  const auto number = [](std::uint16_t half) { return static_cast<double>(packed::from_half(half)); };
  m.law.exponents = {number(head.exponent_1()), number(head.exponent_2())};
  if (head.fibre_share() != 0)
    m.law.fibres = {{number(head.fibre_x()), number(head.fibre_y()), number(head.fibre_z())},
                    number(head.fibre_share()),
                    number(head.fibre_exponent())};
  m.numbers.assign(table.numbers()->begin(), table.numbers()->end());
  switch (check(m)) {
    case TermsFault::none:
      return WireFault::none;
    case TermsFault::sizes:
      return WireFault::malformed;
    case TermsFault::not_finite:
      return WireFault::not_finite;
    case TermsFault::out_of_range:
      return WireFault::out_of_range;
  }
  return WireFault::malformed;
}

template <class Out, class Table>
WireFault read_into(const Table* table, Message& message) {
  return read(*table, message.body.emplace<Out>());
}

WireFault read_body(const wire::Datagram& datagram, Message& message) {
  if (!datagram.payload()) return WireFault::malformed;
  switch (datagram.payload_type()) {
    case wire::Payload::Hello:
      return read_into<Hello>(datagram.payload_as_Hello(), message);
    case wire::Payload::Welcome:
      return read_into<Welcome>(datagram.payload_as_Welcome(), message);
    case wire::Payload::Refuse:
      return read_into<Refuse>(datagram.payload_as_Refuse(), message);
    case wire::Payload::Samples:
      return read_into<Samples>(datagram.payload_as_Samples(), message);
    case wire::Payload::Patch:
      return read_into<PatchMessage>(datagram.payload_as_Patch(), message);
    case wire::Payload::Beat:
      return read_into<Beat>(datagram.payload_as_Beat(), message);
    case wire::Payload::Leave:
      return read_into<Leave>(datagram.payload_as_Leave(), message);
    case wire::Payload::Reset:
      return read_into<Reset>(datagram.payload_as_Reset(), message);
    case wire::Payload::Guidance:
      return read_into<Guidance>(datagram.payload_as_Guidance(), message);
    case wire::Payload::MeshRequest:
      return read_into<MeshRequest>(datagram.payload_as_MeshRequest(), message);
    case wire::Payload::MeshPiece:
      return read_into<MeshPiece>(datagram.payload_as_MeshPiece(), message);
    case wire::Payload::PartPiece:
      return read_into<PartPiece>(datagram.payload_as_PartPiece(), message);
    case wire::Payload::ShapePiece:
      return read_into<ShapePiece>(datagram.payload_as_ShapePiece(), message);
    case wire::Payload::Tools:
      return read_into<Tools>(datagram.payload_as_Tools(), message);
    case wire::Payload::ViewState:
      return read_into<ViewState>(datagram.payload_as_ViewState(), message);
    case wire::Payload::RoomView:
      return read_into<RoomView>(datagram.payload_as_RoomView(), message);
    case wire::Payload::PatchTerms:
      return read_into<PatchTerms>(datagram.payload_as_PatchTerms(), message);
    case wire::Payload::Task:
      return read_into<Task>(datagram.payload_as_Task(), message);
    case wire::Payload::Note:
      return read_into<Note>(datagram.payload_as_Note(), message);
    case wire::Payload::RoomList:
      return read_into<RoomList>(datagram.payload_as_RoomList(), message);
    default:
      return WireFault::malformed;
  }
}

WireFault read_head(const wire::Head& head, Message& message) {
  message.instance = pack::from(head.instance());
  message.station = head.station();
  message.seq = head.seq();
  message.clock = {pack::time_from(head.sent()), pack::time_from(head.echo()), Micros{head.echo_hold()}};
  MessageValidator sense;
  sense.time(message.clock.sent);
  sense.time(message.clock.echo);
  return sense.fault();
}

}  // namespace

const char* describe(WireFault fault) {
  static constexpr std::array<const char*, kWireFaults> kText{
      "none",         "too short",           "too long",     "not a Palpate datagram", "another protocol version", "malformed",
      "out of range", "not a finite number", "patch refused"};
  const auto i = static_cast<std::size_t>(fault);
  return i < kText.size() ? kText[i] : "unknown";
}

WireFault decode(std::span<const std::byte> bytes, Message& message) {
  if (bytes.size() < kLeastBytes) return WireFault::too_short;
  if (bytes.size() > kMaxDatagramBytes) return WireFault::too_long;
  alignas(8) std::array<std::uint8_t, kMaxDatagramBytes> buffer;  // FlatBuffers reads in place and needs alignment
  std::memcpy(buffer.data(), bytes.data(), bytes.size());
  if (!wire::DatagramBufferHasIdentifier(buffer.data())) return WireFault::not_palpate;

  flatbuffers::Verifier outline(buffer.data(), bytes.size());
  if (!outline.VerifyBuffer<wire::AnyVersion>(wire::DatagramIdentifier())) return WireFault::malformed;
  const auto* any = flatbuffers::GetRoot<wire::AnyVersion>(buffer.data());
  message = Message{};
  const WireFault head_fault = any->head() ? read_head(*any->head(), message) : WireFault::malformed;
  if (any->version() != kWireVersion) return WireFault::version;
  if (head_fault != WireFault::none) return head_fault;

  flatbuffers::Verifier verifier(buffer.data(), bytes.size());
  if (!wire::VerifyDatagramBuffer(verifier)) return WireFault::malformed;
  const auto& datagram = *wire::GetDatagram(buffer.data());
  if (datagram.payload_type() == wire::Payload::Hello && bytes.size() < kHelloBytes) return WireFault::too_short;
  return read_body(datagram, message);
}

}  // namespace palpate
