// From the FlatBuffer of a part to plain structs, every number checked.
#pragma once

#include <optional>
#include <span>

#include "common/record/reader.hpp"

namespace palpate {

/// Nothing when it is none, or holds what no writer writes. `part` begins with its size.
std::optional<RecordingHead> decode_head(std::span<const std::byte> part);
/// `vertices`: recorded ones, as the head says.
std::optional<RecordedBlock> decode_block(std::span<const std::byte> part, std::size_t vertices);

struct RecordingIndex {
  std::vector<BlockPlace> blocks;
  std::vector<RecordedEvent> joins;
};
std::optional<RecordingIndex> decode_index(std::span<const std::byte> part);

}  // namespace palpate
