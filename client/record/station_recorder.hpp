// Records a station from its ClientCore and its haptic ticks. No file, thread or clock: take() returns the bytes.
#pragma once

#include <string>
#include <utility>

#include "client/core/client_core.hpp"
#include "common/record/writer.hpp"

namespace palpate {

class StationRecorder {
 public:
  static constexpr Micros kLinksEvery{250'000};

  /// `tool`: name of the scene's tool that it holds; empty: the first.
  explicit StationRecorder(const RecordingHead& head, std::string tool = {}) : writer_(head), tool_(std::move(tool)) {}

  void tick(const RecordedTick& tick) { writer_.add(tick); }
  /// Records orientation, opening and buttons, called once a tick: only changes are kept.
  void hold(Micros t, const Orientation& orientation, double opening, std::uint32_t buttons);
  void hand_over(const RecordedHandOver& hand_over) { writer_.add(hand_over); }
  /// Records the datagram that the core has just received. Patches and their terms are kept as they arrived, also rejected ones.
  void datagram(const ClientCore& core, std::span<const std::byte> bytes, Micros now);
  void event(Micros t, RecordedEventKind kind, const std::string& text = {});
  /// Call several times a second: records the state of the session and writes blocks that are due.
  void look(LinkState link, const Welcome& welcome, const std::string& refusal, const ServerPace& pace, Micros now);
  void finish() { writer_.finish(); }
  std::vector<std::byte> take() { return writer_.take(); }

 private:
  RecordingWriter writer_;
  std::string tool_;
  LinkState link_ = LinkState::joining;
  std::string refusal_;
  bool slow_ = false;
  Orientation orientation_;
  double opening_ = 0;
  std::uint32_t buttons_ = 0;
  Micros next_links_{};
  std::uint64_t patch_bytes_ = 0, refused_ = 0;
};

}  // namespace palpate
