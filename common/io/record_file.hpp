// A file written by a thread of its own, so that the caller never waits for a disk.
//
// It must be a new file at the start, so that no recording is overwritten (devices and pipes are exempt), and the first bytes
// must be written. It is locked (flock) while it is open. A later failure of writing or syncing, and the removal of the file, end
// the writing: fault() returns the reason, once, and later bytes are dropped. Bytes handed over survive the end of the program
// within moments, and a power cut after at most a second (fdatasync).
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
  using Sync = std::function<int(int descriptor)>;        ///< returns an error number, 0 for none
  static constexpr std::size_t kMostWaiting = 64u << 20;  ///< bytes; a disk that is slower for this long has failed

  /// Creates the folder of the file and writes `first` before it returns. Throws InputError, with `flag` and the file, when it
  /// exists or cannot be written. `sync` replaces fdatasync() in tests of failures.
  RecordFile(const std::string& flag, const std::filesystem::path& file, std::vector<std::byte> first, Sync sync = {});
  /// Calls close().
  ~RecordFile();
  RecordFile(const RecordFile&) = delete;
  RecordFile& operator=(const RecordFile&) = delete;

  void write(std::vector<std::byte> bytes);
  /// Returns the reason when writing has failed, in a line for a person; once.
  std::optional<std::string> fault();
  /// Writes the rest and waits until the disk has it; returns the reason of a failure if it was not returned before. Nothing is
  /// written after it.
  std::optional<std::string> close();
  /// Any thread: true when writing has failed; number of bytes written.
  bool failed() const { return failed_; }
  std::uint64_t written() const { return written_; }

 private:
  void run();
  void fail(const std::string& why);
  void put_on_disk(std::unique_lock<std::mutex>& lock);

  std::filesystem::path file_;
  Sync sync_;
  int descriptor_ = -1;
  std::mutex mutex_;  ///< guards all members below
  std::condition_variable more_;
  std::deque<std::vector<std::byte>> waiting_;
  std::size_t waiting_bytes_ = 0;
  bool ending_ = false;
  std::atomic<bool> failed_ = false;
  std::optional<std::string> fault_;
  std::atomic<std::uint64_t> written_ = 0;
  std::thread thread_;
};

/// Returns the name of a room or station as part of a file name: any character but letters, digits, dashes, underscores and inner
/// dots becomes an underscore.
std::string plain_name(const std::string& name);

/// Inserts the room's plain name into FILE: "session.rec" and "liver" make "session-liver.rec".
std::filesystem::path named_after(const std::filesystem::path& file, const std::string& room);

/// The files of one recording that was continued after each start: FILE, then FILE with .2, .3 ... before the extension.
struct RecordSeries {
  std::vector<std::filesystem::path> there;  ///< existing ones with any content, the newest first
  std::filesystem::path next;                ///< name after all of them
};
/// Throws InputError, with `flag`, when the folder cannot be read or a program still writes one of them.
RecordSeries series_of(const std::string& flag, const std::filesystem::path& file);

}  // namespace palpate
