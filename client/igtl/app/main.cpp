// palpate-bridge: connects a room to other programs, which have protocols of their own. igtl: OpenIGTLink, for 3D Slicer.
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <utility>

#include "client/igtl/app/igtl_options.hpp"
#include "client/igtl/app/igtl_server.hpp"
#include "client/io/end_signals.hpp"
#include "client/io/udp_viewer.hpp"
#include "client/viewer/status_line.hpp"
#include "common/io/endpoint.hpp"
#include "common/io/key_files.hpp"
#include "common/io/monotonic.hpp"

namespace palpate {
namespace {

constexpr Micros kPumpEvery{10'000};   ///< datagrams wait this long at most
constexpr Micros kLookEvery{100'000};  ///< signals wait this long at most

void tell(const std::string& line) {
  fmt::print("{}\n", line);
  std::fflush(stdout);
}

/// Returns the time of day as OpenIGTLink has it: seconds since 1970, in units of 2^-32.
std::uint64_t igtl_now() {
  const auto since = std::chrono::system_clock::now().time_since_epoch();
  const auto whole = std::chrono::duration_cast<std::chrono::seconds>(since);
  const auto rest = std::chrono::duration_cast<std::chrono::nanoseconds>(since - whole);
  return static_cast<std::uint64_t>(whole.count()) << 32 | (static_cast<std::uint64_t>(rest.count()) << 32) / 1'000'000'000;
}

/// A server's room for OpenIGTLink: a viewer of the server while a client is connected, and nothing at all while none is.
class Sender {
 public:
  Sender(const IgtlOptions& options, bool alike) : options_(options), alike_(alike), up_(patient_up(options.up)) {
    resolve_udp("--server", options.server);  // refused now, and not when somebody connects
    if (!options.key.empty()) keys_ = read_client_keys(options.key, options.token);
  }

  /// Handles what is due and sends it. Returns the time of the next call.
  Micros tick(IgtlServer& clients, Micros now) {
    if (clients.clients() == 0) {
      if (viewer_) tell("nobody is connected");
      viewer_.reset();
      return now + kLookEvery;
    }
    if (!viewer_) join();
    viewer_->pump();
    ViewCore& core = viewer_->core();
    say_state(core);
    if (now >= next_) {
      next_ = std::max(next_ + period(), now);
      ViewMoment moment;
      if (core.show(now, moment)) {
        if (!core.heard_lately(now)) moment.tools.clear();  // where they are, and what they feel, is unknown
        clients.send(igtl_moment(moment, core.mesh().triangles, core.rest(), up_, igtl_now()));
      }
    }
    return std::min({next_, viewer_->deadline(), now + kPumpEvery});
  }

 private:
  Micros period() const { return from_seconds(1 / options_.rate_hz); }

  void join() {
    viewer_.emplace(options_.server, options_.station, options_.room, alike_, keys_);
    viewer_->core().limit(options_.kbit_s);
    said_.clear();
  }

  void say_state(const ViewCore& core) {
    std::string state = "waiting for " + options_.server;
    if (core.ready()) state = "shows " + core.welcome().scene;
    if (core.link() == LinkState::refused) state = options_.server + " refuses: " + core.refusal();
    if (state != said_) tell(said_ = state);
  }

  const IgtlOptions& options_;
  bool alike_;
  PatientUp up_;
  std::optional<ClientKeys> keys_;
  std::optional<UdpViewer> viewer_;
  Micros next_{};
  std::string said_;
};

void write_file(const std::filesystem::path& file, const std::string& bytes) {
  std::ofstream out(file, std::ios::binary);
  out << bytes;
  if (!out.flush()) throw InputError(file.string(), "cannot be written", "a place on a disk with room");
}

/// Writes a received surface and its scene. Returns false, and says why, for one that is no body.
bool take_surface(const IgtlMessage& message, const IgtlOptions& options) {
  const std::filesystem::path scene = options.receive;
  const std::string mesh_file = scene.stem().string() + ".stl";
  ReceivedBody body;
  body.name = scene.stem().string();
  body.material = options.material;
  body.spacing_m = 1e-3 * options.spacing_mm;
  body.held_m = 1e-3 * options.hold_mm.value_or(0);
  body.radius_m = 1e-3 * options.radius_mm.value_or(0);
  body.up = patient_up(options.up);
  std::string stl, text;
  try {
    const IgtlSurface surface = read_igtl_surface(message.content);
    stl = igtl_stl(surface);
    text = igtl_scene(surface, body, mesh_file);
    tell(fmt::format("received {}: {} triangles", message.name, surface.triangles.size()));
  } catch (const InputError& fault) {
    fmt::print(stderr, "palpate-bridge: {} is not used: {}\n", message.name, fault.what());
    return false;
  }
  write_file(std::filesystem::path(scene).replace_filename(mesh_file), stl);
  write_file(scene, text);
  tell(fmt::format("wrote {} and {}\n\n  palpate-server --scene {}", mesh_file, scene.filename().string(), scene.string()));
  return true;
}

int run_igtl(const CLI::App& app, const IgtlOptions& options, const std::atomic<bool>& stop) {
  check_igtl(app, options);
  const bool receives = !options.receive.empty();
  bool written = false;
  std::optional<Sender> sender;
  std::optional<IgtlMessage> surface;
  IgtlServer::Received received;
  if (receives)
    received = [&](const IgtlMessage& message) {
      if (message.type == "POLYDATA") surface = message;
    };
  else
    sender.emplace(options, app.count("--station") == 0);
  IgtlServer clients(options.listen, options.insecure, received);
  tell(fmt::format("palpate-bridge {}: OpenIGTLink at {}", PALPATE_VERSION, clients.address()));
  const Micros begun = monotonic_now();
  const Micros end = options.duration_s ? begun + from_seconds(*options.duration_s) : Micros::max();
  for (Micros now = begun; now < end && !stop && !written; now = monotonic_now()) {
    const Micros next = sender ? sender->tick(clients, now) : now + kLookEvery;
    clients.run_for(std::max(next - now, Micros{1'000}));
    if (surface) written = take_surface(*std::exchange(surface, std::nullopt), options);
  }
  return receives && !written ? 1 : 0;
}

int run(int argc, char** argv) {
  static std::atomic<bool> stop{false};
  IgtlOptions options;
  CLI::App app("a room for other programs, in their own protocols", "palpate-bridge");
  describe_program(app, PALPATE_VERSION, "palpate-bridge igtl --server 127.0.0.1:47800");
  app.require_subcommand(1);
  CLI::App* igtl =
      app.add_subcommand("igtl", "OpenIGTLink, for 3D Slicer: sends the body, the hands and their forces, or receives a surface");
  add_igtl_flags(*igtl, options);
  return run_program(app, [&] {
    app.parse(argc, argv);
    end_by_signals(stop);
    return run_igtl(*igtl, options, stop);
  });
}

}  // namespace
}  // namespace palpate

int main(int argc, char** argv) { return palpate::run(argc, argv); }
