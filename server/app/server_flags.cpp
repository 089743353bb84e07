#include "server/app/server_flags.hpp"

#include "common/base/error.hpp"
#include "common/base/limits.hpp"
#include "server/scene/materials.hpp"
#include "server/scene/tools.hpp"

namespace palpate {
namespace {

constexpr double kLeastS = 1e-3, kMostS = 30 * 86400.0, kMostDrainS = 86400;

}  // namespace

void describe_flags(CLI::App& app, ServerFlags& o) {
  app.add_option(
         "--scene", o.scenes,
         "scene file (docs/reference/scenes.md); NAME names its room, default: the scene's name; repeated for further rooms (a "
         "room is one body and the stations that touch it)")
      ->type_name("[NAME=]FILE")
      ->required()
      ->allow_extra_args(false);
  add_mesh_folders(app, o.mesh_folders);
  app.add_option("--listen", o.listen, "address at which the server receives datagrams; port 0 chooses a free port")
      ->type_name("HOST:PORT")
      ->capture_default_str();
  app.add_option(
         "--keys", o.keys,
         "key file of this server (docs/tutorials/two-machines.md): only stations whose key is in it may join; SIGHUP rereads it")
      ->type_name("FILE");
  app.add_flag(
      "--insecure", o.insecure,
      "accept other machines without keys: anyone who reaches the port may touch the body, read the data and take over stations");
  app.add_option("--rate-hz", o.rate_hz, "frames per second; a frame steps the body and gives every station a new patch")
      ->check(number_from(kMinRateHz, kMaxRateHz))
      ->capture_default_str();
  app.add_option("--threads", o.threads,
                 "threads that step bodies; default: one per room, at most one per processor; threads beyond the number of rooms "
                 "share the work of large bodies")
      ->check(number_from(1, 256));
  app.add_option("--duration-s", o.duration_s, "end after this many seconds; default: never")
      ->check(number_from(kLeastS, kMostS));
  app.add_option(
         "--record", o.record,
         "record everything to a new file (docs/reference/recording.md); each of several rooms has a file of its own, FILE "
         "with -NAME before the extension")
      ->type_name("FILE");
  app.add_flag(
      "--resume", o.resume,
      "if the file of --record exists, restore the body from its newest checkpoint and continue in a new file, FILE with .2, "
      ".3 ... before the extension (docs/reference/operation.md)");
  app.add_option("--record-shapes-hz", o.shapes_hz,
                 "shapes of the body per second in the recording, at most one per frame; 0: none")
      ->check(number_from(0.0, kMaxRateHz))
      ->capture_default_str();
  app.add_option("--deadband", o.deadband,
                 "share of the force: a patch that would change the force by less is not sent; 0: every patch is sent")
      ->check(number_from(0.0, kMaxDeadband))
      ->capture_default_str();
  app.add_option(
         "--drain-s", o.drain_s,
         "at SIGTERM, refuse new sessions and exit when the last hand leaves, after this many seconds at the latest; a second "
         "SIGTERM, or SIGINT, ends at once")
      ->check(number_from(0.0, kMostDrainS))
      ->capture_default_str();
  app.add_option("--metrics", o.metrics,
                 "HTTP address of /metrics for Prometheus, /healthz and /readyz (docs/reference/operation.md); port 0 chooses a "
                 "free port")
      ->type_name("HOST:PORT");
  app.add_option("--log", o.log, "format of the log: lines of text, or one JSON object per line")
      ->check(one_of({"text", "json"}))
      ->capture_default_str();
  app.add_flag("--print-scene", o.print_scene, "print the scene with all defaults filled in, and end");
  app.add_flag("--describe", o.describe,
               "print the mass of the body, its fixed nodes, its stiffness and the cost of a frame on this machine, and end");
  const auto list_materials = [] {
    fmt::print("{}", list_of_materials());
    throw CLI::Success();
  };
  app.add_flag_callback("--list-materials", list_materials,
                        "list the materials that a scene may name, with their sources, and end");
  const auto list_tools = [] {
    fmt::print("{}", list_of_tools());
    throw CLI::Success();
  };
  app.add_flag_callback("--list-tools", list_tools, "list the tools that a scene may name, and end");
}

void check(const ServerFlags& o) {
  if (o.print_scene && o.scenes.size() > 1) throw InputError("--print-scene", "cannot print several scenes", "one --scene");
  if (o.print_scene && o.describe) throw InputError("--describe", "cannot be combined with --print-scene", "one of the two");
  if (o.has_metrics && o.metrics.empty()) throw InputError("--metrics", "is empty", "HOST:PORT, or no such flag");
  if (o.has_keys && o.keys.empty()) throw InputError("--keys", "is empty", "a file, or no such flag");
  if (o.has_keys && o.insecure) throw InputError("--insecure", "cannot be combined with --keys", "one of the two");
  if (o.has_record && o.record.empty()) throw InputError("--record", "is empty", "a file, or no such flag");
  if (o.resume && !o.has_record) throw InputError("--resume", "has no recording to continue", "--record FILE");
  if (o.has_shapes && !o.has_record) throw InputError("--record-shapes-hz", "has no recording", "--record FILE");
}

}  // namespace palpate
