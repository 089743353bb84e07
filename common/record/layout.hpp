// The bytes around the parts of a recording: preamble, frame of a part, trailer. docs/reference/recording.md, section 1.
//
//   preamble   8 bytes "PALPREC\n", uint32 version, uint32 0
//   part       4 bytes "PART", uint32 CRC-32 of everything after it, int64 first, int64 last [us],
//              a FlatBuffer with its size in front (schema/recording.fbs), zeros up to a multiple of 8
//   trailer    uint64 offset of the part that holds the index, 8 bytes "PALPEND\n"
//
// Little-endian throughout.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/base/types.hpp"

namespace palpate::layout {

inline constexpr std::uint32_t kVersion = 1;
inline constexpr char kMagic[] = "PALPREC\n", kPartMark[] = "PART", kEnd[] = "PALPEND\n";
inline constexpr std::size_t kMagicBytes = 8, kPreambleBytes = 16, kFrameBytes = 24, kTrailerBytes = 16, kPrefixBytes = 4;
inline constexpr char kIdentifier[] = "PLPR";  ///< identifier of the FlatBuffer in a part, at kIdentifierAt
inline constexpr std::size_t kIdentifierAt = kFrameBytes + 2 * kPrefixBytes;
inline constexpr std::size_t kMaxPartBytes = 1u << 28;  ///< a larger part is corrupt

std::uint32_t crc32_of(std::span<const std::byte> bytes);

void append_preamble(std::vector<std::byte>& file);
/// `part` begins with its size.
void append_part(std::vector<std::byte>& file, Micros first, Micros last, std::span<const std::byte> part);
void append_trailer(std::vector<std::byte>& file, std::uint64_t index_offset);

/// A part that is completely in the file, with a valid checksum.
struct PartView {
  Micros first{}, last{};
  std::span<const std::byte> part;  ///< begins with its size
  std::size_t end = 0;              ///< offset of the next part
  const char* fault = nullptr;      ///< reason for which there is no part; nullptr when there is one
};
PartView part_at(std::span<const std::byte> file, std::size_t offset);

/// Returns the offset of the index from the trailer; 0 without a trailer.
std::uint64_t index_offset(std::span<const std::byte> file);

}  // namespace palpate::layout
