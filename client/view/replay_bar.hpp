// The bar under a played recording: play or pause, time, the forces of the whole recording with the moment shown and those of
// notes, the newest note, speed.
#pragma once

#include <optional>
#include <vector>

#include "common/record/recording.hpp"

namespace palpate {

struct Pen;

struct ReplayState {
  Micros begin{}, end{}, at{};
  double speed = 1;
  bool playing = false;
  std::vector<float> course = {};        ///< curve along the time, in equal parts, each from 0 to 1
  std::vector<RecordedNote> notes = {};  ///< by their moments
};

/// Layout in pixels from the top left.
struct ReplayBar {
  static constexpr float kHeight = 54;  ///< height above the lower edge of the picture, in units of the interface scale
  ReplayBar(float width, float height, float scale);
  /// True on the sign for play or pause.
  bool on_button(float x, float y) const;
  /// True on the track.
  bool on_track(float x, float y) const;
  /// Returns the moment at x, the nearest end outside the track.
  Micros moment_at(const ReplayState& state, float x) const;

  float left, right, top, bottom;  ///< edges of the track
  float button_left, button_right;
};

void draw_replay_bar(const Pen& pen, const ReplayState& state);

}  // namespace palpate
