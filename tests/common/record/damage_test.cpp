// Arbitrary damage to the file: a readable error, or everything up to the damage; never a crash.
#include <catch2/catch.hpp>
#include <cstring>
#include <optional>

#include "common/base/error.hpp"
#include "common/record/block_decode.hpp"
#include "common/record/layout.hpp"
#include "recording_generated.h"
#include "tests/common/record/small_recording.hpp"
#include "tests/support/address_space.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

struct Found {
  std::string error;  ///< set if nothing was read
  bool complete = false;
  std::string damage;
  int frames = 0, unreadable = 0;
  bool true_so_far = true;  ///< true while frame k equals frame k as written
};

Found found_in(std::span<const std::byte> bytes) {
  Found found;
  try {
    RecordingReader recording(bytes, "damaged.rec");
    found.complete = recording.complete();
    found.damage = recording.damage();
    for (std::size_t k = 0; k < recording.blocks().size(); ++k) {
      const auto block = recording.read(k);
      found.unreadable += !block;
      if (!block) continue;
      for (const RecordedTouch& touch : block->touches) {
        const auto frame = static_cast<int>((touch.t - kSmallBegin) / kSmallFrame);
        found.true_so_far =
            found.true_so_far && touch.force == small_touch(frame).force && (found.unreadable > 0 || frame == found.frames);
        ++found.frames;
      }
    }
    recording.shape_at(recording.end());
    recording.tools_at(recording.begin());
  } catch (const InputError& error) {
    found.error = error.what();
  }
  return found;
}

/// Frames whose block ends within the first `size` bytes of an undamaged recording.
int frames_within(const RecordingReader& whole, std::size_t size) {
  int frames = 0;
  for (std::size_t k = 0; k < whole.blocks().size(); ++k) {
    const bool last = k + 1 == whole.blocks().size();
    if (!last && whole.blocks()[k + 1].offset <= size) frames += static_cast<int>(whole.read(k)->frames.size());
  }
  return frames;
}

}  // namespace

TEST_CASE("a recording cut off at any byte has all blocks before the cut", "[record]") {
  constexpr int kFrames = 30;
  const auto bytes = small_recording(kFrames, true);
  const RecordingReader whole(bytes, "whole");
  REQUIRE(whole.blocks().size() >= 3);
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    const Found found = found_in(std::span(bytes).first(size));
    INFO("cut at byte " << size << ": " << found.error << found.damage);
    REQUIRE_FALSE(found.complete);
    REQUIRE(found.error.empty() != found.damage.empty());
    REQUIRE(found.true_so_far);
    REQUIRE(found.unreadable == 0);
    REQUIRE((!found.error.empty() || found.frames >= frames_within(whole, size)));
    REQUIRE((found.error.empty() || size < whole.blocks().front().offset));
  }
}

TEST_CASE("any flipped byte is noticed, and costs at most its own block and what follows", "[record]") {
  constexpr int kFrames = 20;
  const auto undamaged = small_recording(kFrames, true);
  auto bytes = undamaged;
  const RecordingReader whole(undamaged, "whole");
  const auto places = whole.blocks();
  int errors = 0;
  for (std::size_t at = 0; at < bytes.size(); ++at) {
    const auto was = bytes[at];
    bytes[at] ^= std::byte{0x10};
    const Found found = found_in(bytes);
    INFO("byte " << at << " flipped: " << found.error << found.damage);
    REQUIRE(found.true_so_far);
    REQUIRE((!found.error.empty() || !found.complete || found.unreadable == 1));
    if (!found.error.empty()) {
      REQUIRE(at < places.front().offset);
      ++errors;
    } else if (at >= places.back().offset) {
      REQUIRE(found.frames + static_cast<int>(whole.read(places.size() - 1)->frames.size()) >= kFrames);
    } else {
      REQUIRE(found.frames < kFrames);
      REQUIRE(found.frames > 0);
    }
    bytes[at] = was;
  }
  CHECK(errors == static_cast<int>(places.front().offset));
}

TEST_CASE("a recording without its end says so and is whole otherwise", "[record]") {
  const auto bytes = small_recording(30, false);
  const Found found = found_in(bytes);
  CHECK_FALSE(found.complete);
  CHECK_THAT(found.damage, Catch::Contains("it was not ended, from byte " + std::to_string(bytes.size())));
  CHECK(found.frames >= 30 - 10);
}

