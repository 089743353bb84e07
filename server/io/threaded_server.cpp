#include "server/io/threaded_server.hpp"

#include <algorithm>
#include <asio/post.hpp>
#include <optional>

#include "common/base/error.hpp"
#include "common/base/limits.hpp"
#include "common/io/key_files.hpp"

namespace palpate {
namespace {

ShellOptions shell_of(std::size_t rooms, const ThreadedServerOptions& options) {
  if (!(options.rate_hz >= kMinRateHz && options.rate_hz <= kMaxRateHz))
    throw InputError("rate_hz", "is " + std::to_string(options.rate_hz), "1 to 1000");
  ShellOptions shell;
  shell.listen = options.listen;
  shell.rate_hz = options.rate_hz;
  shell.threads = std::min<std::size_t>(rooms, SpinningThreadPool::processors());
  if (!options.key_file.empty())
    shell.keys = read_site(options.key_file);
  else if (!is_loopback(resolve_udp("listen", options.listen)))
    throw InputError("listen " + options.listen, "would admit anyone who reaches the port", "key_file, or the loopback");
  return shell;
}

}  // namespace

ThreadedServer::ThreadedServer(const std::vector<NamedScene>& rooms, const ThreadedServerOptions& options)
    : server_(rooms, shell_of(rooms.size(), options), {}), address_(to_string(server_.address())), thread_([this] {
        try {
          server_.run();
        } catch (...) {
          fault_ = std::current_exception();
          failed_.store(true, std::memory_order_release);
        }
      }) {}

ThreadedServer::~ThreadedServer() {
  asio::post(server_.context(), [this] { server_.stop(); });
  thread_.join();
}

void ThreadedServer::check() const {
  if (failed_.load(std::memory_order_acquire)) std::rethrow_exception(fault_);
}

}  // namespace palpate
