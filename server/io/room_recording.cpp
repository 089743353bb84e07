#include "server/io/room_recording.hpp"

#include <chrono>
#include <system_error>
#include <utility>

#include "common/base/error.hpp"
#include "common/io/monotonic.hpp"

namespace palpate {
namespace {

RecordedEvent joined_before(const StationReport& station, Micros now) {
  const auto role = station.role == Role::viewer ? RecordedRole::viewer
                    : station.shadow_of.empty()  ? RecordedRole::hand
                                                 : RecordedRole::shadow;
  return {now, RecordedEventKind::joined, station.id, role, station.scheme, station.name, "before this recording", station.tool};
}

}  // namespace

std::unique_ptr<RoomRecorder> RoomRecording::make_recorder() const {
  RecordingHead head = head_;
  head.clock_time = monotonic_now();
  head.unix_time = std::chrono::duration_cast<Micros>(std::chrono::system_clock::now().time_since_epoch());
  return std::make_unique<RoomRecorder>(head);
}

void RoomRecording::begin(const std::filesystem::path& file) {
  auto recorder = make_recorder();
  file_ = std::make_unique<RecordFile>("--record", file, recorder->take());
  recorder_ = std::move(recorder);
}

std::optional<RoomRecording::News> RoomRecording::tick(const ServerCore& core, Micros now) {
  if (!recorder_) return try_again(core, now);
  recorder_->tick(core, now);
  file_->write(recorder_->take());
  const auto fault = file_->fault();
  if (!fault) return std::nullopt;
  recorder_.reset();
  put_off(now);
  return News{true, *fault, asked_};
}

std::optional<RoomRecording::News> RoomRecording::try_again(const ServerCore& core, Micros now) {
  if (!opening_.valid()) {
    if (now < next_try_) return std::nullopt;
    put_off(now);
    next_recorder_ = make_recorder();
    if (file_) written_before_ += file_->written();
    try {
      // The failed file is closed on that thread as well, as a call to its disk may never return.
      opening_ = std::async(std::launch::async, [failed = std::shared_ptr(std::move(file_)), asked = asked_,
                                                 head = next_recorder_->take()]() mutable {
        failed.reset();
        Begun begun{series_of("--record", asked).next, nullptr};
        begun.file = std::make_unique<RecordFile>("--record", begun.name, std::move(head));
        return begun;
      });
    } catch (const std::system_error&) {
    }  // no thread available: try again later
    return std::nullopt;
  }
  if (opening_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return std::nullopt;
  try {
    Begun begun = opening_.get();
    file_ = std::move(begun.file);
    recorder_ = std::move(next_recorder_);
    for (const StationReport& station : core.stations()) recorder_->event(joined_before(station, now));
    return News{false, "the recording goes on in " + begun.name.string(), begun.name};
  } catch (const InputError&) {
    put_off(now);  // the reason was reported when it ended
    return std::nullopt;
  }
}

std::optional<std::string> RoomRecording::finish() {
  if (!recorder_) return std::nullopt;
  recorder_->finish();
  file_->write(recorder_->take());
  recorder_.reset();
  return file_->close();
}

}  // namespace palpate
