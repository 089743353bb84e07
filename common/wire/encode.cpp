#include <cstring>

#include "common/base/plain_text.hpp"
#include "common/patch/packed_numbers.hpp"
#include "common/wire/codec.hpp"
#include "common/wire/patch_wire.hpp"
#include "common/wire/task_wire.hpp"

namespace palpate {
namespace {

using Builder = flatbuffers::FlatBufferBuilder;
using flatbuffers::Offset;

/// Items of a MeshPiece, little-endian.
class LittleBytes {
 public:
  void add(std::uint32_t value) { bytes_[size_++] = static_cast<std::uint8_t>(value & 0xff); }
  void add_24(std::uint32_t value) {
    for (unsigned shift = 0; shift < 24; shift += 8) add(value >> shift);
  }
  const std::uint8_t* data() const { return bytes_.data(); }
  std::size_t size() const { return size_; }

 private:
  std::array<std::uint8_t, std::max(kMaxPieceVertices* kVertexBytes, kMaxPieceTriangles* kTriangleBytes)> bytes_;
  std::size_t size_ = 0;
};

/// One overload per kind of message: writes its table and returns its type.
class BodyWriter {
 public:
  BodyWriter(Builder& builder, pack::Packer& packer) : builder_(builder), packer_(packer) {}
  wire::Payload kind() const { return kind_; }

