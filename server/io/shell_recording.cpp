// The server's recordings: a recorder and a file for each room.
#include <chrono>

#include "common/io/monotonic.hpp"
#include "server/io/server_shell.hpp"

namespace palpate {
namespace {

RecordingHead head_of(const NamedScene& named, const ShellOptions& options) {
  RecordingHead head;
  head.kind = RecordingKind::room;
  head.program = options.record.program;
  head.name = named.name;
  head.clock_time = monotonic_now();
  head.unix_time = std::chrono::duration_cast<Micros>(std::chrono::system_clock::now().time_since_epoch());
  head.rate_hz = options.rate_hz;
  head.shapes_hz = options.record.shapes_hz;
  head.scene = named.text;
  head.scene_file = named.file;
  head.surface = recorded_surface(named.scene);
  return head;
}

}  // namespace

void ServerShell::begin_recording(const std::vector<NamedScene>& scenes, const ShellOptions& options) {
  for (std::size_t k = 0; k < bodies_.size(); ++k) {
    Body& body = *bodies_[k];
    body.recorder = std::make_unique<RoomRecorder>(head_of(scenes[k], options));
    const std::filesystem::path asked = options.record.file;
    const auto file = bodies_.size() > 1 ? named_after(asked, scenes[k].name) : asked;
    body.file = std::make_unique<RecordFile>("--record", file, body.recorder->take());
    cores_[k].on_buttons([&body](StationId id, const ButtonChange& change) { body.recorder->buttons(id, change); });
  }
}

/// Five times a second what gathered goes to the files.
void ServerShell::record() {
  for (std::size_t k = 0; k < bodies_.size(); ++k) {
    Body& body = *bodies_[k];
    if (!body.recorder) return;
    body.recorder->tick(cores_[k], monotonic_now());
    body.file->write(body.recorder->take());
    if (const auto fault = body.file->fault()) say_recording_failed(k, *fault);
  }
  record_timer_.expires_after(kRecordEvery);
  record_timer_.async_wait([this](const asio::error_code& fault) {
    if (!fault) record();
  });
}

void ServerShell::end_recording() {
  for (std::size_t k = 0; k < bodies_.size(); ++k) {
    Body& body = *bodies_[k];
    if (!body.recorder) continue;
    body.recorder->finish();
    body.file->write(body.recorder->take());
    if (const auto fault = body.file->close()) say_recording_failed(k, *fault);
    body.recorder.reset();
  }
}

void ServerShell::say_recording_failed(std::size_t room, const std::string& fault) const {
  say(room, "recording_failed", "warning: " + fault, {{"reason", fault}}, EventLevel::error);
}

}  // namespace palpate
