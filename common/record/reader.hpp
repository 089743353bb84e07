// Reads a recording: what it is of, blocks by time, shapes and tools at a time.
//
//     const MappedFile file(path);                          // common/io/mapped_file.hpp
//     const RecordingReader recording(file.bytes(), path);
//     for (std::size_t k = 0; k < recording.blocks().size(); ++k)
//       if (const auto block = recording.read(k)) ...       // nothing: this block is damaged
//
// A recording that was ended well has an index and opens at once. One that was not (a crash, a full disk, still being written),
// or from whose middle bytes are missing, is gone through block by block. Where bytes do not hold the next part is looked for
// whose mark, identifier and checksum do, at any byte, and the reading goes on there; damaged() says what lies between. Bytes are
// trusted for nothing: checksums first, then the FlatBuffers verifier, then ranges. The search checks no more than kMostSearched
// times the size of the file, whatever the file says.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/base/error.hpp"
#include "common/record/layout.hpp"
#include "common/record/recording.hpp"

namespace palpate {

/// Where a block lies, and what time it covers: the earliest and latest `t` in it.
struct BlockPlace {
  std::uint64_t offset = 0;  ///< of its first byte in the file
  Micros first{}, last{};
};

/// Bytes that hold nothing that can be read.
struct DamagedBytes {
  std::uint64_t begin = 0, end = 0;
  std::string why;
};

struct RecordedStation {
  StationId id = 0;
  std::string name;
  RecordedRole role = RecordedRole::hand;
  Scheme scheme = Scheme::port;
};

/// A tool at a time, for a picture.
struct RecordedTool {
  StationId station = 0;
  std::string name;
  Vec3 position = Vec3::Zero(), force = Vec3::Zero();
  bool contact = false;
  Orientation orientation = {};
  std::uint32_t buttons = 0;
};

/// Of a file that was cut within its head, as by a disk that was full, or has nothing but zeros, as after a machine that stopped
/// while it began: nothing was ever in it.
class CutRecording final : public InputError {
 public:
  using InputError::InputError;
};

class RecordingReader {
 public:
  /// `bytes` outlive the reader; `name` stands for the file in errors. Throws InputError when they are no recording, one of
  /// another version, or damaged before the end of the head, CutRecording when they end there.
  RecordingReader(std::span<const std::byte> bytes, const std::string& name);

  const RecordingHead& head() const { return head_; }
  /// Of everything that is there. Both 0 when there is nothing.
  Micros begin() const { return begin_; }
  Micros end() const { return end_; }
  /// Ended well, and gone on from beginning to end as it was written, as far as its index tells: blocks may be damaged (read()).
  bool complete() const { return complete_; }
  /// Why it is not, in words for a person, with the bytes; empty when it is complete.
  const std::string& damage() const { return damage_; }
  /// What was found damaged when the file was opened, ascending. Of a complete recording nothing.
  const std::vector<DamagedBytes>& damaged() const { return damaged_; }
  /// Who joined, in that order, each time anew: a station that came back has another id and the same name.
  const std::vector<RecordedStation>& stations() const { return stations_; }
  /// The name of a station; "station 7" for an id that never joined.
  std::string name_of(StationId id) const;

  const std::vector<BlockPlace>& blocks() const { return blocks_; }
  /// Nothing when the block is damaged.
  std::optional<RecordedBlock> read(std::size_t k) const;
  /// The last block that begins at or before t; the first one for an earlier t. Not for a recording without blocks.
  std::size_t block_at(Micros t) const;

  // For pictures: what was last known at t. They keep the block read last, so going through time in order costs each block once.
  /// Nothing before the first shape.
  std::optional<RecordedShape> shape_at(Micros t);
  /// When the first shape after t was recorded.
  std::optional<Micros> next_shape(Micros t);
  /// Tools of the room at its last frame, or the hand of a station's recording at its last tick.
  std::vector<RecordedTool> tools_at(Micros t);

 private:
  static constexpr Micros kFarthest{10'000'000'000'000'000};

  static constexpr std::size_t kMostSearched = 8;

  bool take_index();
  void scan();
  layout::PartView part_at(std::uint64_t offset);
  std::uint64_t next_part(std::uint64_t from);
  void note_damage(std::uint64_t begin, std::uint64_t end, const char* why);
  void note_joins(const std::vector<RecordedEvent>& events);
  const RecordedBlock* cached(std::size_t k);

  std::span<const std::byte> bytes_;
  RecordingHead head_;
  std::uint64_t first_block_ = 0;
  Micros begin_{}, end_{};
  bool complete_ = false;
  std::string damage_;
  std::vector<DamagedBytes> damaged_;
  std::size_t searched_ = 0;  ///< bytes whose checksum did not hold
  std::vector<BlockPlace> blocks_;
  std::vector<RecordedStation> stations_;
  std::size_t cached_at_ = SIZE_MAX;
  std::optional<RecordedBlock> cached_;
};

/// What of the time of a recording is missing. Of damage before the first block that can be read, and behind the last one where
/// no index tells, nobody knows how long it lasted: it counts as a place of no time.
struct RecordingLoss {
  std::size_t places = 0;  ///< in the file where blocks are damaged or missing, what lies side by side as one
  Micros time{};           ///< in all, from the last moment before each to the first behind it
};
/// Reads every block.
RecordingLoss loss_of(const RecordingReader& recording);

}  // namespace palpate
