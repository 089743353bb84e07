// Recording of one room: a recorder, the file behind it, and the next file of its series after a write error.
//
// A file that fails (a full disk, a removed file) ends there, as a missing block would leave a hole. From then on the next file
// of the series (record_file.hpp) is tried every kAgainEvery, on a thread of its own, so that the network thread never waits for
// a disk. It begins with the stations present at that time.
#pragma once

#include <filesystem>
#include <future>
#include <memory>
#include <optional>
#include <string>

#include "common/io/record_file.hpp"
#include "server/io/server_state.hpp"
#include "server/record/room_recorder.hpp"

namespace palpate {

class RoomRecording {
 public:
  static constexpr Micros kAgainEvery{10'000'000};

  /// `head` is given without its times.
  RoomRecording(RecordingHead head, std::filesystem::path file) : head_(std::move(head)), asked_(std::move(file)) {}

  /// Begins to record into `file`. Throws InputError if that fails; the recording is then off.
  void begin(const std::filesystem::path& file);
  /// Schedules the next file in kAgainEvery after the first could not be begun.
  void put_off(Micros now) { next_try_ = now + kAgainEvery; }
  /// Receiver of the room's events; nullptr while nothing is recorded.
  RoomRecorder* recorder() { return recorder_.get(); }

  struct News {
    bool ended = false;  ///< true if the file ended, false if a new one continues
    std::string text;    ///< for a person
    std::filesystem::path file;
  };
  /// Writes what was recorded so far to the file; call several times a second.
  std::optional<News> tick(const ServerCore& core, Micros now);
  /// Writes the rest and closes the file; returns the error if that failed.
  std::optional<std::string> finish();

  RecordingState state() const { return recorder_ ? RecordingState::on : RecordingState::failed; }
  std::uint64_t written() const { return written_before_ + (file_ ? file_->written() : 0); }

 private:
  struct Begun {
    std::filesystem::path name;
    std::unique_ptr<RecordFile> file;
  };
  std::unique_ptr<RoomRecorder> make_recorder() const;
  std::optional<News> try_again(const ServerCore& core, Micros now);

  RecordingHead head_;
  std::filesystem::path asked_;
  std::unique_ptr<RoomRecorder> recorder_, next_recorder_;
  std::unique_ptr<RecordFile> file_;
  std::future<Begun> opening_;
  Micros next_try_{};
  std::uint64_t written_before_ = 0;
};

}  // namespace palpate
