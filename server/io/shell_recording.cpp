// The server's recordings: a recorder and a file per room, and bodies resumed from earlier recordings.
#include <spdlog/fmt/fmt.h>

#include <chrono>
#include <iterator>
#include <optional>

#include "common/base/error.hpp"
#include "common/io/mapped_file.hpp"
#include "common/io/monotonic.hpp"
#include "server/core/room_info.hpp"
#include "server/io/udp_server.hpp"
#include "server/record/resume.hpp"
#include "server/scene/tools.hpp"

namespace palpate {
namespace {

Micros unix_time_now() { return std::chrono::duration_cast<Micros>(std::chrono::system_clock::now().time_since_epoch()); }

RecordingHead head_of(const NamedScene& named, const ShellOptions& options) {
  RecordingHead head;
  head.kind = RecordingKind::room;
  head.program = options.record.program;
  head.name = named.name;
  head.rate_hz = options.rate_hz;
  head.shapes_hz = options.record.shapes_hz;
  head.scene = named.text;
  head.scene_file = named.file;
  head.surface = recorded_surface(named.scene);
  head.task = named.scene.task;
  head.tool = drawn_shape(named.scene.tool);
  RoomInfo facts = facts_of(named.scene, Vec3::Zero());
  head.parts = std::move(facts.parts);
  head.bodies = std::move(facts.bodies);
  return head;
}

}  // namespace

void UdpServer::begin_recording(const std::vector<NamedScene>& scenes, const ShellOptions& options) {
  for (std::size_t k = 0; k < workers_.size(); ++k) {
    RoomWorker& body = *workers_[k];
    const std::filesystem::path asked = options.record.file;
    const auto file = workers_.size() > 1 ? named_after(asked, scenes[k].name) : asked;
    const RecordSeries series = options.record.resume ? series_of("--record", file) : RecordSeries{{}, file};
    resume(k, scenes[k], series.there);
    body.recording.emplace(head_of(scenes[k], options), file);
    try {
      body.recording->begin(series.next);
    } catch (const InputError& fault) {
      if (series.there.empty()) throw;
      // Hands wait for this server: a full disk must not keep it from starting.
      say_recording_failed(k, fault.what());
      body.recording->put_off(monotonic_now());
    }
    cores_[k].on_buttons([&body](StationId id, const ButtonChange& change) {
      if (RoomRecorder* const recorder = body.recorder()) recorder->buttons(id, change);
    });
  }
}

/// Resumes from the newest file with a checkpoint: a recording that ended before its first checkpoint, or was cut at its
/// beginning by a full disk or a crash, is passed over. If no file can be read, the server refuses to start, so that somebody has
/// a look.
void UdpServer::resume(std::size_t k, const NamedScene& named, const std::vector<std::filesystem::path>& newest_first) {
  std::optional<ResumePoint> found;
  std::filesystem::path from;
  const auto pass_over = [&](const std::filesystem::path& file, const InputError& fault) {
    say(k, "resume_skipped", std::string("warning: ") + fault.what(), {{"file", file.string()}, {"reason", fault.what()}},
        EventLevel::warning);
  };
  for (auto file = newest_first.begin(); file != newest_first.end() && !found; ++file) {
    const std::string where = "--resume from " + file->string();
    const MappedFile mapped(*file);
    std::optional<RecordingReader> recording;
    try {
      recording.emplace(mapped.bytes(), where);
    } catch (const CutRecording& fault) {
      pass_over(*file, fault);
      continue;
    } catch (const InputError& fault) {
      if (from.empty() && std::next(file) == newest_first.end()) throw;
      pass_over(*file, fault);
      continue;
    }
    from = *file;
    found = newest_checkpoint(*recording, where, named.name, named.scene);
  }
  if (newest_first.empty()) return;
  if (from.empty()) return say(k, "resumed", "no recording says how the body was: it is at rest", {});
  if (!found) return say(k, "resumed", from.string() + " has no checkpoint: the body is at rest", {{"file", from.string()}});
  const RecordedCheckpoint& newest = found->checkpoint;
  if (!workers_[k]->room.resume(in_a_row(newest.positions), in_a_row(newest.velocities), newest.relaxed, steps_of(newest.cuts),
                                threads_of(newest.threads, named.scene.body)))
    say(k, "resumed", from.string() + " does not know how far the body's stress has faded: it begins as if it had just been bent",
        {{"file", from.string()}});
  workers_[k]->absent = ReservedTools(found->checkpoint.holds, named.scene);
  const double age_s = seconds(unix_time_now() - found->unix_time);
  const std::size_t tools = found->checkpoint.holds.size();
  say(k, "resumed",
      fmt::format("the body is as {} had it {:.1f} s ago; tools that stay on it {:g} s for their stations to come back: {}",
                  from.string(), age_s, seconds(ReservedTools::kLongest), tools),
      {{"file", from.string()}, {"age_s", age_s}, {"tools", static_cast<double>(tools)}});
}

/// Writes what was recorded to the files, five times a second.
void UdpServer::record() {
  bool any = false;
  for (std::size_t k = 0; k < workers_.size(); ++k) {
    RoomWorker& body = *workers_[k];
    if (!body.recording) continue;
    any = true;
    const auto news = body.recording->tick(cores_[k], monotonic_now());
    if (news && news->ended) say_recording_failed(k, news->text);
    if (news && !news->ended) say(k, "recording_again", news->text, {{"file", news->file.string()}});
  }
  if (!any) return;
  record_timer_.expires_after(kRecordEvery);
  record_timer_.async_wait([this](const asio::error_code& fault) {
    if (!fault) record();
  });
}

void UdpServer::end_recording() {
  for (std::size_t k = 0; k < workers_.size(); ++k) {
    RoomWorker& body = *workers_[k];
    if (!body.recording) continue;
    if (const auto fault = body.recording->finish()) say_recording_failed(k, *fault);
    body.recording.reset();
  }
}

void UdpServer::say_recording_failed(std::size_t room, const std::string& fault) const {
  say(room, "recording_failed", "warning: " + fault, {{"reason", fault}}, EventLevel::error);
}

}  // namespace palpate
