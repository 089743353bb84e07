#include "client/web/app/replay_page.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "client/viewer/status_line.hpp"
#include "client/web/summary_message.hpp"
#include "common/io/monotonic.hpp"

namespace palpate {
namespace {

constexpr double kMostSteps = 1e6, kFarthestS = 1e9;

}  // namespace

ReplayPage::ReplayPage(const std::string& file)
    : bytes_(file),
      recording_(bytes_.bytes(), file),
      scene_(recording_, file),
      unit_m_(shape_unit_m(scene_.mesh().triangles, scene_.rest())),
      summary_(text_packet(summary_message(recording_))) {
  std::vector<PageNote> notes;
  for (const RecordedNote& note : scene_.notes()) notes.push_back({seconds(note.about), note.author, note.text});
  notes_ = text_packet(notes_message(notes));
}

std::string ReplayPage::damage() const {
  if (scene_.damaged_blocks() > 0)
    return fmt::format("{} of {} blocks are damaged and left out", scene_.damaged_blocks(), recording_.blocks().size());
  return recording_.complete() ? "" : recording_.damage() + "; what can be read is shown";
}

void ReplayPage::joined(BrowserId id) { browsers_.emplace(id, Watcher{ReplayClock(scene_.begin(), scene_.end())}); }

void ReplayPage::said(BrowserId id, std::string_view text) {
  const auto at = browsers_.find(id);
  if (at == browsers_.end()) return;
  Watcher& watcher = at->second;
  const PageRequest request = read_request(text);
  const Micros now = monotonic_now();
  using Kind = PageRequest::Kind;
  switch (request.kind) {
    case Kind::none:
    case Kind::room:
    case Kind::note:
      return;
    case Kind::seek:
      watcher.clock.seek(from_seconds(std::clamp(request.value, -kFarthestS, kFarthestS)), now);
      break;
    case Kind::play:
      if (!watcher.clock.playing(now)) watcher.clock.toggle(now);
      break;
    case Kind::pause:
      watcher.clock.pause(now);
      break;
    case Kind::speed:
      watcher.clock.double_speed(static_cast<int>(std::lround(std::clamp(request.value, -10.0, 10.0))), now);
      break;
    case Kind::step:
      watcher.clock.pause(now);
      watcher.clock.seek(
          watcher.clock.at(now) + std::lround(std::clamp(request.value, -kMostSteps, kMostSteps)) * scene_.period(), now);
      break;
  }
  watcher.sought = request.kind != Kind::pause && request.kind != Kind::speed;
  next_shape_ = next_room_ = now;
}

void ReplayPage::greet(WebServer& web, BrowserId id) {
  web.send(id, Slot::hello,
           text_packet(hello_message({.program = kPageProgram,
                                      .live = false,
                                      .begin_s = seconds(scene_.begin()),
                                      .end_s = seconds(scene_.end()),
                                      .period_s = seconds(scene_.period()),
                                      .course = scene_.course(),
                                      .hands = scene_.hands(),
                                      .force_max_n = scene_.force_max_n(),
                                      .displacement_max_m = scene_.displacement_max_m()})));
  if (!scene_.parts().empty()) web.send(id, Slot::parts, binary_packet(parts_frame(scene_.parts())));
  web.send(id, Slot::notes, notes_);
  web.send(id, Slot::summary, summary_);
}

void ReplayPage::show(WebServer& web, BrowserId id, Watcher& watcher) {
  const ViewMoment moment = scene_.at(watcher.shown);
  if (std::exchange(watcher.mesh, scene_.mesh_version()) != scene_.mesh_version())
    web.send(id, Slot::mesh, binary_packet(mesh_frame(scene_.mesh(), scene_.rest(), scene_.mesh_version(), unit_m_)));
  web.send(id, Slot::shape, binary_packet(shape_frame(moment, scene_.rest(), scene_.mesh_version(), unit_m_)));
}

void ReplayPage::say_room(WebServer& web, BrowserId id, const ReplayClock& clock, Micros now) const {
  const Micros t = clock.at(now);
  const RoomView room = scene_.room_at(t);
  const TaskWatch task = scene_.task_at(t);
  const std::string missing = damage();
  web.send(id, Slot::room,
           text_packet(room_message({.title = recording_.head().name,
                                     .status = status_line(recording_.head(), scene_.mesh().triangles.size()) +
                                               (missing.empty() ? "" : "    " + missing),
                                     .live = false,
                                     .late_known = false,
                                     .t_s = seconds(t),
                                     .speed = clock.speed(),
                                     .playing = clock.playing(now),
                                     .room = &room,
                                     .task = &task})));
}

Micros ReplayPage::tick(WebServer& web, Micros now) {
  const bool shape_due = now >= next_shape_, room_due = now >= next_room_;
  if (shape_due) next_shape_ = now + kShapeEvery;
  if (room_due) next_room_ = now + kRoomEvery;
  for (auto& [id, watcher] : browsers_) {
    if (shape_due) {
      if (watcher.mesh == 0) greet(web, id);
      const Micros t = watcher.clock.at(now);
      if (std::exchange(watcher.sought, false)) {
        History forces, patch_ages;
        scene_.plot(t, forces, patch_ages);
        web.send(id, Slot::history, text_packet(history_message(forces)));
      }
      if (std::exchange(watcher.shown, t) != t) show(web, id, watcher);
    }
    if (room_due) say_room(web, id, watcher.clock, now);
  }
  return std::min(next_shape_, next_room_);
}

}  // namespace palpate
