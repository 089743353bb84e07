// Blocks of integers in a ShapePiece: the values of one block of neighbouring vertices in one channel.
//
// Vertices 64 b .. 64 b + 63 are block b (the last one may be short). A number is  low_k + r,  low_k the least of component k in
// the block and r with as many bits as the largest needs, so that a block in which all move alike is small:
//
//     index (24 bits), vertices (8), bits of each component (8 each), low of each component (24 each, signed),
//     then component after component the r's, bit after bit from the lowest, filled up to a byte at the end of each component
//
// Little-endian. A block is self-contained: a lost one affects no other.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace palpate {

/// Quantity of the numbers of a ShapePiece.
enum class ShapeChannel : std::uint8_t {
  position,  ///< three components: displacement from rest [m]
  tension,   ///< the largest force in an element at the vertex [N]
  support,   ///< largest motion of the vertex by the patches in use, relative to that of the most mobile vertex, 0 to 1
  stress,    ///< the largest von Mises stress in a finite element at the vertex [Pa]
  strain,    ///< the largest |principal stretch - 1| in a finite element at the vertex
  pressure   ///< mean of minus a third of the trace of Cauchy's stress there [Pa], 0 where that is negative
};
inline constexpr std::size_t kShapeChannels = 6;
constexpr std::size_t index_of(ShapeChannel channel) { return static_cast<std::size_t>(channel); }
/// Bit of a channel in a set of channels.
constexpr std::uint8_t bit_of(ShapeChannel channel) { return static_cast<std::uint8_t>(1U << index_of(channel)); }
constexpr int components_of(ShapeChannel channel) { return channel == ShapeChannel::position ? 3 : 1; }

inline constexpr std::uint32_t kBlockVertices = 64;
inline constexpr int kMaxBlockBits = 24;
inline constexpr std::int32_t kMaxBlockNumber = (1 << 23) - 1;  ///< numbers lie within +- this
inline constexpr std::size_t kMaxBlockBytes = 4 + 3 * 4 + 3 * kBlockVertices * kMaxBlockBits / 8;

struct ShapeBlock {
  std::uint32_t index = 0, vertices = 0;
  std::array<std::int32_t, 3 * kBlockVertices> numbers{};  ///< vertex after vertex, `components` each
};

/// Appends the block that holds `numbers` (vertex after vertex; 1 to 64 vertices, numbers within +-kMaxBlockNumber).
void append_block(std::uint32_t index, std::span<const std::int32_t> numbers, int components, std::vector<std::uint8_t>& out);

/// Reads block after block from untrusted bytes.
class BlockReader {
 public:
  BlockReader(std::span<const std::uint8_t> bytes, int components) : rest_(bytes), components_(components) {}
  /// Returns false at the end, or for invalid bytes.
  bool next(ShapeBlock& block);
  /// True when all bytes so far were valid blocks.
  bool ok() const { return ok_; }

 private:
  std::span<const std::uint8_t> rest_;
  int components_;
  bool ok_ = true;
};

}  // namespace palpate
