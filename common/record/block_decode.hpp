// Decodes the FlatBuffer of a part into plain structs, with every number checked.
#pragma once

#include <optional>
#include <span>

#include "common/record/reader.hpp"

namespace palpate {

/// Return nothing for an invalid part. `part` begins with its size.
std::optional<RecordingHead> decode_head(std::span<const std::byte> part);
/// `vertices`: number of recorded ones, from the head.
std::optional<RecordedBlock> decode_block(std::span<const std::byte> part, std::size_t vertices);

struct RecordingIndex {
  std::vector<BlockPlace> blocks;
  std::vector<RecordedEvent> joins;
};
std::optional<RecordingIndex> decode_index(std::span<const std::byte> part);

}  // namespace palpate
