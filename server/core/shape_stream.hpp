// The moving surface for viewers: of every frame what each of them has not seen yet, most visible first, within its budget.
//
// Shared by all viewers, once a frame: vertices are put on a grid of whole steps, displacement from rest over kShapeStepM, and
// stay on their grid point until they are kHoldSteps away from it (what rests does not flicker). So a vertex that was sent is
// drawn at most  sqrt(3) kHoldSteps kShapeStepM = 0.04 mm  from where the body had it in that frame. Each block of 64 vertices
// (shape_blocks.hpp) keeps the path c_b that it went, the sum over frames of the largest step of one of its vertices, and its
// bytes, packed when the first viewer needs them.
//
// For each viewer: the path c_b that it was sent, and that it surely has. c_b - sent bounds how wrong it draws the block, so
// blocks go out in the order of that bound, those near a tool first. Datagrams that a viewer's ViewState says it did not get, or
// that it says nothing of for kSilent, are taken back: what they held is sent again, as it is by then. A viewer starts with the
// body at rest, which it has from the mesh; one that stalls or joins late is thus nothing special.
#pragma once

#include <array>
#include <deque>
#include <span>
#include <vector>

#include "common/wire/messages.hpp"
#include "server/core/room_facts.hpp"

namespace palpate {

inline constexpr double kShapeStepM = 0x1p-15;  ///< 0.031 mm
inline constexpr double kHoldSteps = 0.75;
inline constexpr int kShapeKbitS = 900;  ///< budget of a viewer that names none: datagrams with their UDP and IP heads
inline constexpr int kShapeKbitSMost = 8'000, kShapeKbitSRoom = 32'000;  ///< whatever a viewer asks for; all viewers together

/// What one viewer was sent.
struct ShapeViewer {
  struct Block {
    std::uint64_t sent = 0, has = 0;  ///< path of the version sent last; of the newest one that surely came
    std::uint32_t seq = 0;            ///< of the datagram that carried the version sent last
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
  std::deque<Flight> flights;  ///< sent, and neither known to have come nor to be lost
  std::vector<Wanted> wanted;  ///< of this frame, most visible last
  std::vector<Entry> filling;  ///< what the piece made last holds
  std::uint8_t channels = 0;
  double kbit_s = kShapeKbitS, tokens_bytes = 24'000;  ///< a viewer that joins may have a burst
  std::uint16_t pieces = 0;                            ///< of this frame so far
  bool due = false;                                    ///< the newest frame was not told yet, or not all of it
};

/// Moment and values of one frame, by node of the body; a channel without values is left out.
struct ShapeFrame {
  Micros body_time{};
  std::span<const Vec3> positions;
  std::array<std::span<const float>, kShapeChannels> fields{};  ///< [0] is not used
  std::vector<Vec3> tools;                                      ///< in contact
};

class ShapeStream {
 public:
  static constexpr Micros kSilent{1'000'000};
  static constexpr std::int32_t kReordered = 8;  ///< datagrams that may overtake one which is not lost

  /// `rate_hz` frames share a viewer's budget of a second.
  ShapeStream(const RoomFacts& facts, double rate_hz);

  void take(const ShapeFrame& frame);
  std::uint32_t frame() const { return frame_; }
  Micros body_time() const { return body_time_; }

  /// Looks for what the viewer lacks of the newest frame; `viewers` share what a room may send.
  void begin(ShapeViewer& viewer, Micros now, int viewers = 1) const;
  /// The next piece of it; false when there is no more, or no budget.
  bool next(ShapeViewer& viewer, ShapePiece& piece);
  /// The piece of the last next() went out in the datagram `seq`.
  void sent(ShapeViewer& viewer, std::uint32_t seq, Micros now) const;
  /// What the viewer says it has.
  void heard(ShapeViewer& viewer, const ViewState& state) const;

 private:
  struct Block {
    std::uint64_t path = 0;
    float weight = 1;                 ///< of a step here beside one elsewhere
    std::vector<std::uint8_t> bytes;  ///< empty: not packed since it changed
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
  std::vector<std::uint32_t> node_of_;
  double reach_m_;  ///< of what counts as near a tool
  double rate_hz_;
  std::array<Channel, kShapeChannels> channels_;
  std::uint32_t frame_ = 0;
  Micros body_time_{};
};

}  // namespace palpate
