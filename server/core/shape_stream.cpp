#include "server/core/shape_stream.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "common/wire/codec.hpp"

namespace palpate {
namespace {

constexpr double kHeadBytes = 28 + 140;  // UDP and IP headers; what encode() adds around the blocks of a piece
constexpr double kBurstFrames = 2;       // budget that a viewer may accumulate
constexpr double kNearTool = 64;         // weight near a tool, relative to elsewhere
constexpr double kNearShare = 0.08;      // share of the body's diagonal
constexpr double kScalarSteps = 255, kHoldScalar = 1.5;

bool wants(const ShapeViewer& viewer, ShapeChannel channel) {
  return channel == ShapeChannel::position || (viewer.channels & bit_of(channel)) != 0;
}

void take_back(ShapeViewer& viewer, const ShapeViewer::Flight& flight) {
  for (const auto& entry : flight.entries) {
    auto& block = viewer.blocks[index_of(entry.channel)][entry.block];
    if (block.seq == flight.seq) block.sent = block.has;
  }
}

void confirm(ShapeViewer& viewer, const ShapeViewer::Flight& flight) {
  for (const auto& entry : flight.entries) {
    auto& block = viewer.blocks[index_of(entry.channel)][entry.block];
    block.has = std::max(block.has, entry.path);
  }
}

}  // namespace

ShapeStream::ShapeStream(const RoomInfo& facts, double rate_hz) : vertex_of_(facts.vertex_of), rate_hz_(rate_hz) {
  Vec3 low = Vec3::Constant(1e300), high = -low;
  for (const MeshVertex& vertex : facts.mesh.vertices) {
    rest_.push_back(vertex.rest);
    low = low.cwiseMin(vertex.rest);
    high = high.cwiseMax(vertex.rest);
  }
  reach_m_ = kNearShare * std::max((high - low).norm(), 1e-9);
  const std::size_t blocks = (rest_.size() + kBlockVertices - 1) / kBlockVertices;
  for (std::size_t k = 0; k < kShapeChannels; ++k) {
    channels_[k].numbers.assign(
        rest_.size() * static_cast<std::size_t>(components_of(ShapeChannel{static_cast<std::uint8_t>(k)})), 0);
    channels_[k].blocks.resize(blocks);
    channels_[k].unit = 0x1p-20;  // initial unit of values without a known limit
  }
  channels_[index_of(ShapeChannel::position)].unit = kShapeStepM;
  channels_[index_of(ShapeChannel::support)].unit = 1 / kScalarSteps;
}

void ShapeStream::extend(const std::vector<MeshVertex>& vertices, const std::vector<std::uint32_t>& vertex_of) {
  const std::size_t first = rest_.size() / kBlockVertices;  // block with the first new vertex
  for (std::size_t v = rest_.size(); v < vertices.size(); ++v) rest_.push_back(vertices[v].rest);
  vertex_of_ = vertex_of;
  for (std::size_t k = 0; k < kShapeChannels; ++k) {
    Channel& channel = channels_[k];
    channel.numbers.resize(rest_.size() * static_cast<std::size_t>(components_of(ShapeChannel{static_cast<std::uint8_t>(k)})));
    channel.blocks.resize((rest_.size() + kBlockVertices - 1) / kBlockVertices);
    for (std::size_t b = first; b < channel.blocks.size(); ++b) {
      ++channel.blocks[b].path;  // a viewer does not have its new vertices
      channel.blocks[b].bytes.clear();
    }
  }
}

/// Sets the numbers of a channel to `value(vertex, component)`, in its units, if they differ by more than `hold`.
template <class Value>
void ShapeStream::renew(ShapeChannel which, double hold, const Value& value) {
  Channel& channel = channels_[index_of(which)];
  const int n = components_of(which);
  for (std::size_t b = 0; b < channel.blocks.size(); ++b) {
    std::int32_t largest = 0;
    const std::size_t end = std::min((b + 1) * kBlockVertices, rest_.size());
    for (std::size_t v = b * kBlockVertices; v < end; ++v)
      for (int k = 0; k < n; ++k) {
        std::int32_t& number = channel.numbers[v * static_cast<std::size_t>(n) + static_cast<std::size_t>(k)];
        const double wanted = value(v, k);
        if (!(std::abs(wanted - number) > hold)) continue;  // also skips NaN
        const auto moved =
            static_cast<std::int32_t>(std::lround(std::clamp(wanted, -double{kMaxBlockNumber}, double{kMaxBlockNumber})));
        largest = std::max(largest, std::abs(moved - number));
        number = moved;
      }
    if (largest == 0) continue;
    channel.blocks[b].path += static_cast<std::uint64_t>(largest);
    channel.blocks[b].bytes.clear();
  }
}

void ShapeStream::take(const ShapeFrame& frame) {
  ++frame_;
  body_time_ = frame.body_time;
  renew(ShapeChannel::position, kHoldSteps,
        [&](std::size_t v, int k) { return (frame.positions[vertex_of_[v]][k] - rest_[v][k]) * (1 / kShapeStepM); });
  for (std::size_t k = 1; k < kShapeChannels; ++k) {
    const ShapeChannel which{static_cast<std::uint8_t>(k)};
    if (!frame.fields[index_of(which)].empty()) take_scalars(which, frame.fields[index_of(which)]);
  }
  weigh(frame.tools);
}

/// For values without a known limit, the unit doubles until the largest fits into 8 bits, as a viewer would refuse more.
void ShapeStream::take_scalars(ShapeChannel which, std::span<const float> scalars) {
  Channel& channel = channels_[index_of(which)];
  float largest = 0;
  for (const std::uint32_t vertex : vertex_of_) largest = std::max(largest, scalars[vertex]);
  if (which != ShapeChannel::support && std::isfinite(largest))
    while (largest > kScalarSteps * channel.unit && 2 * channel.unit <= kMaxShapeUnit) channel.unit *= 2;
  renew(which, kHoldScalar,
        [&](std::size_t v, int) { return std::clamp(scalars[vertex_of_[v]] / channel.unit, 0.0, kScalarSteps); });
}

Vec3 ShapeStream::vertex(std::size_t v) const {
  const auto& numbers = channels_[index_of(ShapeChannel::position)].numbers;
  return rest_[v] + kShapeStepM * Vec3(numbers[3 * v], numbers[3 * v + 1], numbers[3 * v + 2]);
}

/// Weights blocks by their vertex nearest to a tool: the blocks that the eye follows come first by a wide margin.
void ShapeStream::weigh(const std::vector<Vec3>& tools) {
  auto& blocks = channels_[index_of(ShapeChannel::position)].blocks;
  for (Block& block : blocks) block.weight = 1;
  for (std::size_t v = 0; v < rest_.size() && !tools.empty(); ++v) {
    const Vec3 x = vertex(v);
    for (const Vec3& tool : tools) {
      const double far = (x - tool).squaredNorm() / (reach_m_ * reach_m_);
      float& weight = blocks[v / kBlockVertices].weight;
      weight = std::max(weight, static_cast<float>(kNearTool / (1 + far * far)));
    }
  }
}

void ShapeStream::begin(ShapeViewer& viewer, Micros now, int viewers) const {
  assert(viewers > 0);
  while (!viewer.flights.empty() && now - viewer.flights.front().at > kSilent) {
    take_back(viewer, viewer.flights.front());
    viewer.flights.pop_front();
  }
  const double frame_bytes = std::min<double>(viewer.kbit_s, kShapeKbitSRoom / viewers) * 125 / rate_hz_;
  const double most = std::max(kBurstFrames * frame_bytes, viewer.tokens_bytes);
  viewer.tokens_bytes = std::min(viewer.tokens_bytes + frame_bytes, most);
  viewer.wanted.clear();
  for (std::size_t k = 0; k < kShapeChannels; ++k) {
    const ShapeChannel which{static_cast<std::uint8_t>(k)};
    if (!wants(viewer, which)) continue;
    viewer.blocks[k].resize(channels_[k].blocks.size());
    for (std::uint32_t b = 0; b < channels_[k].blocks.size(); ++b) {
      const auto behind = channels_[k].blocks[b].path - viewer.blocks[k][b].sent;
      if (behind > 0) viewer.wanted.push_back({static_cast<float>(behind) * channels_[k].blocks[b].weight, which, b});
    }
  }
  std::sort(viewer.wanted.begin(), viewer.wanted.end(), [](const auto& x, const auto& y) {
    if (x.channel != y.channel) return x.channel > y.channel;
    return x.priority != y.priority ? x.priority < y.priority : x.block > y.block;
  });
  viewer.pieces = 0;
  viewer.due = true;
}

const std::vector<std::uint8_t>& ShapeStream::packed(ShapeChannel which, std::uint32_t block) {
  Channel& channel = channels_[index_of(which)];
  auto& bytes = channel.blocks[block].bytes;
  if (!bytes.empty()) return bytes;
  const auto n = static_cast<std::size_t>(components_of(which));
  const std::size_t first = block * kBlockVertices, end = std::min<std::size_t>(first + kBlockVertices, rest_.size());
  append_block(block, std::span(channel.numbers).subspan(n * first, n * (end - first)), components_of(which), bytes);
  return bytes;
}

bool ShapeStream::next(ShapeViewer& viewer, ShapePiece& piece) {
  viewer.filling.clear();
  if (viewer.wanted.empty() || viewer.tokens_bytes <= 0) return false;
  piece.frame = frame_;
  piece.body_time = body_time_;
  piece.channel = viewer.wanted.back().channel;
  piece.unit = channels_[index_of(piece.channel)].unit;
  piece.blocks.clear();
  while (!viewer.wanted.empty() && viewer.wanted.back().channel == piece.channel) {
    const std::uint32_t block = viewer.wanted.back().block;
    const auto& bytes = packed(piece.channel, block);
    if (piece.blocks.size() + bytes.size() > kMaxPieceBytes) break;
    piece.blocks.insert(piece.blocks.end(), bytes.begin(), bytes.end());
    viewer.filling.push_back({piece.channel, block, channels_[index_of(piece.channel)].blocks[block].path});
    viewer.wanted.pop_back();
  }
  viewer.tokens_bytes -= static_cast<double>(piece.blocks.size()) + kHeadBytes;
  ++viewer.pieces;
  return true;
}

void ShapeStream::sent(ShapeViewer& viewer, std::uint32_t seq, Micros now) const {
  for (const auto& entry : viewer.filling) {
    auto& block = viewer.blocks[index_of(entry.channel)][entry.block];
    block.sent = entry.path;
    block.seq = seq;
  }
  viewer.flights.push_back({seq, now, viewer.filling});
}

void ShapeStream::heard(ShapeViewer& viewer, const ViewState& state) const {
  viewer.channels = state.channels;
  viewer.kbit_s = state.kbit_s > 0 ? std::min<int>(state.kbit_s, kShapeKbitSMost) : kShapeKbitS;
  std::erase_if(viewer.flights, [&](const ShapeViewer::Flight& flight) {
    const auto age = static_cast<std::int32_t>(state.newest - flight.seq);
    if (age < 0) return false;
    const bool came = age < 64 && (state.have >> age & 1) != 0;
    if (came) confirm(viewer, flight);
    const bool lost = !came && age >= kReordered;
    if (lost) take_back(viewer, flight);
    return came || lost;
  });
}

}  // namespace palpate