namespace {

/// Frames, by number, of the readable blocks of `bytes`.
std::vector<int> frames_in(std::span<const std::byte> bytes) {
  const RecordingReader recording(bytes, "damaged.rec");
  std::vector<int> frames;
  for (std::size_t k = 0; k < recording.blocks().size(); ++k)
    if (const auto block = recording.read(k))
      for (const RecordedTouch& touch : block->touches) frames.push_back(static_cast<int>((touch.t - kSmallBegin) / kSmallFrame));
  return frames;
}

/// Frames of the blocks of an undamaged recording that do not touch its bytes `begin` to `end`.
std::vector<int> frames_beside(const RecordingReader& whole, std::size_t begin, std::size_t end) {
  std::vector<int> frames;
  for (std::size_t k = 0; k < whole.blocks().size(); ++k) {
    const std::size_t from = whole.blocks()[k].offset;
    const std::size_t to = k + 1 < whole.blocks().size() ? whole.blocks()[k + 1].offset : SIZE_MAX;
    if (from < end && begin < to) continue;
    const auto block = whole.read(k);
    for (const RecordedTouch& touch : block->touches) frames.push_back(static_cast<int>((touch.t - kSmallBegin) / kSmallFrame));
  }
  return frames;
}

}  // namespace

TEST_CASE("without an index a flipped byte costs its own block alone, and where it lay is said", "[record]") {
  constexpr int kFrames = 30;
  const auto undamaged = small_recording(kFrames, true);
  const RecordingReader whole(undamaged, "whole");
  const auto places = whole.blocks();
  REQUIRE(places.size() >= 4);
  auto bytes = undamaged;
  bytes.resize(bytes.size() - layout::kTrailerBytes);  // removes the index of blocks
  std::vector<std::size_t> flips;                      // every byte of a part's frame, some of its content
  for (std::size_t k = 0; k + 1 < places.size(); ++k)
    for (std::size_t at = places[k].offset; at < places[k + 1].offset; at += at < places[k].offset + 48 ? 1 : 13)
      flips.push_back(at);
  for (const std::size_t at : flips) {
    const auto was = bytes[at];
    bytes[at] ^= std::byte{0x10};
    INFO("byte " << at);
    std::size_t hit = 0;
    while (places[hit + 1].offset <= at) ++hit;
    REQUIRE(frames_in(bytes) == frames_beside(whole, at, at + 1));
    const RecordingReader recording(bytes, "flipped.rec");
    REQUIRE(recording.damaged().front().begin == places[hit].offset);
    REQUIRE(recording.damaged().front().end == places[hit + 1].offset);
    REQUIRE(recording.damage().find(" to " + std::to_string(places[hit + 1].offset)) != std::string::npos);
    REQUIRE(loss_of(recording).places == 1);
    bytes[at] = was;
  }
}

TEST_CASE("of a recording from whose middle a piece is missing the rest is read, and how long it misses is said", "[record]") {
  constexpr int kFrames = 30;
  const auto undamaged = small_recording(kFrames, true);
  const RecordingReader whole(undamaged, "whole");
  const auto places = whole.blocks();
  REQUIRE(places.size() >= 4);
  for (const std::size_t cut : {1u, 7u, 8u, 400u, 3000u})
    for (std::size_t begin = places[1].offset; begin + cut < places.back().offset; begin += 31) {
      auto bytes = undamaged;
      bytes.erase(bytes.begin() + static_cast<std::ptrdiff_t>(begin), bytes.begin() + static_cast<std::ptrdiff_t>(begin + cut));
      INFO(cut << " bytes from " << begin << " on");
      // What follows may equal what is missing, as zeros at the end of a block.
      std::size_t changed = begin;
      while (bytes[changed] == undamaged[changed]) ++changed;
      const std::vector<int> left = frames_beside(whole, changed, begin + cut);
      REQUIRE(frames_in(bytes) == left);
      const RecordingReader recording(bytes, "cut.rec");
      REQUIRE_FALSE(recording.complete());
      REQUIRE(recording.name_of(3) == "hand");
      const RecordingLoss loss = loss_of(recording);
      const bool none = left.size() == static_cast<std::size_t>(kFrames);
      REQUIRE(loss.places == (none ? 0 : 1));
      // Frames are the only content of the blocks, and this many lie between the first missing one and the next present one.
      REQUIRE(loss.time >= (kFrames - static_cast<int>(left.size()) - 1) * kSmallFrame);
      REQUIRE(loss.time <= (kFrames - static_cast<int>(left.size()) + 2) * kSmallFrame);
    }
}

TEST_CASE("who joined in a block that is lost keeps the name that the index has", "[record]") {
  auto bytes = small_recording(30, true);
  const RecordingReader whole(bytes, "whole");
  const std::size_t first = whole.blocks()[0].offset;
  bytes.erase(bytes.begin() + static_cast<std::ptrdiff_t>(first), bytes.begin() + static_cast<std::ptrdiff_t>(first) + 100);
  CHECK(RecordingReader(bytes, "cut.rec").name_of(3) == "hand");
}

