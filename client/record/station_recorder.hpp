// What a station's recording gets from its ClientCore and its haptic ticks. No file, thread or clock: bytes come out of take().
#pragma once

#include "client/core/client_core.hpp"
#include "common/record/writer.hpp"

namespace palpate {

class StationRecorder {
 public:
  static constexpr Micros kLinksEvery{250'000};

  explicit StationRecorder(const RecordingHead& head) : writer_(head) {}

  void tick(const RecordedTick& tick) { writer_.add(tick); }
  /// How the tool is held and its buttons, once a tick: kept where they change.
  void hold(Micros t, const Orientation& orientation, std::uint32_t buttons);
  void hand_over(const RecordedHandOver& hand_over) { writer_.add(hand_over); }
  /// The core has just taken `bytes`. Patches and their terms are kept as they came, also those that it refused.
  void datagram(const ClientCore& core, std::span<const std::byte> bytes, Micros now);
  void event(Micros t, RecordedEventKind kind, const std::string& text = {});
  /// Several times a second: what became of the session, blocks that are due.
  void look(LinkState link, const Welcome& welcome, const std::string& refusal, const ServerPace& pace, Micros now);
  void finish() { writer_.finish(); }
  std::vector<std::byte> take() { return writer_.take(); }

 private:
  RecordingWriter writer_;
  LinkState link_ = LinkState::joining;
  std::string refusal_;
  bool slow_ = false;
  Orientation orientation_;
  std::uint32_t buttons_ = 0;
  Micros next_links_{};
  std::uint64_t patch_bytes_ = 0, refused_ = 0;
};

}  // namespace palpate
