// Whatever happens to the file: an error in words, or everything up to the damage; never a crash.
#include <catch2/catch.hpp>
#include <optional>

#include "common/base/error.hpp"
#include "tests/record/small_recording.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

struct Found {
  std::string error;  ///< nothing was read
  bool complete = false;
  std::string damage;
  int frames = 0, unreadable = 0;
  bool true_so_far = true;  ///< frame k is frame k of what was written
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

TEST_CASE("what is no recording, or one of another version, is refused in words", "[record]") {
  auto bytes = small_recording(3, true);
  CHECK_THAT(found_in({}).error, Catch::Contains("damaged.rec: is no recording; expected a recording made by palpate-server"));
  const std::string text = "t_s,x_m,y_m,z_m\n0,0,0,0\n1,0,0,0\n";
  CHECK_THAT(found_in(std::as_bytes(std::span(text))).error, Catch::Contains("is no recording"));
  bytes[8] = std::byte{2};
  CHECK_THAT(found_in(bytes).error, Catch::Contains("is a recording of version 2; expected version 1"));
}
