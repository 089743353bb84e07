#include <catch2/catch.hpp>

#include "common/base/plain_text.hpp"
#include "seeds.hpp"

using namespace palpate;

namespace {

constexpr int kMutations = 150'000;

bool sensible(const Vec3& v, double limit) { return v.allFinite() && v.cwiseAbs().maxCoeff() <= limit; }
bool sensible(const std::string& s) {
  return s.size() <= 200 &&
         std::none_of(s.begin(), s.end(), [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; });
}

/// Returns true if an accepted message keeps the ranges that docs/reference/wire.md promises.
struct Sensible {
  bool operator()(const Hello& m) const {
    return sensible(m.station) && !m.station.empty() && sensible(m.shadow_of) && sensible(m.guides) && sensible(m.tool) &&
           m.scheme <= Scheme::hyper && m.role <= Role::viewer;
  }
  bool operator()(const Welcome& m) const {
    return sensible(m.scene) && sensible(m.home, kWorldExtentM) && m.rate_hz >= kMinRateHz && m.rate_hz <= kMaxRateHz &&
           m.contact <= ContactKind::touch && m.vertices <= kMaxMeshVertices;
  }
  bool operator()(const Refuse& m) const { return sensible(m.message) && m.reason <= RefuseReason::shutting_down; }
  bool operator()(const Samples& m) const {
    for (std::size_t i = 0; i < m.samples.size(); ++i)
      if (!sensible(m.samples[i].position, kWorldExtentM) || (m.samples[i].orientation && !is_unit(*m.samples[i].orientation)) ||
          (i > 0 && m.samples[i].t <= m.samples[i - 1].t))
        return false;
    for (std::size_t i = 1; i < m.buttons.size(); ++i)
      if (m.buttons[i].t <= m.buttons[i - 1].t) return false;
    return m.samples.size() <= std::size_t{kMaxSamplesPerDatagram} && m.buttons.size() <= std::size_t{kMaxButtonChanges};
  }
  bool operator()(const PatchMessage& m) const { return check(m.patch) == PatchFault::none; }
  bool operator()(const Beat& m) const {
    return std::abs(m.body_time.count()) <= 10'000'000'000'000'000 && m.rate_hz >= 0 && m.rate_hz <= kMaxRateHz &&
           m.link.lost <= m.link.judged && m.link.longest_run <= m.link.lost && m.guidance.hand <= GuidanceHand::refuses &&
           m.guidance.force_n >= 0 && m.guidance.force_n <= 1e4;
  }
  bool operator()(const Guidance& m) const {
    return sensible(m.partner) && !m.partner.empty() && m.hand <= GuidanceHand::absent && sensible(m.position, kWorldExtentM);
  }
  bool operator()(const Task& m) const {
    if (m.text.empty() || !sensible(m.text)) return false;
    if (const auto* press = std::get_if<PressTask>(&m.goal))
      return press->min_n >= 0 && press->min_n <= press->max_n && press->max_n <= kMaxTaskForceN && press->time_s > 0;
    if (const auto* find = std::get_if<FindTask>(&m.goal))
      return sensible(find->lump, kWorldExtentM) && sensible(find->above, kWorldExtentM) && find->within_m > 0;
    const auto& line = std::get<TraceTask>(m.goal).line;
    return line.size() >= 2 && line.size() <= kMaxLinePoints && std::all_of(line.begin(), line.end(), [](const LinePoint& p) {
             return sensible(p.at, kWorldExtentM) && std::abs(p.normal.norm() - 1) < 1e-9;
           });
  }
  bool operator()(const Leave&) const { return true; }
  bool operator()(const Reset&) const { return true; }
  bool operator()(const Note& m) const { return sensible(m.author) && m.text.size() <= kMaxNoteBytes && is_plain_text(m.text); }
  bool operator()(const RoomList& m) const {
    return sensible(m.here) && m.names.size() <= kMaxRoomNames &&
           std::all_of(m.names.begin(), m.names.end(), [](const std::string& name) { return !name.empty() && sensible(name); });
  }
  bool operator()(const MeshRequest& m) const { return m.piece / kPartPieces <= kMaxParts; }
  bool operator()(const PartPiece& m) const {
    return m.part >= 1 && m.part <= kMaxParts && sensible(m.name) && !m.name.empty() && m.all_vertices <= kMaxPartVertices &&
           m.all_triangles <= kMaxPartTriangles && m.vertices.size() <= kMaxPartItems && m.triangles.size() <= kMaxPartItems &&
           m.friction >= 0 && m.friction <= kMaxPartFriction &&
           std::all_of(m.vertices.begin(), m.vertices.end(), [](const auto& v) { return sensible(v.rest, kWorldExtentM); });
  }
  bool operator()(const MeshPiece& m) const {
    return m.piece < m.pieces && m.triangles.size() <= kMaxPieceTriangles && m.vertices.size() <= kMaxPieceVertices &&
           m.removed.size() <= kMaxPieceRemoved &&
           std::all_of(m.vertices.begin(), m.vertices.end(), [](const auto& v) { return sensible(v.rest, kWorldExtentM); });
  }
  bool operator()(const ShapePiece& m) const {
    BlockReader reader(m.blocks, components_of(m.channel));
    for (ShapeBlock block; reader.next(block);)
      for (std::size_t i = 0; i < block.vertices * static_cast<std::size_t>(components_of(m.channel)); ++i)
        if (std::abs(block.numbers[i]) > kMaxBlockNumber) return false;
    return reader.ok() && static_cast<std::size_t>(m.channel) < kShapeChannels && m.unit >= 0 && m.unit <= kMaxShapeUnit;
  }
  bool operator()(const ViewState& m) const { return m.channels < 1u << kShapeChannels; }
  bool operator()(const RoomView& m) const {
    return m.rate_hz >= 0 && m.real_time_factor >= 0 && std::all_of(m.stations.begin(), m.stations.end(), [](const auto& s) {
             return sensible(s.station) && sensible(s.tool.name) && s.tool.shape.size() <= kMaxToolSpheres &&
                    s.lost <= s.judged && s.states <= 2 * kMaxModes;
           });
  }
  bool operator()(const PatchTerms& m) const { return check(m) == TermsFault::none; }
  bool operator()(const Tools& m) const {
    return std::all_of(m.tools.begin(), m.tools.end(), [](const ToolView& t) {
      return sensible(t.station) && sensible(t.position, kWorldExtentM) && sensible(t.force, 1e4) &&
             (!t.orientation || is_unit(*t.orientation)) && sensible(t.guides);
    });
  }
};

void mutate(std::vector<std::byte>& bytes, std::mt19937& random) {
  const auto pick = [&](std::size_t n) { return n == 0 ? 0 : random() % n; };
  switch (random() % 10) {
    case 0:
      bytes.resize(pick(bytes.size() + 1));
      return;
    case 1:
      bytes.resize(bytes.size() + pick(300), std::byte{static_cast<unsigned char>(random())});
      return;
    case 2:
      for (std::size_t n = pick(64), at = pick(bytes.size()); n > 0 && at < bytes.size(); --n, ++at) bytes[at] = std::byte{0xff};
      return;
    default:
      for (std::size_t n = 1 + pick(4); n > 0 && !bytes.empty(); --n) {
        auto& byte = bytes[pick(bytes.size())];
        byte = random() % 2 ? byte ^ std::byte{static_cast<unsigned char>(1u << random() % 8)}
                            : std::byte{static_cast<unsigned char>(random())};
      }
  }
}

}  // namespace

