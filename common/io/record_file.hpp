// A file that is written behind by a thread of its own: whoever has bytes for it never waits for a disk.
//
// At the start it must be a new file, so that no recording is overwritten (devices and pipes are taken as they are), and the
// first bytes must reach it. It is locked (flock) while it is written. Later failures, of writing and of putting on the disk, and
// the file's removal end the writing: fault() says why, once, and the bytes that come then are dropped. What was handed over
// survives the end of the program within moments, and a power cut after at most a second (fdatasync).
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <filesystem>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

namespace palpate {

class RecordFile {
 public:
  using Sync = std::function<int(int descriptor)>;        ///< the error, 0 for none
  static constexpr std::size_t kMostWaiting = 64u << 20;  ///< bytes; a disk slower than that for long has failed

  /// Makes the folder it lies in and writes `first` before it returns. InputError, with `flag` and the file, when it exists or
  /// cannot be written. `sync` in place of fdatasync(), to break it.
  RecordFile(const std::string& flag, const std::filesystem::path& file, std::vector<std::byte> first, Sync sync = {});
  /// close().
  ~RecordFile();
  RecordFile(const RecordFile&) = delete;
  RecordFile& operator=(const RecordFile&) = delete;

  void write(std::vector<std::byte> bytes);
  /// Why nothing is written any more, in a line for a person; told once.
  std::optional<std::string> fault();
  /// Writes what is left and waits until the disk has it; why it could not, if nobody was told. Nothing is written after it.
  std::optional<std::string> close();
  /// Any thread: whether nothing is written any more, and the bytes that were.
  bool failed() const { return failed_; }
  std::uint64_t written() const { return written_; }

 private:
  void run();
  void fail(const std::string& why);
  void put_on_disk(std::unique_lock<std::mutex>& lock);

  std::filesystem::path file_;
  Sync sync_;
  int descriptor_ = -1;
  std::mutex mutex_;  ///< of all below
  std::condition_variable more_;
  std::deque<std::vector<std::byte>> waiting_;
  std::size_t waiting_bytes_ = 0;
  bool ending_ = false;
  std::atomic<bool> failed_ = false;
  std::optional<std::string> fault_;
  std::atomic<std::uint64_t> written_ = 0;
  std::thread thread_;
};

/// A name of a room or station as part of a file's name: what is no letter, digit, dash, underscore or inner dot becomes an
/// underscore.
std::string plain_name(const std::string& name);

/// FILE with the room's plain name in it: "session.rec" and "liver" make "session-liver.rec".
std::filesystem::path named_after(const std::filesystem::path& file, const std::string& room);

/// The files of one recording that went on after each start: FILE, then FILE with .2, .3 ... before the extension.
struct RecordSeries {
  std::vector<std::filesystem::path> there;  ///< that have anything in them, the newest first
  std::filesystem::path next;                ///< later than all
};
/// InputError, with `flag`, when the folder cannot be looked into or a program still writes one of them.
RecordSeries series_of(const std::string& flag, const std::filesystem::path& file);

}  // namespace palpate
