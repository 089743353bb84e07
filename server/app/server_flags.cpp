#include "server/app/server_flags.hpp"

#include "common/base/error.hpp"
#include "common/base/limits.hpp"
#include "server/scene/materials.hpp"

namespace palpate {
namespace {

constexpr double kLeastS = 1e-3, kMostS = 30 * 86400.0, kMostDrainS = 86400;

}  // namespace

void describe_flags(CLI::App& app, ServerFlags& o) {
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
  app.add_flag("--resume", o.resume,
               "where the file of --record is there, go on: the body is as it was at its newest checkpoint, and FILE with .2, .3 "
               "... before the extension is written (docs/reference/operation.md)");
  app.add_option("--record-shapes-hz", o.shapes_hz, "shapes of the body a second in the recording, at most one a frame, 0: none")
      ->check(number_from(0.0, kMaxRateHz))
      ->capture_default_str();
  app.add_option("--deadband", o.deadband,
                 "share of the force: a patch that would change the force by less is not sent; 0: every patch is sent")
      ->check(number_from(0.0, kMaxDeadband))
      ->capture_default_str();
  app.add_option("--drain-s", o.drain_s,
                 "at SIGTERM refuse new sessions and wait up to this long for the clients to leave; a second SIGTERM, or "
                 "SIGINT, ends at once")
      ->check(number_from(0.0, kMostDrainS))
      ->capture_default_str();
  app.add_option(
         "--metrics", o.metrics,
         "serve /metrics for Prometheus, /healthz and /readyz here over HTTP (docs/reference/operation.md), port 0 for any")
      ->type_name("HOST:PORT");
  app.add_option("--log", o.log, "lines for a person, or a JSON object a line")
      ->check(one_of({"text", "json"}))
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

void check(const ServerFlags& o) {
  if (o.print_scene && o.scenes.size() > 1) throw InputError("--print-scene", "comes with several scenes", "one --scene");
  if (o.print_scene && o.describe) throw InputError("--describe", "comes with --print-scene", "one of the two");
  if (o.has_metrics && o.metrics.empty()) throw InputError("--metrics", "is empty", "HOST:PORT, or no such flag");
  if (o.has_keys && o.keys.empty()) throw InputError("--keys", "is empty", "a file, or no such flag");
  if (o.has_keys && o.insecure) throw InputError("--insecure", "comes with --keys", "one of the two");
  if (o.has_record && o.record.empty()) throw InputError("--record", "is empty", "a file, or no such flag");
  if (o.resume && !o.has_record) throw InputError("--resume", "without a recording to go on from", "--record FILE");
  if (o.has_shapes && !o.has_record) throw InputError("--record-shapes-hz", "without a recording", "--record FILE");
}

}  // namespace palpate
