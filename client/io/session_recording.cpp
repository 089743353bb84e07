#include "client/io/session_recording.hpp"

#include <chrono>

#include "common/io/monotonic.hpp"

namespace palpate {
namespace {

RecordingHead head_of(const std::string& program, const std::string& station) {
  RecordingHead head;
  head.kind = RecordingKind::station;
  head.program = program;
  head.name = station;
  head.clock_time = monotonic_now();
  head.unix_time = std::chrono::duration_cast<Micros>(std::chrono::system_clock::now().time_since_epoch());
  head.rate_hz = kHapticRateHz;
  return head;
}

}  // namespace

SessionRecording::SessionRecording(const std::filesystem::path& file, const std::string& program, const std::string& station,
                                   const std::string& tool)
    : recorder_(head_of(program, station), tool), file_("--record", file, recorder_.take()) {}

void SessionRecording::datagram(const ClientCore& core, std::span<const std::byte> bytes, Micros now) {
  const std::lock_guard lock(mutex_);
  recorder_.datagram(core, bytes, now);
}

void SessionRecording::tick(const TickRecord& tick, const DisplayRecord& felt) {
  const std::lock_guard lock(mutex_);
  recorder_.tick({tick.t, tick.position, tick.model.force, felt.wrench.force, tick.patch_age, tick.has_patch, felt.contact, false,
                  tick.model.torque, felt.wrench.torque});
  if (tick.swapped) recorder_.hand_over({tick.t, tick.t - tick.patch_age, tick.step_n});
  recorder_.hold(tick.t, tick.orientation, tick.opening, tick.buttons);
}

void SessionRecording::event(Micros t, RecordedEventKind kind, const std::string& text) {
  const std::lock_guard lock(mutex_);
  recorder_.event(t, kind, text);
}

std::optional<std::string> SessionRecording::look(const ClientStatus& status, Micros now) {
  const std::lock_guard lock(mutex_);
  recorder_.look(status.link, status.welcome, status.refusal, status.pace, now);
  file_.write(recorder_.take());
  return file_.fault();
}

void SessionRecording::finish() {
  const std::lock_guard lock(mutex_);
  recorder_.finish();
  file_.write(recorder_.take());
}

}  // namespace palpate
