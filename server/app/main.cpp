// palpate-server: rooms, each with a body and its stations. See --help.
#include <spdlog/fmt/chrono.h>
#include <spdlog/fmt/fmt.h>

#include <asio/signal_set.hpp>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <thread>

#include "common/base/error.hpp"
#include "common/base/limits.hpp"
#include "common/command_line/mesh_folders.hpp"
#include "common/io/key_files.hpp"
#include "server/app/describe.hpp"
#include "server/io/server_shell.hpp"
#include "server/scene/materials.hpp"
#include "server/scene/scene.hpp"

namespace {

using namespace palpate;

constexpr double kLeastS = 1e-3, kMostS = 30 * 86400.0;

struct Options {
  std::vector<std::string> scenes;
  MeshFolders mesh_folders;
  std::string listen = "127.0.0.1:47800", record, keys;
  double rate_hz = 20, duration_s = 0, shapes_hz = RecordOptions{}.shapes_hz, deadband = 0;
  std::size_t threads = 0;
  bool print_scene = false, describe = false, insecure = false, has_keys = false, has_duration = false, has_record = false,
       has_shapes = false;
};

void describe_flags(CLI::App& app, Options& o) {
  app.add_option("--scene", o.scenes,
                 "scene file (docs/reference/scenes.md); NAME names the room, default: the scene's name. Give it again for each "
                 "further room (a room is one body and the hands on it)")
      ->type_name("[NAME=]FILE")
      ->required()
      ->allow_extra_args(false);
  add_mesh_folders(app, o.mesh_folders);
  app.add_option("--listen", o.listen, "where clients reach the server, port 0 for any")
      ->type_name("HOST:PORT")
      ->capture_default_str();
  app.add_option(
         "--keys", o.keys,
         "key file of this server (docs/tutorials/two-machines.md): whoever has none of the keys in it hears nothing; read "
         "again at SIGHUP")
      ->type_name("FILE");
  app.add_flag("--insecure", o.insecure,
               "listen beyond this machine without keys: whoever reaches the port may touch, read and take over");
  app.add_option("--rate-hz", o.rate_hz,
                 "frames a second (a frame: one step of the body, after which every station gets a new patch)")
      ->check(number_from(kMinRateHz, kMaxRateHz))
      ->capture_default_str();
  app.add_option("--threads", o.threads,
                 "threads that step bodies; default: one a room, at most one a processor; what exceeds the rooms is shared by "
                 "large bodies")
      ->check(number_from(1, 256));
  app.add_option("--duration-s", o.duration_s, "end after so many seconds; default: never")->check(number_from(kLeastS, kMostS));
  app.add_option("--record", o.record,
                 "write everything that happens to a new file (docs/reference/recording.md); of several rooms each to its own, "
                 "FILE with -NAME before the extension")
      ->type_name("FILE");
  app.add_option("--record-shapes-hz", o.shapes_hz, "shapes of the body a second in the recording, at most one a frame, 0: none")
      ->check(number_from(0.0, kMaxRateHz))
      ->capture_default_str();
  app.add_option("--deadband", o.deadband,
                 "share of the force: a patch that would change the force by less is not sent; 0: every patch is sent")
      ->check(number_from(0.0, kMaxDeadband))
      ->capture_default_str();
  app.add_flag("--print-scene", o.print_scene, "write the scene with all defaults filled in, and end");
  app.add_flag("--describe", o.describe,
               "say what the body weighs, how many nodes are held, how stiff it is and what a frame costs here, and end");
  const auto list_materials = [] {
    fmt::print("{}", list_of_materials());
    throw CLI::Success();
  };
  app.add_flag_callback("--list-materials", list_materials, "the materials that a scene may name, with their sources, and end");
}

void check(const Options& o) {
  if (o.print_scene && o.scenes.size() > 1) throw InputError("--print-scene", "comes with several scenes", "one --scene");
  if (o.print_scene && o.describe) throw InputError("--describe", "comes with --print-scene", "one of the two");
  if (o.has_keys && o.keys.empty()) throw InputError("--keys", "is empty", "a file, or no such flag");
  if (o.has_keys && o.insecure) throw InputError("--insecure", "comes with --keys", "one of the two");
  if (o.has_record && o.record.empty()) throw InputError("--record", "is empty", "a file, or no such flag");
  if (o.has_shapes && !o.has_record) throw InputError("--record-shapes-hz", "without a recording", "--record FILE");
}

/// A scene that is being built holds nothing that must be ended in order, and may take long.
void end_while_loading() {
  for (const int signal : {SIGINT, SIGTERM}) std::signal(signal, [](int) { std::_Exit(0); });
}

void say(const std::string& line) {
  fmt::print("{:%H:%M:%S} palpate-server: {}\n", fmt::localtime(std::time(nullptr)), line);
  std::fflush(stdout);
}

/// NAME=FILE, or FILE; a file whose name has a = is the latter when it is there.
std::pair<std::string, std::string> split_name(const std::string& given) {
  const std::size_t equals = given.find('=');
  if (equals == std::string::npos || std::filesystem::exists(given)) return {"", given};
  return {given.substr(0, equals), given.substr(equals + 1)};
}

std::vector<NamedScene> load_scenes(const Options& o) {
  std::vector<NamedScene> scenes;
  for (const std::string& given : o.scenes) {
    auto [name, file] = split_name(given);
    Scene scene = load_scene(file, o.mesh_folders);
    if (name.empty()) name = scene.name;
    if (name.empty() && o.scenes.size() > 1) throw InputError("--scene " + given, "the room has no name", "NAME=FILE");
    if (name.size() > static_cast<std::size_t>(kMaxNameBytes))
      throw InputError("--scene " + given, "the room's name is too long", fmt::format("up to {} bytes", kMaxNameBytes));
    for (const NamedScene& other : scenes)
      if (other.name == name)
        throw InputError("--scene " + given, "there is a room \"" + name + "\" already", "another name: NAME=" + file);
    scenes.push_back({name, std::move(scene)});
    if (!o.has_record) continue;
    scenes.back().file = std::filesystem::absolute(file).lexically_normal().string();
    scenes.back().text = print_scene(file, o.mesh_folders);
  }
  return scenes;
}

void describe_scenes(const Options& o) {
  for (const NamedScene& room : load_scenes(o)) {
    fmt::print("scene      \"{}\"\n", room.name);
    for (const std::string& line : describe(room.scene, o.rate_hz)) fmt::print("{}\n", line);
  }
}

/// Beyond this machine only with keys, unless that is asked for.
void check_reach(const Options& o) {
  if (o.has_keys || o.insecure || resolve_udp("--listen", o.listen).address().is_loopback()) return;
  throw InputError("--listen " + o.listen, "would let in whoever reaches the port",
                   "--keys FILE (palpate-key new FILE makes one), or --insecure");
}

constexpr std::chrono::minutes kInsecureEvery{1};

void warn_insecure(asio::steady_timer& timer) {
  say("warning: --insecure: whoever reaches this port may touch, read and take over; --keys FILE ends that");
  timer.expires_after(kInsecureEvery);
  timer.async_wait([&timer](const asio::error_code& fault) {
    if (!fault) warn_insecure(timer);
  });
}

/// A file that is wrong leaves the keys as they are.
void read_keys_at(asio::signal_set& hang_up, ServerShell& shell, const std::string& file) {
  hang_up.async_wait([&hang_up, &shell, file](const asio::error_code& fault, int) {
    if (fault) return;
    try {
      shell.change_keys(read_site(file));
      say("keys read again from " + file);
    } catch (const InputError& wrong) {
      say(std::string("keys stay as they were: ") + wrong.what());
    }
    read_keys_at(hang_up, shell, file);
  });
}

void serve(const Options& o) {
  end_while_loading();
  check_reach(o);
  const auto keys = o.has_keys ? std::optional(read_site(o.keys)) : std::nullopt;
  const std::vector<NamedScene> scenes = load_scenes(o);
  const std::size_t processors = std::max(1u, std::thread::hardware_concurrency());
  ServerShell shell(scenes,
                    {o.listen,
                     o.rate_hz,
                     o.threads > 0 ? o.threads : std::min(scenes.size(), processors),
                     {o.record, o.shapes_hz, "palpate-server " PALPATE_VERSION},
                     o.deadband,
                     keys},
                    say);
  asio::signal_set hang_up(shell.context());
  if (keys) {
    hang_up.add(SIGHUP);
    read_keys_at(hang_up, shell, o.keys);
    say(fmt::format("public key {}; {} stations and {} issuers are let in", to_text(public_of(keys->self)), keys->stations.size(),
                    keys->issuers.size()));
  }
  asio::steady_timer insecure(shell.context());
  if (o.insecure) warn_insecure(insecure);
  asio::signal_set signals(shell.context(), SIGINT, SIGTERM);
  signals.async_wait([&shell](const asio::error_code& fault, int) {
    if (!fault) shell.stop();
  });
  asio::steady_timer end(shell.context());
  if (o.has_duration) {
    end.expires_after(std::chrono::microseconds(from_seconds(o.duration_s)));
    end.async_wait([&shell](const asio::error_code& fault) {
      if (!fault) shell.stop();
    });
  }
  for (std::size_t k = 0; k < scenes.size(); ++k) {
    const NamedScene& room = scenes[k];
    const std::string as = scenes.size() > 1 ? fmt::format("room \"{}\": ", room.name) : "";
    say(fmt::format("{}scene \"{}\" ({} nodes, {} elements) at {}, {} Hz", as, room.scene.name, room.scene.body.nodes.size(),
                    room.scene.body.elements.size() + room.scene.body.tetrahedra.size() + room.scene.body.hexahedra.size(),
                    to_string(shell.address()), o.rate_hz));
    say(fmt::format("{}integrator {}", as, shell.integrator(k)));
    for (const std::string& line : describe(room.scene, o.rate_hz)) say(as + line);
  }
  shell.run();
  for (const std::string& line : shell.summary()) say(line);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("simulates a deformable body and lets stations touch it", "palpate-server");
  describe_program(app, PALPATE_VERSION, "palpate-server --scene scenes/organ.json --listen 0.0.0.0:47800 --keys site.keys");
  Options options;
  describe_flags(app, options);
  return run_program(app, [&] {
    app.parse(argc, argv);
    options.has_duration = app.count("--duration-s") > 0;
    options.has_record = app.count("--record") > 0;
    options.has_keys = app.count("--keys") > 0;
    options.has_shapes = app.count("--record-shapes-hz") > 0;
    check(options);
    if (options.print_scene)
      fmt::print("{}\n", print_scene(split_name(options.scenes.front()).second, options.mesh_folders));
    else if (options.describe)
      describe_scenes(options);
    else
      serve(options);
    return 0;
  });
}
