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

constexpr Micros kPatience{10'000'000};  // beyond the moment of the picture, for a first shape to come

void wait_for_shape(ViewSession& session, Micros since) {
  const Micros until = now_us() + kPatience;
  while (!session.core().ready() && now_us() < until && !told_to_end()) session.pump_until(now_us() + Micros{20'000});
  if (session.core().ready() || told_to_end()) return;
  if (session.core().link() == ViewLink::refused)
    throw std::runtime_error(fmt::format("{}: refused: {}", session.server(), session.core().refusal()));
  throw std::runtime_error(fmt::format("{}: no shape to draw within {:.0f} s", session.server(), seconds(now_us() - since)));
}

float aspect_of(const ViewOptions& options) { return static_cast<float>(options.width) / static_cast<float>(options.height); }

/// Watches on until then, so that the plots and scales of a first picture are those of someone who has looked for a while.
void watch_until(Micros time, const ViewOptions& options, ViewSession& session, SceneView& view) {
  while (now_us() < time && !told_to_end()) {
    session.pump_until(std::min(time, now_us() + History::kStep));
    view.update(session, aspect_of(options));
  }
}

Picture take_picture(const ViewOptions& options, ViewSession& session, SceneView& view, Stage& stage) {
  session.pump();
  view.update(session, aspect_of(options));
  return stage.photograph(view.sight(session), view.caption(session, ""), view.camera(), options.look, options.width,
                          options.height);
}

void take_frames(const ViewOptions& options, ViewSession& session, SceneView& view, Stage& stage, Micros start) {
  std::filesystem::create_directories(options.frames);
  const Micros period = from_seconds(1 / options.fps), end = start + from_seconds(options.duration_s.value_or(10));
  int number = 0;
  for (Micros due = now_us(); due < end && !told_to_end();) {
    session.pump_until(due);
    if (told_to_end()) return;
    write_png(std::filesystem::path(options.frames) / fmt::format("frame_{:05d}.png", number++),
              take_picture(options, session, view, stage));
    // The number of a frame is its time: frames that there was no time for are left out of both.
    due += period;
    if (due < now_us()) due = now_us();
  }
}

}  // namespace

void run_offscreen(const ViewOptions& options, ViewSession& session) {
  const Micros start = now_us();
  // Drawing in software beside a server or a haptic loop must give way to them. Refusal does no harm.
  setpriority(PRIO_PROCESS, 0, 10);
  const double first_s =
      options.frames.empty() ? options.after_s.value_or(options.duration_s.value_or(2)) : options.after_s.value_or(0);
  SceneView view;
  watch_until(start + from_seconds(first_s), options, session, view);
  wait_for_shape(session, start);
  if (told_to_end()) return;
  const OffscreenContext context;
  Stage stage(options.width, options.height, 1.0F);
  if (!options.screenshot.empty()) write_png(options.screenshot, take_picture(options, session, view, stage));
  if (!options.frames.empty()) take_frames(options, session, view, stage, start);
}

}  // namespace palpate
