// Stream of the moving surface for viewers: from every frame, what a viewer has not seen yet, most visible first, within its
// budget.
//
// Shared by all viewers, once a frame: vertices are rounded to a grid of whole steps (displacement from rest over kShapeStepM)
// and stay on their grid point until they are kHoldSteps away from it, so a resting body does not flicker. A vertex that was sent
// is thus drawn at most  sqrt(3) kHoldSteps kShapeStepM = 0.04 mm  from its position in that frame. Each block of 64 vertices
// (shape_blocks.hpp) keeps the length c_b of its path, the sum over frames of the largest step of one of its vertices, and its
// bytes, packed when the first viewer needs them.
//
// Per viewer: the path c_b at which the block was last sent, and the newest that surely arrived. c_b - sent bounds the error of
// the drawn block, so blocks are sent in the order of that bound, those near a tool first. Datagrams that a viewer's ViewState
// reports as lost, or does not mention for kSilent, are undone: their blocks are sent again, with their then current shape. A
// viewer starts with the body at rest, which it has from the mesh; so a viewer that stalls or joins late needs no special case.
#pragma once

#include <array>
#include <deque>
#include <span>
#include <vector>

#include "common/wire/messages.hpp"
#include "server/core/room_info.hpp"

namespace palpate {

inline constexpr double kShapeStepM = 0x1p-15;  ///< 0.031 mm
inline constexpr double kHoldSteps = 0.75;
inline constexpr int kShapeKbitS = 900;  ///< default budget of a viewer: datagrams with their UDP and IP headers
inline constexpr int kShapeKbitSMost = 8'000, kShapeKbitSRoom = 32'000;  ///< limits per viewer and for all together

/// State of the stream to one viewer. Internal to ShapeStream.
struct ShapeViewer {
  struct Block {
    std::uint64_t sent = 0, has = 0;  ///< path of the version sent last; path of the newest one that surely arrived
    std::uint32_t seq = 0;            ///< seq of the datagram that carried the version sent last
  };
  struct Entry {
    ShapeChannel channel;
    std::uint32_t block;
    std::uint64_t path;
  };
  struct Flight {
    std::uint32_t seq = 0;
    Micros at{};
    std::vector<Entry> entries;
  };
  struct Wanted {
    float priority;
    ShapeChannel channel;
    std::uint32_t block;
  };

  std::array<std::vector<Block>, kShapeChannels> blocks;
  std::deque<Flight> flights;  ///< sent, and neither acknowledged nor known to be lost
  std::vector<Wanted> wanted;  ///< blocks wanted from this frame, most visible last
  std::vector<Entry> filling;  ///< blocks in the piece made last
  std::uint8_t channels = 0;
  double kbit_s = kShapeKbitS, tokens_bytes = 24'000;  ///< a viewer that joins may receive a burst
  std::uint16_t pieces = 0;                            ///< pieces of this frame so far
  bool due = false;                                    ///< true while the newest frame was not completely sent
};

/// Time and values of one frame, by vertex of the body; a channel without values is omitted.
struct ShapeFrame {
  Micros body_time{};
  std::span<const Vec3> positions;
  std::array<std::span<const float>, kShapeChannels> fields{};  ///< [0] is not used
  std::vector<Vec3> tools;                                      ///< tools in contact
};

class ShapeStream {
 public:
  static constexpr Micros kSilent{1'000'000};
  static constexpr std::int32_t kReordered = 8;  ///< datagrams that may overtake one before it counts as lost

  /// `rate_hz` frames share a viewer's budget of a second.
  ShapeStream(const RoomInfo& facts, double rate_hz);

  /// Takes up a mesh with more vertices at the end; `vertex_of`: of the body at each of its vertices.
  void extend(const std::vector<MeshVertex>& vertices, const std::vector<std::uint32_t>& vertex_of);
  void take(const ShapeFrame& frame);
  std::uint32_t frame() const { return frame_; }
  Micros body_time() const { return body_time_; }

  /// Collects what the viewer lacks of the newest frame; `viewers` share the budget of the room.
  void begin(ShapeViewer& viewer, Micros now, int viewers = 1) const;
  /// Fills the next piece; returns false if there is no more, or no budget.
  bool next(ShapeViewer& viewer, ShapePiece& piece);
  /// Records that the piece of the last next() was sent in the datagram `seq`.
  void sent(ShapeViewer& viewer, std::uint32_t seq, Micros now) const;
  /// Accepts the viewer's report of what it has received.
  void heard(ShapeViewer& viewer, const ViewState& state) const;

 private:
  struct Block {
    std::uint64_t path = 0;
    float weight = 1;                 ///< weight of a step here, relative to one elsewhere
    std::vector<std::uint8_t> bytes;  ///< empty: not packed since the last change
  };
  struct Channel {
    double unit = 0;
    std::vector<std::int32_t> numbers;
    std::vector<Block> blocks;
  };

  template <class Value>
  void renew(ShapeChannel which, double hold, const Value& value);
  void take_scalars(ShapeChannel which, std::span<const float> scalars);
  void weigh(const std::vector<Vec3>& tools);
  Vec3 vertex(std::size_t v) const;
  const std::vector<std::uint8_t>& packed(ShapeChannel which, std::uint32_t block);

  std::vector<Vec3> rest_;
  std::vector<std::uint32_t> vertex_of_;
  double reach_m_;  ///< radius around a tool in which blocks count as near
  double rate_hz_;
  std::array<Channel, kShapeChannels> channels_;
  std::uint32_t frame_ = 0;
  Micros body_time_{};
};

}  // namespace palpate
