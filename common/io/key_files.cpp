#include "common/io/key_files.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <system_error>
#include <thread>
#include <utility>

#include "common/base/error.hpp"

namespace palpate {
namespace {

constexpr std::size_t kMostKeyFileBytes = 1 << 20;

/// An open file, closed on destruction.
class KeyDescriptor {
 public:
  explicit KeyDescriptor(int fd) : fd_(fd) {}
  KeyDescriptor(const std::filesystem::path& file, int flags) : fd_(::open(file.c_str(), flags | O_CLOEXEC)) {}
  KeyDescriptor(const KeyDescriptor&) = delete;
  KeyDescriptor& operator=(const KeyDescriptor&) = delete;
  ~KeyDescriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  int get() const { return fd_; }

 private:
  int fd_;
};

[[noreturn]] void fail_with_errno(const std::filesystem::path& file, const std::string& what, const std::string& expected) {
  throw InputError(file.string(), what + " (" + std::strerror(errno) + ")", expected);
}

/// Returns the status of a regular file. A pipe would block the reader, and the network of a server that reloads its keys.
struct stat about_of(int fd, const std::filesystem::path& file, const std::string& expected) {
  struct stat about {};
  if (fd < 0 && errno == EACCES) fail_with_errno(file, "cannot be read", "a file that this user may read");
  if (fd < 0 || ::fstat(fd, &about) != 0) fail_with_errno(file, "cannot be read", expected);
  if (!S_ISREG(about.st_mode)) throw InputError(file.string(), "is no regular file", expected);
  return about;
}

std::string read_whole(int fd, const std::filesystem::path& file) {
  std::string text;
  std::array<char, 4096> part;
  while (true) {
    const ::ssize_t got = ::read(fd, part.data(), part.size());
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) fail_with_errno(file, "cannot be read", "a file that can");
    if (got == 0) return text;
    text.append(part.data(), static_cast<std::size_t>(got));
    if (text.size() > kMostKeyFileBytes) throw InputError(file.string(), "is larger than 1 MiB", "a key file");
  }
}

void write_whole(int fd, const std::string& text, const std::filesystem::path& file) {
  for (std::size_t done = 0; done < text.size();) {
    const ::ssize_t put = ::write(fd, text.data() + done, text.size() - done);
    if (put < 0 && errno == EINTR) continue;
    if (put < 0) fail_with_errno(file, "cannot be written", "room on the disk");
    done += static_cast<std::size_t>(put);
  }
  if (::fsync(fd) != 0) fail_with_errno(file, "cannot be written", "a disk that works");
}

/// Writes and syncs a temporary file in the same folder, with the owner and group of `like` and the permissions `mode`.
std::filesystem::path write_beside(const std::filesystem::path& file, const std::string& text, const struct stat& like,
                                   ::mode_t mode) {
  std::string beside = file.string() + ".part-XXXXXX";
  const int fd = ::mkostemp(beside.data(), O_CLOEXEC);
  if (fd < 0) fail_with_errno(file, "cannot be written", "a folder that is there and may be written to");
  const KeyDescriptor part(fd);
  try {
    if ((like.st_uid != ::geteuid() || like.st_gid != ::getegid()) && ::fchown(fd, like.st_uid, like.st_gid) != 0)
      fail_with_errno(file, "is somebody else's", "its owner, or root, to change it");
    if (::fchmod(fd, mode) != 0) fail_with_errno(file, "cannot be written", "a folder whose files may be");
    write_whole(fd, text, file);
  } catch (const InputError&) {
    ::unlink(beside.c_str());
    throw;
  }
  return beside;
}

std::filesystem::path folder_of(const std::filesystem::path& file) {
  return file.has_parent_path() ? file.parent_path() : std::filesystem::path(".");
}

/// Locks the folder. Anyone who may read it may hold the lock, so the wait is limited.
void lock_folder(int folder, const std::filesystem::path& named) {
  constexpr std::chrono::milliseconds kTryEvery{20};
  constexpr int kTries = 250;
  for (int k = 0; folder >= 0 && k < kTries; ++k) {
    if (::flock(folder, LOCK_EX | LOCK_NB) == 0) return;
    if (errno != EWOULDBLOCK) break;
    std::this_thread::sleep_for(kTryEvery);
  }
  fail_with_errno(named, "cannot be changed", "a folder that can be read, and that no other program holds for 5 s");
}

void sync_folder_of(const std::filesystem::path& file) {
  const KeyDescriptor opened(folder_of(file), O_RDONLY | O_DIRECTORY);
  if (opened.get() >= 0) ::fsync(opened.get());
}

}  // namespace

std::string read_secret_text(const std::filesystem::path& file) {
  const KeyDescriptor opened(file, O_RDONLY | O_NONBLOCK);
  const struct stat about = about_of(opened.get(), file, "a file that palpate-key new made");
  if ((about.st_mode & (S_IRWXO | S_IWGRP)) != 0)
    throw InputError(file.string(), "may be read or changed by others", "chmod 600 " + file.string());
  return read_whole(opened.get(), file);
}

void write_new_secret(const std::filesystem::path& file, const std::string& text) {
  struct stat like {};  // root's new file gets the folder's owner: a service that keeps its keys there has to read them
  if (::geteuid() != 0 || ::stat(folder_of(file).c_str(), &like) != 0) like.st_uid = ::geteuid(), like.st_gid = ::getegid();
  const auto beside = write_beside(file, text, like, S_IRUSR | S_IWUSR);
  const int failed = ::link(beside.c_str(), file.c_str()) != 0 ? errno : 0;
  ::unlink(beside.c_str());
  if (failed == EEXIST) throw InputError(file.string(), "is there already", "a file that is not there yet");
  errno = failed;
  if (failed != 0) fail_with_errno(file, "cannot be written", "a folder that may be written to");
  sync_folder_of(file);
}

void change_secret(const std::filesystem::path& named, const std::function<std::string(std::string)>& change) {
  std::error_code unknown;
  const auto there = std::filesystem::canonical(named, unknown);
  const auto file = unknown ? named : there;
  const KeyDescriptor folder(folder_of(file), O_RDONLY | O_DIRECTORY);  // locked instead of the file, which is replaced
  lock_folder(folder.get(), named);
  const std::string text = change(read_secret_text(file));
  struct stat about {};
  if (::stat(file.c_str(), &about) != 0) fail_with_errno(named, "cannot be read", "a file that can");
  const auto beside = write_beside(file, text, about, about.st_mode & (S_IRWXU | S_IRWXG));
  if (::rename(beside.c_str(), file.c_str()) != 0) {
    const int failed = std::exchange(errno, 0);
    ::unlink(beside.c_str());
    errno = failed;
    fail_with_errno(named, "cannot be written", "a folder that may be written to");
  }
  sync_folder_of(file);
}

SiteKeys read_site(const std::filesystem::path& file) {
  return site_of(parse_keys(read_secret_text(file), file.string()), file.string());
}

ClientKeys read_client_keys(const std::filesystem::path& file, const std::filesystem::path& token) {
  ClientKeys keys = client_of(parse_keys(read_secret_text(file), file.string()), file.string());
  if (token.empty()) return keys;
  const KeyDescriptor opened(token, O_RDONLY | O_NONBLOCK);
  about_of(opened.get(), token, "a file with the line that palpate-key issue printed");
  keys.token = parse_token(read_whole(opened.get(), token), token.string());
  return keys;
}

}  // namespace palpate
