#include "client/view/app/recorded_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <thread>

#include "client/view/app/session.hpp"
#include "client/viewer/status_line.hpp"
#include "common/base/error.hpp"

namespace palpate {

RecordedSource::RecordedSource(const std::string& file)
    : bytes_(file), recording_(bytes_.bytes(), file), scene_(recording_, file), clock_(scene_.begin(), scene_.end()) {}

void RecordedSource::pump_until(Micros time) {
  constexpr Micros kMost{20'000};  // limit of the delay after a request to end
  for (Micros now = now_us(); now < time && !stop_requested(); now = now_us())
    std::this_thread::sleep_for(std::min(kMost, time - now));
}

bool RecordedSource::show(Micros now, ViewMoment& moment) {
  const Micros t = clock_.at(now);
  moment = scene_.at(t);
  room_ = scene_.room_at(t);
  task_ = scene_.task_at(t);
  scene_.plot(t, forces_, patch_ages_);
  return true;
}

Scales RecordedSource::scales() const {
  Scales scales;
  scales.expect(scene_.displacement_max_m(), scene_.force_max_n());
  return scales;
}

Caption RecordedSource::caption(Micros now, const std::vector<ToolView>&) {
  Caption caption{recording_.head().name, "", ""};
  caption.status = channel_ == ShapeChannel::position
                       ? status_line(recording_.head(), scene_.mesh().triangles.size())
                       : "neither tensions nor the reach of patches are recorded: colours show displacement";
  caption.panels = {
      .room = &room_, .late_known = false, .forces = &forces_, .patch_ages = &patch_ages_, .stations = {}, .now = clock_.at(now)};
  caption.task = &task_;
  caption.replay = state(now);
  return caption;
}

void RecordedSource::begin_at(double at_s) {
  const double length_s = seconds(clock_.end() - clock_.begin());
  if (at_s > length_s)
    throw InputError(fmt::format("--at {:g}", at_s), "is after the end of the recording",
                     fmt::format("0 to {:.3f} s", std::floor(1e3 * length_s) / 1e3));  // rounded down to an accepted value
  clock_.seek(clock_.begin() + from_seconds(at_s), now_us());
}

ReplayState RecordedSource::state(Micros now) const {
  return {clock_.begin(), clock_.end(), clock_.at(now), clock_.speed(), clock_.playing(now), scene_.course(), scene_.notes()};
}

void RecordedSource::step(int frames, Micros now) {
  clock_.pause(now);
  clock_.seek(clock_.at(now) + frames * scene_.period(), now);
}

std::string RecordedSource::damage() const {
  if (scene_.damaged_blocks() > 0)
    return fmt::format("{} of {} blocks are damaged and left out", scene_.damaged_blocks(), recording_.blocks().size());
  return recording_.complete() ? "" : recording_.damage() + "; what can be read is shown";
}

}  // namespace palpate
