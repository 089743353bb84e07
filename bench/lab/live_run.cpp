#include "bench/lab/live_run.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>

#include <asio/post.hpp>
#include <cstring>
#include <exception>
#include <fstream>
#include <stdexcept>
#include <thread>
#include <vector>

#include "common/base/error.hpp"
#include "common/io/mapped_file.hpp"
#include "common/io/udp_relay.hpp"
#include "common/record/reader.hpp"
#include "server/io/udp_server.hpp"

extern char** environ;

namespace palpate {
namespace {

constexpr const char* kAnyPort = "127.0.0.1:0";

/// Runs palpate-server with one room and one thread for it, until stop().
class LiveServer {
 public:
  LiveServer(const LiveSetting& setting, const std::filesystem::path& recording)
      : shell_({{"live", setting.scene}},
               {.listen = kAnyPort,
                .rate_hz = setting.rate_hz,
                .record = {.file = recording.string(), .shapes_hz = 0, .program = "palpate-lab live"}},
               {}),
        thread_([this] { run(); }) {}
  ~LiveServer() {
    if (thread_.joinable()) end();
  }

  UdpEndpoint address() const { return shell_.address(); }
  /// Throws the exception of its body, if any.
  ServerCounts stop() {
    end();
    if (failure_) std::rethrow_exception(failure_);
    return shell_.rooms()[0].counts();
  }

 private:
  void run() {
    try {
      shell_.run();
    } catch (...) {
      failure_ = std::current_exception();
    }
  }
  void end() {
    asio::post(shell_.context(), [this] { shell_.stop(); });
    thread_.join();
  }

  UdpServer shell_;
  std::exception_ptr failure_;
  std::thread thread_;
};

/// Runs palpate-relay.
class LiveRelay {
 public:
  LiveRelay(const UdpEndpoint& server, const LinkSpec& each_way)
      : relay_(io_, bind_udp(io_, "relay", resolve_udp("relay", kAnyPort)), server, each_way),
        address_(relay_.address()),
        thread_([this] { io_.run(); }) {}
  ~LiveRelay() {
    io_.stop();
    thread_.join();
  }
  UdpEndpoint address() const { return address_; }

 private:
  asio::io_context io_{1};
  UdpRelay relay_;
  UdpEndpoint address_;
  std::thread thread_;
};

/// Runs a program to its end, with its output redirected to `log`.
void run_program(const std::filesystem::path& program, std::vector<std::string> arguments, const std::filesystem::path& log) {
  arguments.insert(arguments.begin(), program.string());
  std::vector<char*> raw;
  for (std::string& argument : arguments) raw.push_back(argument.data());
  raw.push_back(nullptr);
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_addopen(&files, 1, log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
  posix_spawn_file_actions_adddup2(&files, 1, 2);
  pid_t child = 0;
  const int fault = posix_spawn(&child, program.c_str(), &files, nullptr, raw.data(), environ);
  posix_spawn_file_actions_destroy(&files);
  if (fault != 0)
    throw InputError(program.string(), fmt::format("cannot be started: {}", std::strerror(fault)),
                     program.filename().string() + " beside palpate-lab");
  int status = 0;
  waitpid(child, &status, 0);
  if (status != 0) throw std::runtime_error(fmt::format("{} failed; {} says why", program.filename().string(), log.string()));
}

std::vector<Micros> frame_times(const std::filesystem::path& file) {
  const MappedFile bytes(file);
  const RecordingReader recording(bytes.bytes(), file.string());
  std::vector<Micros> times;
  for (std::size_t k = 0; k < recording.blocks().size(); ++k)
    if (const auto block = recording.read(k))
      for (const RecordedFrame& frame : block->frames)
        if (frame.steps > 0) times.push_back(frame.took);
  return times;
}

Json read_json(const std::filesystem::path& file) { return Json::parse(std::ifstream(file)); }

}  // namespace

LiveRun run_live(const LiveSetting& setting) {
  const std::filesystem::path here = std::filesystem::read_symlink("/proc/self/exe").parent_path();
  const std::filesystem::path recording = setting.folder / "live.rec";
  LiveServer server(setting, recording);
  {
    const LiveRelay relay(server.address(), setting.each_way);
    run_program(here / "palpate-client",
                {"--server", to_string(relay.address()), "--device", "replay", "--motion", setting.motion.string(), "--scheme",
                 setting.scheme, "--passivity", "off", "--report", setting.folder.string()},
                setting.folder / "client.log");
  }
  const ServerCounts counts = server.stop();
  return {read_client_report(setting.folder, setting.scheme), read_json(setting.folder / "summary.json"), counts,
          frame_times(recording)};
}

}  // namespace palpate