  Offset<void> operator()(const Hello& m) {
    const auto station = text(m.station, kMaxNameBytes);
    const auto shadow_of = m.shadow_of.empty() ? 0 : text(m.shadow_of, kMaxNameBytes);
    const auto room = m.room.empty() ? 0 : text(m.room, kMaxNameBytes);
    const auto guides = m.guides.empty() ? 0 : text(m.guides, kMaxNameBytes);
    const auto tool = m.tool.empty() ? 0 : text(m.tool, kMaxNameBytes);
    const auto scheme = static_cast<std::uint8_t>(m.scheme.value_or(kWithoutChoice));
    return done(wire::Payload::Hello, wire::CreateHello(builder_, station, static_cast<std::uint8_t>(m.role), scheme, m.order,
                                                        shadow_of, room, m.alike, !m.scheme, guides, tool));
  }
  Offset<void> operator()(const Welcome& m) {
    const auto scene = text(m.scene, kMaxNameBytes);
    const auto station = m.station.empty() ? 0 : text(m.station, kMaxNameBytes);
    const auto home = packer_.point(m.home);
    const auto hash = pack::Packer::wide(m.mesh_hash), scene_hash = pack::Packer::wide(m.scene_hash);
    const auto spheres = spheres_of(m.tool);
    const auto jaws = jaws_of(m.tool);
    return done(wire::Payload::Welcome,
                wire::CreateWelcome(builder_, scene, static_cast<std::uint8_t>(m.contact), packer_.number(m.rate_hz), &home,
                                    m.vertices, m.triangles, &hash, packer_.number(m.deadband), station, m.turns, &scene_hash,
                                    m.jaws, m.parts, packer_.number(m.coupling_n_m), spheres, jaws));
  }
  Offset<void> operator()(const Refuse& m) {
    // Without a text a refusal is no larger than the shortest request that it may have to answer.
    const auto message = m.message.empty() ? 0 : builder_.CreateString(cut_text(m.message, kMaxRefuseBytes));
    return done(wire::Payload::Refuse, wire::CreateRefuse(builder_, static_cast<std::uint8_t>(m.reason), message));
  }
  Offset<void> operator()(const Samples& m) {
    packer_.require(m.samples.size() <= std::size_t{kMaxSamplesPerDatagram});
    packer_.require(m.buttons.size() <= std::size_t{kMaxButtonChanges});
    if (!packer_.ok()) return {};
    const auto buttons = button_changes(m.buttons);
    if (m.samples.empty())
      return done(wire::Payload::Samples, wire::CreateSamples(builder_, nullptr, 0, m.playing, nullptr, buttons));
    const Orientation& last = m.samples.back().orientation;
    const auto turn = last ? packer_.turn(*last) : wire::Turn();
    const auto turns = turns_before_last(m.samples);
    const auto openings = openings_of(m.samples);
    std::array<wire::Sample, kMaxSamplesPerDatagram> packed;
    for (std::size_t i = 0; i < m.samples.size(); ++i)
      packed[i] = {packer_.duration(m.samples[i].t - m.samples[0].t), packer_.point(m.samples[i].position)};
    const auto base = packer_.time(m.samples[0].t);
    const auto samples = builder_.CreateVectorOfStructs(packed.data(), m.samples.size());
    return done(wire::Payload::Samples,
                wire::CreateSamples(builder_, &base, samples, m.playing, last ? &turn : nullptr, buttons, turns, openings));
  }
  Offset<void> operator()(const PatchMessage& m) { return done(wire::Payload::Patch, write_patch(builder_, packer_, m.patch)); }
  Offset<void> operator()(const Beat& m) {
    const auto time = packer_.time(m.body_time);
    return done(wire::Payload::Beat,
                wire::CreateBeat(builder_, &time, m.contact_in_reach, packer_.number(m.rate_hz), packer_.duration(m.behind),
                                 m.link.judged, m.link.lost, m.link.longest_run, packer_.duration(m.link.patch_age), m.ticks_late,
                                 m.renewed_from, m.resets, static_cast<std::uint8_t>(m.in_use.scheme),
                                 static_cast<std::uint8_t>(m.in_use.reason), packer_.duration(m.in_use.cost),
                                 packer_.duration(m.in_use.limit), static_cast<std::uint8_t>(m.guidance.hand),
                                 packer_.duration(m.guidance.reach), packer_.number(m.guidance.force_n), m.notes, m.released));
  }
  Offset<void> operator()(const Guidance& m) {
    const auto partner = text(m.partner, kMaxNameBytes);
    const auto stamp = packer_.time(m.stamp);
    const auto position = packer_.point(m.position);
    return done(wire::Payload::Guidance, wire::CreateGuidance(builder_, partner, m.guides, static_cast<std::uint8_t>(m.hand),
                                                              packer_.duration(m.reach), &stamp, &position));
  }
  Offset<void> operator()(const Reset& m) { return done(wire::Payload::Reset, wire::CreateReset(builder_, m.resets)); }
  Offset<void> operator()(const Note& m) {
    const auto author = m.author.empty() ? 0 : text(m.author, kMaxNameBytes);
    const auto words = m.text.empty() ? 0 : text(m.text, kMaxNoteBytes);
    const auto at = packer_.time(m.at);
    return done(wire::Payload::Note, wire::CreateNote(builder_, m.number, &at, author, words));
  }
  Offset<void> operator()(const RoomList& m) {
    packer_.require(m.names.size() <= kMaxRoomNames);
    if (!packer_.ok()) return {};
    std::array<Offset<flatbuffers::String>, kMaxRoomNames> names;
    for (std::size_t i = 0; i < m.names.size(); ++i) names[i] = text(m.names[i], kMaxNameBytes);
    const auto here = text(m.here, kMaxNameBytes);
    return done(wire::Payload::RoomList,
                wire::CreateRoomList(builder_, here, builder_.CreateVector(names.data(), m.names.size())));
  }
  Offset<void> operator()(const Task& m) { return done(wire::Payload::Task, write_task(builder_, packer_, m)); }
  Offset<void> operator()(const Leave&) { return done(wire::Payload::Leave, wire::CreateLeave(builder_)); }
  Offset<void> operator()(const MeshRequest& m) {
    return done(wire::Payload::MeshRequest, wire::CreateMeshRequest(builder_, m.piece));
  }
  Offset<void> operator()(const MeshPiece& m) {
    packer_.require(m.vertices.size() <= kMaxPieceVertices && m.triangles.size() <= kMaxPieceTriangles);
    packer_.require(m.removed.size() <= kMaxPieceRemoved);
    packer_.require(!m.vertices.empty() + !m.triangles.empty() + !m.removed.empty() <= 1);
    if (!packer_.ok()) return {};
    LittleBytes bytes;
    add_items(m.vertices, m.triangles, bytes);
    for (const auto number : m.removed) {
      packer_.require(number < kMaxMeshVertices);
      bytes.add_24(number);
    }
    const auto items = builder_.CreateVector(bytes.data(), bytes.size());
    const auto hash = pack::Packer::wide(m.mesh_hash);
    const Offset<flatbuffers::Vector<std::uint8_t>> none;
    const bool of_triangles = m.vertices.empty() && m.removed.empty();
    return done(wire::Payload::MeshPiece,
                wire::CreateMeshPiece(builder_, &hash, m.piece, m.pieces, m.first, m.vertices.empty() ? none : items,
                                      of_triangles ? items : none, m.removed.empty() ? none : items));
  }
  Offset<void> operator()(const PartPiece& m) {
    packer_.require(m.vertices.size() <= kMaxPartItems && m.triangles.size() <= kMaxPartItems);
    packer_.require(m.vertices.empty() != m.triangles.empty());
    if (!packer_.ok()) return {};
    LittleBytes bytes;
    add_items(m.vertices, m.triangles, bytes);
    const auto name = text(m.name, kMaxNameBytes);
    const auto items = builder_.CreateVector(bytes.data(), bytes.size());
    const Offset<flatbuffers::Vector<std::uint8_t>> none;
    return done(
        wire::Payload::PartPiece,
        wire::CreatePartPiece(builder_, m.part, name, m.colour, packer_.number(m.friction), m.all_vertices, m.all_triangles,
                              m.piece, m.vertices.empty() ? none : items, m.triangles.empty() ? none : items));
  }
  Offset<void> operator()(const ShapePiece& m) {
    packer_.require(m.blocks.size() <= kMaxPieceBytes);
    if (!packer_.ok()) return {};
    const auto time = packer_.time(m.body_time);
    const auto blocks = builder_.CreateVector(m.blocks.data(), m.blocks.size());
    return done(wire::Payload::ShapePiece, wire::CreateShapePiece(builder_, m.frame, &time, static_cast<std::uint8_t>(m.channel),
                                                                  packer_.number(m.unit), blocks));
  }
  Offset<void> operator()(const ViewState& m) {
    const auto have = pack::Packer::wide(m.have);
    return done(wire::Payload::ViewState, wire::CreateViewState(builder_, m.newest, &have, m.channels, m.kbit_s));
  }
  Offset<void> operator()(const Tools& m) {
    packer_.require(m.tools.size() <= std::size_t{kMaxStations});
    if (!packer_.ok()) return {};
    std::array<Offset<wire::ToolView>, kMaxStations> views;
    for (std::size_t i = 0; i < m.tools.size(); ++i) {
      const ToolView& tool = m.tools[i];
      const wire::ToolState state{packer_.point(tool.position), packer_.vec(tool.force), tool.contact};
      const auto turn = tool.orientation ? packer_.turn(*tool.orientation) : wire::Turn();
      const auto torque = packer_.vec(tool.torque);
      const auto station = text(tool.station, kMaxNameBytes);
      const auto guides = tool.guides.empty() ? 0 : text(tool.guides, kMaxNameBytes);
      views[i] = wire::CreateToolView(builder_, station, &state, tool.orientation ? &turn : nullptr, tool.buttons, guides,
                                      packer_.opening(tool.opening), tool.torque.isZero(0) ? nullptr : &torque);
    }
    const auto tools = builder_.CreateVector(views.data(), m.tools.size());
    const auto time = packer_.time(m.body_time);
    return done(wire::Payload::Tools, wire::CreateTools(builder_, m.frame, &time, m.pieces, tools, m.mesh_pieces));
  }
  Offset<void> operator()(const RoomView& m) {
    packer_.require(m.stations.size() <= std::size_t{kMaxStations});
    if (!packer_.ok()) return {};
    std::array<Offset<wire::StationView>, kMaxStations> views;
    for (std::size_t i = 0; i < m.stations.size(); ++i) {
      const StationView& s = m.stations[i];
      const wire::StationFigures figures(packer_.duration(s.rtt), packer_.duration(s.jitter), packer_.duration(s.patch_age),
                                         s.judged, s.lost, s.ticks_late, s.states, static_cast<std::uint8_t>(s.in_use.scheme));
      const auto tool = held(s.tool);
      views[i] =
          wire::CreateStationView(builder_, text(s.station, kMaxNameBytes), &figures, static_cast<std::uint8_t>(s.in_use.reason),
                                  packer_.duration(s.in_use.cost), packer_.duration(s.in_use.limit), tool);
    }
    const auto stations = builder_.CreateVector(views.data(), m.stations.size());
    const auto spheres = spheres_of(m.tool);
    const auto jaws = jaws_of(m.tool);
    packer_.require(m.bodies.size() <= kMostBodies);
    if (!packer_.ok()) return {};
    std::vector<Offset<wire::BodyName>> bodies;
    for (const BodyName& body : m.bodies)
      bodies.push_back(wire::CreateBodyName(builder_, text(body.name, kMaxNameBytes), body.colour));
    return done(wire::Payload::RoomView,
                wire::CreateRoomView(builder_, m.nodes, packer_.duration(m.frame_time), packer_.number(m.rate_hz),
                                     packer_.number(m.real_time_factor), stations, m.asleep, m.starved, spheres, jaws,
                                     bodies.empty() ? 0 : builder_.CreateVector(bodies)));
  }
  Offset<void> operator()(const PatchTerms& m) {
    packer_.require(check(m) == TermsFault::none);
    if (!packer_.ok()) return {};
    const auto flags =
        static_cast<std::uint8_t>((m.grasp ? kGraspFlag : 0) | (m.repaired ? kRepairedFlag : 0) | (m.solid ? kSolidFlag : 0));
    const float shape = m.solid ? static_cast<float>(m.law.shape) : m.stiffening;
    const auto half = [](double v) { return packed::to_half(static_cast<float>(v)); };
    const Fibres& fibres = m.law.fibres;
    const bool any = fibres.share > 0;
    const auto of_fibres = [&](double v) { return any ? half(v) : std::uint16_t{0}; };
    const wire::TermsHead head(m.patch_seq, half(m.law.exponents[0]), half(m.law.exponents[1]), shape, m.unit[0], m.unit[1],
                               m.unit[2], m.unit[3], m.unit[4], of_fibres(fibres.direction[0]), of_fibres(fibres.direction[1]),
                               of_fibres(fibres.direction[2]), of_fibres(fibres.share), of_fibres(fibres.exponent), m.piece,
                               m.pieces, m.variables, flags, static_cast<std::uint8_t>(m.law.kind), m.elements, m.nodes, m.tool,
                               m.tool_axes, m.vertices, m.triangles);
    const auto numbers = builder_.CreateVector(m.numbers.data(), m.numbers.size());
    return done(wire::Payload::PatchTerms, wire::CreatePatchTerms(builder_, &head, numbers));
  }

