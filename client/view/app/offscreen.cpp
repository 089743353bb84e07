#include "client/view/app/offscreen.hpp"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <filesystem>
#include <stdexcept>

#include "client/view/app/scene_view.hpp"
#include "client/view/offscreen_context.hpp"

namespace palpate {
namespace {

constexpr Micros kPatience{10'000'000};  // wait for a first shape, beyond the moment of the picture

void wait_for_shape(ViewSession& session, Micros since) {
  const Micros until = now_us() + kPatience;
  const auto refused = [&] { return session.core().link() == LinkState::refused; };
  const auto refused_for_good = [&] { return refused() && session.core().refuse_reason() == RefuseReason::bad_request; };
  while (!session.core().ready() && now_us() < until && !stop_requested() && !refused_for_good())
    session.pump_until(now_us() + Micros{20'000});
  if (session.core().ready() || stop_requested()) return;
  if (refused()) throw std::runtime_error(fmt::format("{}: refused: {}", session.server(), session.core().refusal()));
  if (session.unanswered()) throw std::runtime_error(session.no_answer());
  throw std::runtime_error(fmt::format("{}: no shape to draw within {:.0f} s", session.server(), seconds(now_us() - since)));
}

SceneView::Frame frame_of(const ViewOptions& options) {
  return {static_cast<float>(options.width) / static_cast<float>(options.height),
          covered_by_panels(options.look, options.width, options.height, 1)};
}

/// Watches until `time`, so that plots and scales of a first picture are those of a viewer that has run for a while.
void watch_until(Micros time, const ViewOptions& options, ViewSession& session, SceneView& view) {
  for (Micros now = now_us(); now < time && !stop_requested(); now = now_us()) {
    session.pump_until(std::min(time, now + History::kStep));
    view.update(now_us(), frame_of(options));
    view.caption(now_us());
  }
}

Picture take_picture(const ViewOptions& options, Micros now, SceneView& view, Stage& stage) {
  view.update(now, frame_of(options));
  Caption caption = view.caption(now);
  if (caption.replay && !options.look.panels) {  // for a page: no bar to click, no text over the picture
    caption.replay.reset();
    caption.status.clear();
  }
  return stage.photograph(view.sight(), caption, view.camera(), options.look, options.width, options.height);
}

std::filesystem::path frame_file(const ViewOptions& options, int number) {
  return std::filesystem::path(options.frames) / fmt::format("frame_{:05d}.png", number);
}

void take_frames(const ViewOptions& options, ViewSession& session, SceneView& view, Stage& stage, Micros start) {
  const Micros period = from_seconds(1 / options.fps), end = start + from_seconds(options.duration_s.value_or(10));
  int number = 0;
  for (Micros due = now_us(); due < end && !stop_requested();) {
    session.pump_until(due);
    if (stop_requested()) return;
    write_png(frame_file(options, number++), take_picture(options, now_us(), view, stage));
    // A frame's number is its time: frames that there was no time for are missing from both.
    due += period;
    if (due < now_us()) due = now_us();
  }
}

}  // namespace

void run_offscreen(const ViewOptions& options, ViewSession& session) {
  const Micros start = now_us();
  // Software rendering next to a server or a haptic loop must have lower priority. A refusal does no harm.
  setpriority(PRIO_PROCESS, 0, 10);
  const double first_s =
      options.frames.empty() ? options.after_s.value_or(options.duration_s.value_or(2)) : options.after_s.value_or(0);
  SceneView view(session, options.camera);
  watch_until(start + from_seconds(first_s), options, session, view);
  wait_for_shape(session, start);
  if (stop_requested()) return;
  const OffscreenContext context;
  Stage stage(options.width, options.height, 1.0F);
  session.pump();
  if (!options.screenshot.empty()) write_png(options.screenshot, take_picture(options, now_us(), view, stage));
  if (!options.frames.empty()) take_frames(options, session, view, stage, start);
}

void run_offscreen(const ViewOptions& options, RecordedSource& recording) {
  setpriority(PRIO_PROCESS, 0, 10);
  SceneView view(recording, options.camera);
  const OffscreenContext context;
  Stage stage(options.width, options.height, 1.0F);
  // The clock stands still: a picture depends only on its moment.
  ReplayClock& clock = recording.clock();
  const Micros now = now_us(), begin = clock.at(now);
  if (!options.screenshot.empty()) write_png(options.screenshot, take_picture(options, now, view, stage));
  if (options.frames.empty()) return;
  const Micros asked = options.duration_s ? begin + from_seconds(*options.duration_s) : clock.end();
  for (int number = 0; !stop_requested(); ++number) {
    const Micros moment = begin + from_seconds(number / options.fps);
    if (moment > std::min(asked, clock.end())) return;
    clock.seek(moment, now);
    write_png(frame_file(options, number), take_picture(options, now, view, stage));
  }
}

}  // namespace palpate