TEST_CASE("a file full of beginnings that lead nowhere is given up, not searched for hours", "[record][hostile]") {
  auto bytes = small_recording(3, false);
  const std::size_t from = bytes.size(), parts = 400'000, each = 40;
  bytes.resize(from + parts * each);
  for (std::size_t k = 0; k < parts; ++k) {
    std::byte* const part = bytes.data() + from + k * each;
    const auto size = static_cast<std::uint32_t>((parts - k) * each - layout::kFrameBytes - layout::kPrefixBytes);
    std::memcpy(part, layout::kPartMark, 4);
    std::memcpy(part + layout::kFrameBytes, &size, sizeof size);
    std::memcpy(part + layout::kIdentifierAt, layout::kIdentifier, 4);
  }
  const RecordingReader recording(bytes, "hostile.rec");  // every checksum: 3 TB
  CHECK_FALSE(recording.complete());
  CHECK(recording.damaged().back().end == bytes.size());
}

TEST_CASE(
    "a recording that ends within its head, or has nothing but zeros, was cut as it began, and one that is damaged there was not",
    "[record]") {
  const auto bytes = small_recording(3, false);
  const std::size_t head_end = layout::part_at(bytes, layout::kPreambleBytes).end;
  for (std::size_t size = 0; size < head_end; ++size) {
    CAPTURE(size);
    CHECK_THROWS_AS(RecordingReader(std::span(bytes).first(size), "cut.rec"), CutRecording);
  }
  CHECK(RecordingReader(std::span(bytes).first(head_end), "whole.rec").head().name ==
        RecordingReader(bytes, "all.rec").head().name);
  CHECK_THROWS_AS(RecordingReader(std::vector<std::byte>(4096), "zeros.rec"), CutRecording);
  auto damaged = bytes;
  damaged[head_end - 1] ^= std::byte{1};
  CHECK_THAT(found_in(damaged).error, Catch::Contains("its head is damaged"));
}

TEST_CASE("what is no recording, or one of another version, is refused in words", "[record]") {
  auto bytes = small_recording(3, true);
  CHECK_THAT(found_in({}).error,
             Catch::Contains("damaged.rec: is no recording, cut as it began; expected a recording made by palpate-server"));
  const std::string text = "t_s,x_m,y_m,z_m\n0,0,0,0\n1,0,0,0\n";
  CHECK_THAT(found_in(std::as_bytes(std::span(text))).error, Catch::Contains("is no recording"));
  bytes[8] = std::byte{2};
  CHECK_THAT(found_in(bytes).error, Catch::Contains("is a recording of version 2; expected version 1"));
}

namespace {

std::vector<std::byte> file_of(const record::HeadT& head, const record::BlockT& block) {
  std::vector<std::byte> file;
  layout::append_preamble(file);
  const auto append = [&](flatbuffers::FlatBufferBuilder& builder, record::Content kind, flatbuffers::Offset<void> content) {
    builder.FinishSizePrefixed(record::CreatePart(builder, kind, content), record::PartIdentifier());
    layout::append_part(file, Micros{0}, Micros{1}, std::as_bytes(std::span(builder.GetBufferPointer(), builder.GetSize())));
  };
  flatbuffers::FlatBufferBuilder first, second;
  append(first, record::Content::Head, record::CreateHead(first, &head).Union());
  append(second, record::Content::Block, record::CreateBlock(second, &block).Union());
  return file;
}

}  // namespace

TEST_CASE("a part that names one list a million times is damage, not gigabytes", "[record][hostile]") {
  constexpr std::size_t kSamples = 1000, kTimes = 200'000;
  flatbuffers::FlatBufferBuilder builder;
  const std::vector<record::Sample> samples(kSamples);
  const auto path = record::CreatePath(builder, 1, builder.CreateVectorOfStructs(samples));
  // One table each, all with the same content.
  std::vector<flatbuffers::Offset<record::Path>> same(kTimes, path), apart;
  const auto list = builder.CreateVectorOfStructs(samples);
  for (std::size_t k = 0; k < kTimes / 10; ++k) apart.push_back(record::CreatePath(builder, 1, list));
  for (const auto& paths : {same, apart}) {
    const auto block = record::CreateBlock(builder, 0, builder.CreateVector(paths));
    builder.FinishSizePrefixed(record::CreatePart(builder, record::Content::Block, block.Union()), record::PartIdentifier());
    const AddressSpace no_more(64u << 20);
    CHECK_FALSE(decode_block(std::as_bytes(std::span(builder.GetBufferPointer(), builder.GetSize())), 0).has_value());
  }
}

