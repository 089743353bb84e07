#include "common/io/line_writer.hpp"

#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <climits>
#include <condition_variable>
#include <mutex>
#include <utility>

namespace palpate {

struct LineWriter::Shared {
  Shared(int to, LeftOut says) : descriptor(to), left_out(std::move(says)) {}

  void run();
  bool put(const std::string& part) const;

  const int descriptor;
  const LeftOut left_out;
  std::mutex mutex;  // guards all members below
  std::condition_variable more, done;
  std::string waiting;
  std::uint64_t missing = 0;
  bool ending = false, ended = false;
};

/// Returns false when nobody will read it.
bool LineWriter::Shared::put(const std::string& part) const {
  constexpr int kLookEveryMs = 100;
  for (std::size_t from = 0; from < part.size();) {
    ::pollfd ready{descriptor, POLLOUT, 0};
    const int found = ::poll(&ready, 1, kLookEveryMs);
    if (found == 0 || (found < 0 && errno == EINTR)) continue;
    const ::ssize_t written = ::write(descriptor, part.data() + from, part.size() - from);
    if (written < 0 && errno != EINTR && errno != EAGAIN) return false;
    from += static_cast<std::size_t>(std::max<::ssize_t>(written, 0));
  }
  return true;
}

void LineWriter::Shared::run() {
  bool read = true;
  std::unique_lock lock(mutex);
  while (true) {
    more.wait(lock, [&] { return ending || !waiting.empty(); });
    if (waiting.empty()) break;
    const std::string part = waiting.substr(0, PIPE_BUF);  // written to a pipe at once or not at all
    lock.unlock();
    read = read && put(part);
    lock.lock();
    waiting.erase(0, part.size());
    if (missing > 0 && waiting.size() < kWaitingMax / 2) waiting += left_out(std::exchange(missing, 0));
  }
  ended = true;
  done.notify_all();
}

LineWriter::LineWriter(int descriptor, LeftOut left_out)
    : shared_(std::make_shared<Shared>(descriptor, std::move(left_out))), thread_([shared = shared_] { shared->run(); }) {}

LineWriter::~LineWriter() {
  std::unique_lock lock(shared_->mutex);
  shared_->ending = true;
  shared_->more.notify_all();
  const bool ended = shared_->done.wait_for(lock, kEndMost, [&] { return shared_->ended; });
  lock.unlock();
  ended ? thread_.join() : thread_.detach();
}

void LineWriter::write(const std::string& lines) {
  const std::lock_guard lock(shared_->mutex);
  if (shared_->missing > 0 || shared_->waiting.size() + lines.size() > kWaitingMax) {
    shared_->missing += static_cast<std::uint64_t>(std::count(lines.begin(), lines.end(), '\n'));
    return;
  }
  shared_->waiting += lines;
  shared_->more.notify_all();
}

}  // namespace palpate
