// Reads a recording: its head, blocks by time, shapes and tools at a time.
//
//     const MappedFile file(path);                          // common/io/mapped_file.hpp
//     const RecordingReader recording(file.bytes(), path);
//     for (std::size_t k = 0; k < recording.blocks().size(); ++k)
//       if (const auto block = recording.read(k)) ...       // nothing: this block is damaged
//
// A recording that was completed has an index and opens at once. One that was not (a crash, a full disk, still being written), or
// with bytes missing in the middle, is scanned block by block. After corrupt bytes the reader searches, at any byte, for the next
// part with a valid mark, identifier and checksum, and continues there; damaged() returns the bytes in between. No byte is
// trusted: checksums first, then the FlatBuffers verifier, then ranges. The search checks no more than kMostSearched times the
// size of the file, whatever the file contains.
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
#include "common/record/surfaces.hpp"

namespace palpate {

/// Position of a block and the time that it covers: the earliest and latest `t` in it.
struct BlockPlace {
  std::uint64_t offset = 0;  ///< offset of its first byte in the file
  Micros first{}, last{};
};

/// A range of unreadable bytes.
struct DamagedBytes {
  std::uint64_t begin = 0, end = 0;
  std::string why;
};

struct RecordedStation {
  StationId id = 0;
  std::string name;
  RecordedRole role = RecordedRole::hand;
  Scheme scheme = Scheme::port;
  std::string tool = {};  ///< name of the tool that it holds; empty: the scene's first
};

/// A tool at a time, for a picture.
struct RecordedTool {
  StationId station = 0;
  std::string name;
  Vec3 position = Vec3::Zero(), force = Vec3::Zero();
  bool contact = false;
  Orientation orientation = {};
  double opening = 0;
  std::uint32_t buttons = 0;
};

/// Thrown for a file that was truncated within its head, as by a full disk, or contains nothing but zeros, as after a crash at
/// its beginning: it never had any contents.
class CutRecording final : public InputError {
 public:
  using InputError::InputError;
};

class RecordingReader {
 public:
  /// `bytes` outlive the reader; `name` stands for the file in errors. Throws InputError for bytes that are no recording, one of
  /// another version, or damaged before the end of the head, CutRecording when they end there.
  RecordingReader(std::span<const std::byte> bytes, const std::string& name);

  const RecordingHead& head() const { return head_; }
  /// Range of all contents. Both 0 when there are none.
  Micros begin() const { return begin_; }
  Micros end() const { return end_; }
  /// True for a recording that was completed and is contiguous according to its index: blocks may be damaged (read()).
  bool complete() const { return complete_; }
  /// Reason for which it is incomplete, in words for a person, with the bytes; empty when it is complete.
  const std::string& damage() const { return damage_; }
  /// Ranges found damaged when the file was opened, ascending. Empty for a complete recording.
  const std::vector<DamagedBytes>& damaged() const { return damaged_; }
  /// All joins, in order: a station that came back has another id and the same name.
  const std::vector<RecordedStation>& stations() const { return stations_; }
  /// Returns the name of a station; "station 7" for an id that never joined.
  std::string name_of(StationId id) const;

  const std::vector<BlockPlace>& blocks() const { return blocks_; }
  /// Returns nothing when the block is damaged.
  std::optional<RecordedBlock> read(std::size_t k) const;
  /// Index of the last block that begins at or before t; the first one for an earlier t. Not for a recording without blocks.
  std::size_t block_at(Micros t) const;

  // For pictures: the last known state at t. These keep the block read last, so playing in order costs each block once.
  /// Returns nothing before the first shape.
  std::optional<RecordedShape> shape_at(Micros t);
  /// Returns the surface of a shape, valid until the next call; null where a damaged block had it. The first shape of a cut body
  /// reads all blocks.
  const BodyMesh* mesh_of(const RecordedShape& shape);
  /// Returns the time of the first shape after t.
  std::optional<Micros> next_shape(Micros t);
  /// Returns the tools of the room at its last frame, or the hand of a station's recording at its last tick.
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
  std::size_t searched_ = 0;  ///< bytes with a wrong checksum
  std::vector<BlockPlace> blocks_;
  std::vector<RecordedStation> stations_;
  std::size_t cached_at_ = SIZE_MAX;
  std::optional<RecordedBlock> cached_;
  std::optional<RecordedSurfaces> surfaces_;
  bool has_changes_ = false;  ///< surfaces_ has those of all blocks
};

/// Missing time of a recording. The duration of damage before the first readable block, and behind the last one without an index,
/// is unknown: it counts as a place with zero time.
struct RecordingLoss {
  std::size_t places = 0;  ///< places in the file where blocks are damaged or missing; adjacent ones count as one
  Micros time{};           ///< total, from the last moment before each place to the first behind it
};
/// Reads every block.
RecordingLoss loss_of(const RecordingReader& recording);

}  // namespace palpate
