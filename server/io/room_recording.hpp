// The recording of one room: a recorder, the file behind it, and the next file of its series once one cannot be written on.
//
// A file that fails (a full disk, one that was removed) ends there, as a block that is missing would leave a hole. Every
// kAgainEvery from then on the next of the series (record_file.hpp) is tried, on a thread of its own: the network thread waits
// for no disk. It begins with the stations that are there.
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

  /// `head` without its times.
  RoomRecording(RecordingHead head, std::filesystem::path file) : head_(std::move(head)), asked_(std::move(file)) {}

  /// Into `file`. InputError when it cannot be begun: it is not on then.
  void begin(const std::filesystem::path& file);
  /// It could not be begun: the next file is tried in kAgainEvery.
  void put_off(Micros now) { next_try_ = now + kAgainEvery; }
  /// Where what happens goes; nullptr while nothing is written.
  RoomRecorder* recorder() { return recorder_.get(); }

  struct News {
    bool ended = false;  ///< else it goes on
    std::string text;    ///< for a person
    std::filesystem::path file;
  };
  /// Several times a second: what gathered goes to the file.
  std::optional<News> tick(const ServerCore& core, Micros now);
  /// Why what was left could not be written.
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
