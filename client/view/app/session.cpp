#include "client/view/app/session.hpp"

#include <fmt/format.h>

#include <csignal>
#include <filesystem>
#include <utility>

#include "client/viewer/status_line.hpp"
#include "common/base/error.hpp"
#include "common/io/monotonic.hpp"

namespace palpate {
namespace {

volatile std::sig_atomic_t g_end = 0;

}  // namespace

void watch_signals() {
  for (const int signal : {SIGINT, SIGTERM}) std::signal(signal, [](int) { g_end = 1; });
}
bool stop_requested() { return g_end != 0; }

Micros now_us() { return monotonic_now(); }

ViewSession::ViewSession(const std::string& server, const std::string& station, const std::string& room, bool alike,
                         const std::optional<ClientKeys>& keys, NameLookup::Ask ask)
    : udp_(server, station, room, alike, keys, std::move(ask)) {}

ViewSession::~ViewSession() = default;

void ViewSession::pump() {
  udp_.pump();
  pump_recording();
}

void ViewSession::record(const std::string& file) {
  if (std::filesystem::exists(file)) throw InputError("--record " + file, "is there already", "a file that is not there yet");
  record_asked_ = file;
}

void ViewSession::toggle_recording() {
  if (recording_) {
    record_note_ = "recorded to " + recording_->file();
    recording_.reset();
  } else if (record_asked_.empty()) {
    record_asked_ = file_for_now(core().welcome().scene);
  }
}

void ViewSession::pump_recording() {
  if (!recording_) {
    if (record_asked_.empty() || !core().ready() || !core().has_parts()) return;
    const std::string file = std::exchange(record_asked_, {});
    try {
      recording_ = std::make_unique<ViewerRecording>(core(), file);
      record_note_ = "recording to " + file;
    } catch (const InputError& error) {
      record_note_ = error.what();
      fmt::print(stderr, "palpate-view: {}\n", record_note_);
    }
    return;
  }
  if (const auto ended = recording_->pump(core(), now_us())) {
    record_note_ = *ended;
    recording_.reset();
  }
}

void ViewSession::pump_until(Micros time) {
  while (!stop_requested()) {
    pump();
    const Micros now = now_us();
    if (now >= time) return;
    udp_.nap(time);
  }
}

bool ViewSession::show(Micros now, ViewMoment& moment) {
  if (!core().show(now, moment)) return false;
  if (!core().heard_lately(now)) moment.tools.clear();
  return true;
}

void ViewSession::remember(Micros now, const std::vector<ToolView>& tools) {
  if (core().heard_lately(now)) {
    for (const ToolView& tool : tools) forces_.add(now, tool.station, static_cast<float>(tool.force.norm()));
    for (const StationView& station : core().room().stations)
      patch_ages_.add(now, station.station, static_cast<float>(1e3 * seconds(station.patch_age)));
  }
  forces_.forget(now);
  patch_ages_.forget(now);
}

Caption ViewSession::caption(Micros now, const std::vector<ToolView>& tools) {
  if (core().link() == LinkState::refused) return {"refused", core().refusal(), ""};
  if (!core().ready()) return {"palpate", udp_.unanswered() ? udp_.no_answer() : "waiting for " + server(), ""};
  remember(now, tools);
  Caption caption{core().welcome().scene, status_line(core(), now), ""};
  caption.panels = {.room = &core().room(),
                    .holds = core().heard_lately(now),
                    .forces = &forces_,
                    .patch_ages = &patch_ages_,
                    .stations = {},
                    .now = now};
  caption.task = &core().task();
  if (!record_note_.empty()) caption.status += "    " + record_note_;
  return caption;
}

}  // namespace palpate
