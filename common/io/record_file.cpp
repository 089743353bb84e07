#include "common/io/record_file.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cctype>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <csignal>
#include <cstring>
#include <map>
#include <span>
#include <string_view>
#include <system_error>
#include <utility>

#include "common/base/error.hpp"
#include "common/io/make_folder.hpp"

namespace palpate {
namespace {

using Clock = std::chrono::steady_clock;
constexpr std::chrono::seconds kSyncEvery{1};

/// Returns the error number, 0 for none.
int write_all(int descriptor, std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ::ssize_t written = ::write(descriptor, bytes.data(), bytes.size());
    if (written < 0 && errno != EINTR) return errno;
    if (written > 0) bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
  return 0;
}

int open_new(const std::filesystem::path& file) {
  constexpr int kFlags = O_WRONLY | O_CREAT | O_CLOEXEC;
  constexpr ::mode_t kMode = 0644;
  const int descriptor = ::open(file.c_str(), kFlags | O_EXCL, kMode);
  struct stat about {};
  if (descriptor >= 0 || errno != EEXIST || ::stat(file.c_str(), &about) != 0 || S_ISREG(about.st_mode)) return descriptor;
  const int pipe = ::open(file.c_str(), kFlags | O_NONBLOCK, kMode);  // a pipe without a reader is not waited for
  if (pipe >= 0) ::fcntl(pipe, F_SETFL, ::fcntl(pipe, F_GETFL) & ~O_NONBLOCK);
  return pipe;
}

/// Returns true when the folder was emptied during the recording: nobody could read what is written from then on.
bool is_removed(int descriptor) {
  struct stat about {};
  return ::fstat(descriptor, &about) == 0 && S_ISREG(about.st_mode) && about.st_nlink == 0;
}

/// Returns true when another program writes it and holds the lock of RecordFile.
bool is_being_written(const std::filesystem::path& file) {
  const int descriptor = ::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (descriptor < 0) return false;
  const bool locked = ::flock(descriptor, LOCK_SH | LOCK_NB) != 0 && errno == EWOULDBLOCK;
  ::close(descriptor);
  return locked;
}

/// Syncs a file. Pipes and devices cannot be synced, and need not be.
int sync_data(int descriptor) {
  const bool fine = ::fdatasync(descriptor) == 0 || errno == EINVAL || errno == EROFS;
  return fine ? 0 : errno;
}

}  // namespace

RecordFile::RecordFile(const std::string& flag, const std::filesystem::path& file, std::vector<std::byte> first, Sync sync)
    : file_(file), sync_(sync ? std::move(sync) : sync_data) {
  const std::string where = flag + " " + file.string();
  make_folder(where, file.parent_path());
  descriptor_ = open_new(file);
  if (descriptor_ < 0 && errno == EEXIST) throw InputError(where, "is there already", "a file that is not there yet");
  if (descriptor_ < 0 && errno == ENXIO) throw InputError(where, "is a pipe that nobody reads", "one that somebody reads");
  if (descriptor_ < 0)
    throw InputError(where, std::string("cannot be made: ") + std::strerror(errno), "a path that can be written");
  if (const int fault = write_all(descriptor_, first)) {
    struct stat about {};
    const bool made_here = ::fstat(descriptor_, &about) == 0 && S_ISREG(about.st_mode);
    ::close(descriptor_);
    if (made_here) ::unlink(file.c_str());
    throw InputError(where, std::string("cannot be written: ") + std::strerror(fault), "room on the disk");
  }
  ::flock(descriptor_, LOCK_EX | LOCK_NB);  // without locks in the file system there is no warning
  written_ = first.size();
  thread_ = std::thread([this] { run(); });
}

RecordFile::~RecordFile() { close(); }

std::optional<std::string> RecordFile::close() {
  if (!thread_.joinable()) return std::nullopt;
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  more_.notify_one();
  thread_.join();
  ::close(descriptor_);
  return fault();
}

void RecordFile::write(std::vector<std::byte> bytes) {
  if (bytes.empty()) return;
  {
    const std::lock_guard lock(mutex_);
    if (failed_ || ending_) return;
    if (waiting_bytes_ + bytes.size() > kMostWaiting) return fail("the disk is too slow");
    waiting_bytes_ += bytes.size();
    waiting_.push_back(std::move(bytes));
  }
  more_.notify_one();
}

std::optional<std::string> RecordFile::fault() {
  const std::lock_guard lock(mutex_);
  return std::exchange(fault_, std::nullopt);
}

/// Fails with the lock held. A missing block would leave a hole: nothing is written after it.
void RecordFile::fail(const std::string& why) {
  failed_ = true;
  fault_ = file_.string() + ": the recording ends here, the session goes on: " + why;
  waiting_.clear();
  waiting_bytes_ = 0;
}

void RecordFile::put_on_disk(std::unique_lock<std::mutex>& lock) {
  lock.unlock();
  const int fault = sync_(descriptor_);
  const bool removed = is_removed(descriptor_);
  lock.lock();
  if (removed && !failed_) fail("the file was removed");
  if (fault && !failed_) fail(std::string("what was written did not reach the disk: ") + std::strerror(fault));
}

void RecordFile::run() {
  // A limit on the size of files is reported as an error of write(), not as a signal that would end the program.
  ::sigset_t all;
  ::sigfillset(&all);
  ::pthread_sigmask(SIG_BLOCK, &all, nullptr);
  auto synced = Clock::now();
  bool unsynced = false;
  std::unique_lock lock(mutex_);
  while (true) {
    more_.wait_for(lock, kSyncEvery, [this] { return ending_ || !waiting_.empty(); });
    while (!waiting_.empty()) {
      const std::vector<std::byte> bytes = std::move(waiting_.front());
      waiting_.pop_front();
      waiting_bytes_ -= bytes.size();
      lock.unlock();
      const int fault = write_all(descriptor_, bytes);
      lock.lock();
      unsynced = true;
      if (fault)
        fail(std::strerror(fault));
      else
        written_ += bytes.size();
    }
    if (unsynced && (ending_ || Clock::now() - synced >= kSyncEvery)) {
      put_on_disk(lock);
      synced = Clock::now();
      unsynced = false;
    }
    if (ending_ && waiting_.empty()) return;
  }
}

std::string plain_name(const std::string& name) {
  std::string plain;
  for (const char c : name) {
    const bool kept = std::isalnum(static_cast<unsigned char>(c)) || c == '-' || c == '_' || (c == '.' && !plain.empty());
    plain += kept ? c : '_';
  }
  return plain;
}

std::filesystem::path named_after(const std::filesystem::path& file, const std::string& room) {
  std::filesystem::path named = file;
  named.replace_filename(file.stem().string() + "-" + plain_name(room) + file.extension().string());
  return named;
}

namespace {

/// Returns the index of `name` in the series of `stem` and `extension`: 1 for the first; nothing for another file.
std::optional<unsigned> place_in_series(std::string_view name, std::string_view stem, std::string_view extension) {
  if (!name.starts_with(stem) || !name.ends_with(extension) || name.size() < stem.size() + extension.size()) return std::nullopt;
  std::string_view between = name.substr(stem.size(), name.size() - stem.size() - extension.size());
  if (between.empty()) return 1;
  unsigned place = 0;
  if (between.front() != '.') return std::nullopt;
  const auto [end, fault] = std::from_chars(between.data() + 1, between.data() + between.size(), place);
  const bool whole = fault == std::errc{} && end == between.data() + between.size();
  return whole && place >= 2 && between[1] != '0' ? std::optional(place) : std::nullopt;
}

}  // namespace

RecordSeries series_of(const std::string& flag, const std::filesystem::path& file) {
  const std::filesystem::path folder = file.parent_path().empty() ? "." : file.parent_path();
  const std::string stem = file.stem().string(), extension = file.extension().string();
  std::map<unsigned, std::filesystem::path> found;
  std::error_code fault;
  for (std::filesystem::directory_iterator entry(folder, fault), end; !fault && entry != end; entry.increment(fault)) {
    const auto place = place_in_series(entry->path().filename().string(), stem, extension);
    std::error_code ignored;
    if (place && entry->is_regular_file(ignored)) found.emplace(*place, entry->path());
  }
  if (fault && fault != std::errc::no_such_file_or_directory)
    throw InputError(flag + " " + file.string(), "its folder cannot be looked into: " + fault.message(), "one that can be read");
  RecordSeries series{{}, file};
  if (!found.empty()) series.next.replace_filename(stem + "." + std::to_string(found.rbegin()->first + 1) + extension);
  for (auto file_there = found.rbegin(); file_there != found.rend(); ++file_there) {
    const auto size = std::filesystem::file_size(file_there->second, fault);
    if (!fault && size > 0) series.there.push_back(file_there->second);
    if (is_being_written(file_there->second))
      throw InputError(flag + " " + file_there->second.string(), "is being written by another program",
                       "a name of its own for each server");
  }
  return series;
}

}  // namespace palpate
