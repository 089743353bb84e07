#include "common/record/layout.hpp"

#include <zlib.h>

#include <bit>
#include <cstring>

namespace palpate::layout {
namespace {

static_assert(std::endian::native == std::endian::little, "numbers are copied as they lie in memory");

template <class Number>
void append(std::vector<std::byte>& file, Number number) {
  const auto bytes = std::as_bytes(std::span(&number, 1));
  file.insert(file.end(), bytes.begin(), bytes.end());
}

void append_text(std::vector<std::byte>& file, const char* text, std::size_t size) {
  const auto bytes = std::as_bytes(std::span(text, size));
  file.insert(file.end(), bytes.begin(), bytes.end());
}

template <class Number>
Number number_at(std::span<const std::byte> file, std::size_t offset) {
  Number number;
  std::memcpy(&number, file.data() + offset, sizeof number);
  return number;
}

std::size_t padded(std::size_t size) { return (size + 7) / 8 * 8; }

}  // namespace

std::uint32_t crc32_of(std::span<const std::byte> bytes) {
  return static_cast<std::uint32_t>(crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

void append_preamble(std::vector<std::byte>& file) {
  append_text(file, kMagic, kMagicBytes);
  append(file, kVersion);
  append(file, std::uint32_t{0});
}

void append_part(std::vector<std::byte>& file, Micros first, Micros last, std::span<const std::byte> part) {
  const std::size_t begin = file.size(), checked = begin + 8;
  append_text(file, kPartMark, 4);
  append(file, std::uint32_t{0});
  append(file, std::int64_t{first.count()});
  append(file, std::int64_t{last.count()});
  file.insert(file.end(), part.begin(), part.end());
  file.resize(begin + kFrameBytes + padded(part.size()));
  const std::uint32_t crc = crc32_of(std::span(file).subspan(checked));
  std::memcpy(file.data() + begin + 4, &crc, sizeof crc);
}

void append_trailer(std::vector<std::byte>& file, std::uint64_t index_offset) {
  append(file, index_offset);
  append_text(file, kEnd, kMagicBytes);
}

PartView part_at(std::span<const std::byte> file, std::size_t offset) {
  PartView view;
  const auto without = [&](const char* fault) {
    view.fault = fault;
    return view;
  };
  if (offset > file.size() || file.size() - offset < kFrameBytes + kPrefixBytes) return without("it ends inside a part");
  if (std::memcmp(file.data() + offset, kPartMark, 4) != 0) return without("no part begins here");
  const std::size_t size = kPrefixBytes + number_at<std::uint32_t>(file, offset + kFrameBytes);
  if (size > kMaxPartBytes) return without("the size of a part is damaged");
  view.end = offset + kFrameBytes + padded(size);
  if (view.end > file.size()) return without("it ends inside a part");
  if (crc32_of(file.subspan(offset + 8, view.end - offset - 8)) != number_at<std::uint32_t>(file, offset + 4))
    return without("a checksum does not hold");
  view.first = Micros{number_at<std::int64_t>(file, offset + 8)};
  view.last = Micros{number_at<std::int64_t>(file, offset + 16)};
  view.part = file.subspan(offset + kFrameBytes, size);
  return view;
}

std::uint64_t index_offset(std::span<const std::byte> file) {
  if (file.size() < kPreambleBytes + kTrailerBytes) return 0;
  const std::size_t trailer = file.size() - kTrailerBytes;
  if (std::memcmp(file.data() + trailer + 8, kEnd, kMagicBytes) != 0) return 0;
  return number_at<std::uint64_t>(file, trailer);
}

}  // namespace palpate::layout
