// Arbitrary bytes: the reader of recordings refuses or reads them, and neither crashes nor returns values out of range.
//
// Random bytes never have a valid checksum, so the harness repairs the checksums of the parts before it reads, so that the code
// behind them is exercised too.
#include <cstdlib>
#include <cstring>

#include "common/base/error.hpp"
#include "common/record/layout.hpp"
#include "tests/common/record/small_recording.hpp"

using namespace palpate;

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size);

namespace {

void mend(std::vector<std::byte>& bytes) {
  for (std::size_t at = layout::kPreambleBytes; at + layout::kFrameBytes + layout::kPrefixBytes <= bytes.size();) {
    std::uint32_t size = 0;
    std::memcpy(&size, bytes.data() + at + layout::kFrameBytes, sizeof size);
    const std::size_t end = at + layout::kFrameBytes + (layout::kPrefixBytes + std::size_t{size} + 7) / 8 * 8;
    if (end > bytes.size()) return;
    const std::uint32_t crc = layout::crc32_of(std::span(bytes).subspan(at + 8, end - at - 8));
    std::memcpy(bytes.data() + at + 4, &crc, sizeof crc);
    at = end;
  }
}

void read_all(std::span<const std::byte> bytes) {
  RecordingReader recording(bytes, "fuzz");
  const auto& surface = recording.head().surface;
  for (const Triangle& triangle : surface.triangles)
    for (const std::uint32_t corner : triangle)
      if (corner >= surface.rest.size()) std::abort();
  for (std::size_t k = 0; k < recording.blocks().size(); ++k) {
    const auto block = recording.read(k);
    if (!block) continue;
    for (const RecordedShape& shape : block->shapes)
      if (const BodyMesh* mesh = recording.mesh_of(shape)) {
        if (mesh->vertices.size() != shape.positions.size()) std::abort();
        for (const Triangle& triangle : mesh->triangles)
          for (const std::uint32_t corner : triangle)
            if (corner >= mesh->vertices.size()) std::abort();
      }
    for (const RecordedTick& tick : block->ticks)
      if (!tick.position.allFinite() || !tick.force.allFinite()) std::abort();
    for (const RecordedTurn& turn : block->turns)
      if (!is_unit(turn.orientation)) std::abort();
  }
  if (recording.blocks().empty()) return;
  recording.shape_at(recording.end());
  recording.tools_at(recording.end());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto given = std::as_bytes(std::span(data, size));
  std::vector<std::byte> bytes(given.begin(), given.end());
  mend(bytes);
  try {
    read_all(bytes);
  } catch (const InputError&) {
  }
  return 0;
}

/// Sometimes starts from a recording of ours.
extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t max_size, unsigned seed) {
  if (seed % 32 == 0 || size < 20) {
    const auto bytes = test::small_recording(static_cast<int>(seed / 32 % 3), seed % 64 == 0);
    size = std::min(bytes.size(), max_size);
    std::memcpy(data, bytes.data(), size);
  }
  return LLVMFuzzerMutate(data, size, max_size);
}
