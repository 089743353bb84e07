// The bar under a played recording: play or pause, time, the forces of the whole recording with the moment that is shown, speed.
#pragma once

#include <optional>
#include <vector>

#include "common/base/types.hpp"

namespace palpate {

struct Pen;

struct ReplayState {
  Micros begin{}, end{}, at{};
  double speed = 1;
  bool playing = false;
  std::vector<float> course;  ///< what is drawn along the time, in equal parts, each from 0 to 1
};

/// Where things are, in pixels from the top left.
struct ReplayBar {
  static constexpr float kHeight = 54;  ///< of the picture's lower edge, in units of the interface scale
  ReplayBar(float width, float height, float scale);
  /// On the sign for play or pause.
  bool on_button(float x, float y) const;
  /// On the track.
  bool on_track(float x, float y) const;
  /// The moment at x, the nearest end beside the track.
  Micros moment_at(const ReplayState& state, float x) const;

  float left, right, top, bottom;  ///< of the track
  float button_left, button_right;
};

void draw_replay_bar(const Pen& pen, const ReplayState& state);

}  // namespace palpate
