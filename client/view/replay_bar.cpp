#include "client/view/replay_bar.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string>

#include "client/view/pen.hpp"

namespace palpate {
namespace {

void draw_sign(const Pen& pen, const ReplayBar& bar, bool playing) {
  const float x = bar.button_left + 4 * pen.scale, y = 0.5F * (bar.top + bar.bottom), r = 7 * pen.scale;
  const ImU32 ink = packed(pen.theme.ink);
  if (!playing) {
    pen.list.AddTriangleFilled({x, y - r}, {x, y + r}, {x + 1.7F * r, y}, ink);
    return;
  }
  for (const float at : {0.0F, 1.0F}) pen.list.AddRectFilled({x + at * r, y - r}, {x + (at + 0.55F) * r, y + r}, ink);
}

void draw_course(const Pen& pen, const ReplayBar& bar, const ReplayState& state, float shown_x) {
  const float part = (bar.right - bar.left) / static_cast<float>(std::max<std::size_t>(1, state.course.size()));
  for (std::size_t k = 0; k < state.course.size(); ++k) {
    if (state.course[k] <= 0) continue;
    const float x = bar.left + part * static_cast<float>(k), y = bar.bottom - state.course[k] * (bar.bottom - bar.top - 3);
    pen.list.AddRectFilled({x, y}, {x + std::max(part, 1.0F), bar.bottom},
                           packed(x <= shown_x ? pen.theme.accent : pen.theme.ink_soft, x <= shown_x ? 0.85F : 0.40F));
  }
}

/// Draws a mark at each moment of a note, and the newest note for some seconds after its moment.
void draw_notes(const Pen& pen, const ReplayBar& bar, const ReplayState& state, double span_s) {
  constexpr Micros kShown{6'000'000};
  const RecordedNote* newest = nullptr;
  for (const RecordedNote& note : state.notes) {
    const double share = std::clamp(seconds(note.about - state.begin) / span_s, 0.0, 1.0);
    const float x = bar.left + static_cast<float>(share) * (bar.right - bar.left), half = 4 * pen.scale;
    pen.list.AddTriangleFilled({x - half, bar.bottom + 8 * pen.scale}, {x + half, bar.bottom + 8 * pen.scale},
                               {x, bar.bottom + pen.scale}, packed(pen.theme.ink));
    if (note.about <= state.at && state.at - note.about < kShown) newest = &note;
  }
  if (newest == nullptr) return;
  const std::string words = newest->author + ": " + (newest->text.empty() ? "a mark" : newest->text);
  pen.text(bar.left, bar.top - 26 * pen.scale, 15, pen.theme.ink, words);
}

/// Returns for example "1:02.3", rounded down so that a moment never appears later than it is.
std::string clock_words(Micros t) {
  const auto tenths = t / Micros{100'000};
  return fmt::format("{}:{:02}.{}", tenths / 600, tenths / 10 % 60, tenths % 10);
}

}  // namespace

ReplayBar::ReplayBar(float width, float height, float scale)
    : left(190 * scale),
      right(width - 76 * scale),
      top(height - 40 * scale),
      bottom(height - 16 * scale),
      button_left(24 * scale),
      button_right(52 * scale) {}

bool ReplayBar::on_button(float x, float y) const { return x >= button_left && x <= button_right && y >= top && y <= bottom; }

bool ReplayBar::on_track(float x, float y) const { return x >= left && x <= right && y >= top && y <= bottom; }

Micros ReplayBar::moment_at(const ReplayState& state, float x) const {
  const double share = std::clamp((static_cast<double>(x) - left) / std::max(1.0F, right - left), 0.0, 1.0);
  return state.begin + from_seconds(share * seconds(state.end - state.begin));
}

void draw_replay_bar(const Pen& pen, const ReplayState& state) {
  const ReplayBar bar(pen.width, pen.height, pen.scale);
  const float middle = 0.5F * (bar.top + bar.bottom), round = 4 * pen.scale;
  const double span_s = std::max(1e-6, seconds(state.end - state.begin));
  const float x = bar.left + static_cast<float>(seconds(state.at - state.begin) / span_s) * (bar.right - bar.left);
  draw_sign(pen, bar, state.playing);
  pen.text(bar.button_right + 6 * pen.scale, middle - 8 * pen.scale, 14, pen.theme.ink,
           clock_words(state.at - state.begin) + " of " + clock_words(state.end - state.begin));
  pen.list.AddRectFilled({bar.left, bar.top}, {bar.right, bar.bottom}, packed(pen.theme.background_bottom, 0.72F), round);
  draw_course(pen, bar, state, x);
  draw_notes(pen, bar, state, span_s);
  pen.list.AddRect({bar.left, bar.top}, {bar.right, bar.bottom}, packed(pen.theme.ink_soft, 0.35F), round, 0, pen.scale);
  pen.list.AddLine({x, bar.top - 3 * pen.scale}, {x, bar.bottom + 3 * pen.scale}, packed(pen.theme.ink), 2 * pen.scale);
  pen.list.AddCircleFilled({x, bar.top - 3 * pen.scale}, 4 * pen.scale, packed(pen.theme.ink), 20);
  pen.text_left_of(pen.width - 28 * pen.scale, middle - 8 * pen.scale, 14, pen.theme.ink,
                   state.speed >= 1 ? fmt::format("{:g} x", state.speed) : fmt::format("1/{:g} x", 1 / state.speed));
}

}  // namespace palpate