TEST_CASE("numbers that lie where the machine would not read them are damage", "[record][hostile]") {
  int read = 0;
  for (const std::size_t words : {0u, 1u}) {  // preceding words of four bytes
    flatbuffers::FlatBufferBuilder builder;
    const std::vector<std::uint8_t> stuffing(4 * words), bytes(sizeof(record::HandOver));
    for (const std::uint8_t byte : stuffing) builder.PushElement(byte);
    builder.StartVector(bytes.size(), 1);
    for (const std::uint8_t byte : bytes) builder.PushElement(byte);
    const auto list = builder.EndVector(1);
    record::BlockBuilder block(builder);
    block.add_base(1);  // of eight bytes, which aligns the whole to a multiple of them
    block.add_hand_overs(flatbuffers::Offset<flatbuffers::Vector<const record::HandOver*>>(list));
    const auto content = block.Finish();
    builder.FinishSizePrefixed(record::CreatePart(builder, record::Content::Block, content.Union()), record::PartIdentifier());
    read += decode_block(std::as_bytes(std::span(builder.GetBufferPointer(), builder.GetSize())), 0).has_value();
  }
  CHECK(read == 1);
}

TEST_CASE("a name that is no text is damage before a report trips over it", "[record][hostile]") {
  record::HeadT head;
  CHECK_NOTHROW(RecordingReader(file_of(head, {}), "plain.rec"));
  for (std::string record::HeadT::*text :
       {&record::HeadT::program, &record::HeadT::name, &record::HeadT::scene, &record::HeadT::scene_file}) {
    record::HeadT bad;
    bad.*text = "station \xff";
    const auto bytes = file_of(bad, {});
    CHECK_THROWS_AS(RecordingReader(bytes, "bad.rec"), InputError);
  }
  record::BlockT block;
  block.events.push_back(std::make_unique<record::EventT>());
  block.events.back()->name = "\xff";
  const auto bytes = file_of(head, block);
  CHECK(RecordingReader(bytes, "bad.rec").blocks().empty());
}

TEST_CASE("a rigid part with a triangle of a vertex that is not there damages the head", "[record][hostile]") {
  RecordingHead head = small_head();
  head.parts[0].mesh.triangles[0] = {0, 1, 3};
  RecordingWriter writer(head);
  writer.finish();
  const auto bytes = writer.take();
  CHECK_THROWS_WITH(RecordingReader(bytes, "odd.rec"), Catch::Contains("its head is damaged"));
}

TEST_CASE("marks that are none, or not one for each vertex, damage the head", "[record][hostile]") {
  for (const std::vector<std::uint8_t>& marks : {std::vector<std::uint8_t>{0, 0, 0, 0, 0}, {0, 0, 0, 32}}) {
    RecordingHead head = small_head();
    head.surface.marks = marks;
    RecordingWriter writer(head);
    writer.finish();
    const auto bytes = writer.take();
    CHECK_THROWS_WITH(RecordingReader(bytes, "odd.rec"), Catch::Contains("its head is damaged"));
  }
}

TEST_CASE("a recording of names that are no text is written as one that can be read", "[record][hostile]") {
  RecordingHead head = small_head();
  head.name = "room \xff";
  head.scene_file = "/home/\xe4/a\nb.json";
  RecordingWriter writer(head);
  const auto bytes = writer.take();
  const RecordingReader recording(bytes, "odd.rec");
  CHECK(recording.head().name == "room ?");
  CHECK(recording.head().scene_file == "/home/?/a?b.json");
}

TEST_CASE("of blocks that lie within each other, as an index may say, the inner ones alone are read", "[record][hostile]") {
  auto bytes = small_recording(30, true);
  const RecordingReader before(bytes, "whole.rec");
  const auto blocks = before.blocks();
  REQUIRE(blocks.size() >= 3);
  // The first block swallows the second, with a valid checksum.
  const std::size_t first = blocks[0].offset, end = blocks[2].offset;
  const auto size = static_cast<std::uint32_t>(end - first - layout::kFrameBytes - layout::kPrefixBytes);
  std::memcpy(bytes.data() + first + layout::kFrameBytes, &size, sizeof size);
  const std::uint32_t crc = layout::crc32_of(std::span(bytes).subspan(first + 8, end - first - 8));
  std::memcpy(bytes.data() + first + 4, &crc, sizeof crc);
  REQUIRE(layout::part_at(bytes, first).fault == nullptr);
  const RecordingReader nested(bytes, "nested.rec");
  CHECK_FALSE(nested.read(0).has_value());
  CHECK(nested.read(1).has_value());
}