TEST_CASE("mutated datagrams never crash the decoder and never bring a value out of range") {
  std::vector<std::vector<std::byte>> seed_bytes;
  for (const Message& message : seeds::every_kind()) seed_bytes.push_back(seeds::bytes_of(message));
  std::mt19937 random(20240607);
  int accepted = 0;
  std::array<int, kWireFaults> faults{};
  Message message;
  for (int i = 0; i < kMutations; ++i) {
    auto bytes = seed_bytes[static_cast<std::size_t>(i) % seed_bytes.size()];
    mutate(bytes, random);
    const WireFault fault = decode(bytes, message);
    ++faults[static_cast<std::size_t>(fault)];
    if (fault != WireFault::none) continue;
    ++accepted;
    if (!std::visit(Sensible{}, message.body)) FAIL("mutation " << i << " was accepted with a value out of range");
    const auto ours = seeds::bytes_of(message);  // empty if the mutated layout held more than ours can
    if (!ours.empty() && decode(ours, message) == WireFault::none && seeds::bytes_of(message) != ours)
      FAIL("mutation " << i << " does not keep its bytes once we encoded it");
  }
  CHECK(accepted > kMutations / 100);
  for (std::size_t f = 0; f < kWireFaults; ++f) {
    INFO(describe(static_cast<WireFault>(f)));
    CHECK(faults[f] > 0);
  }
}