 private:
  void add_items(const std::vector<MeshVertex>& vertices, const std::vector<Triangle>& triangles, LittleBytes& bytes) {
    for (const auto& vertex : vertices) {
      for (const double x : vertex.rest) bytes.add_24(packer_.rest(x));
      bytes.add(mark_of(vertex));
    }
    for (const auto& triangle : triangles)
      for (const auto index : triangle) {
        packer_.require(index < kMaxMeshVertices);
        bytes.add_24(index);
      }
  }
  Offset<flatbuffers::Vector<const wire::Sphere*>> spheres_of(const ToolShape& tool) {
    packer_.require(tool.size() <= kMaxToolSpheres);
    if (tool.empty() || !packer_.ok()) return {};
    std::array<wire::Sphere, kMaxToolSpheres> packed;
    for (std::size_t i = 0; i < tool.size(); ++i) packed[i] = packer_.sphere(tool[i]);
    return builder_.CreateVectorOfStructs(packed.data(), tool.size());
  }
  Offset<flatbuffers::Vector<const wire::Jaw*>> jaws_of(const ToolShape& tool) {
    if (!has_jaws(tool) || !packer_.ok()) return {};
    std::array<wire::Jaw, kMaxToolSpheres> packed;
    for (std::size_t i = 0; i < tool.size(); ++i) packed[i] = packer_.jaw(tool[i]);
    return builder_.CreateVectorOfStructs(packed.data(), tool.size());
  }
  Offset<wire::HeldTool> held(const HeldTool& tool) {
    if (tool.name.empty()) return {};
    const auto name = text(tool.name, kMaxNameBytes);
    const auto spheres = spheres_of(tool.shape);
    return wire::CreateHeldTool(builder_, name, spheres, jaws_of(tool.shape));
  }
  /// None if the jaws are closed in all samples.
  Offset<flatbuffers::Vector<std::uint16_t>> openings_of(const std::vector<ToolSample>& samples) {
    if (std::ranges::all_of(samples, [](const ToolSample& sample) { return sample.opening == 0; })) return {};
    packer_.require(samples.size() <= std::size_t{kMaxOpeningsPerDatagram});
    if (!packer_.ok()) return {};
    std::array<std::uint16_t, kMaxOpeningsPerDatagram> packed;
    for (std::size_t i = 0; i < samples.size(); ++i) packed[i] = packer_.opening(samples[i].opening);
    return builder_.CreateVector(packed.data(), samples.size());
  }
  /// None unless every sample has an orientation.
  Offset<flatbuffers::Vector<const wire::Turn*>> turns_before_last(const std::vector<ToolSample>& samples) {
    const auto turns = [](const ToolSample& sample) { return sample.orientation.has_value(); };
    if (samples.size() < 2 || !std::all_of(samples.begin(), samples.end(), turns)) return {};
    packer_.require(samples.size() <= std::size_t{kMaxTurnsPerDatagram});
    if (!packer_.ok()) return {};
    std::array<wire::Turn, kMaxTurnsPerDatagram> packed;
    for (std::size_t i = 0; i + 1 < samples.size(); ++i) packed[i] = packer_.turn(*samples[i].orientation);
    return builder_.CreateVectorOfStructs(packed.data(), samples.size() - 1);
  }
  Offset<flatbuffers::Vector<const wire::Buttons*>> button_changes(const std::vector<ButtonChange>& changes) {
    if (changes.empty()) return {};
    std::array<wire::Buttons, kMaxButtonChanges> packed;
    for (std::size_t i = 0; i < changes.size(); ++i) packed[i] = {packer_.time(changes[i].t), changes[i].pressed};
    return builder_.CreateVectorOfStructs(packed.data(), changes.size());
  }
  Offset<flatbuffers::String> text(const std::string& s, std::size_t most) {
    packer_.require(s.size() <= most);
    return builder_.CreateString(s.data(), std::min(s.size(), most));
  }
  template <class Table>
  Offset<void> done(wire::Payload kind, Offset<Table> table) {
    kind_ = kind;
    return table.Union();
  }

  Builder& builder_;
  pack::Packer& packer_;
  wire::Payload kind_ = wire::Payload::NONE;
};

}  // namespace

std::size_t encode(const Message& message, std::span<std::byte> out) {
  Builder builder(2 * kMaxDatagramBytes);
  pack::Packer packer;
  BodyWriter writer(builder, packer);
  const auto body = std::visit(writer, message.body);
  const wire::Head head(pack::Packer::wide(message.instance), packer.time(message.clock.sent), packer.time(message.clock.echo),
                        packer.duration(message.clock.echo_hold), message.station, message.seq);
  if (!packer.ok()) return 0;
  wire::FinishDatagramBuffer(builder, wire::CreateDatagram(builder, kWireVersion, &head, writer.kind(), body));

  const std::size_t used = builder.GetSize();
  const std::size_t size = std::holds_alternative<Hello>(message.body) ? std::max(used, kHelloBytes) : used;
  if (size > std::min(out.size(), kMaxDatagramBytes)) return 0;
  std::memcpy(out.data(), builder.GetBufferPointer(), used);
  std::memset(out.data() + used, 0, size - used);
  return size;
}

}  // namespace palpate
