// palpate-server: rooms, each with a body and its stations. See --help.
#include <spdlog/fmt/fmt.h>

#include "server/app/load_scenes.hpp"
#include "server/app/serve.hpp"
#include "server/scene/scene.hpp"

int main(int argc, char** argv) {
  using namespace palpate;
  CLI::App app("simulates a deformable body and lets stations touch it", "palpate-server");
  describe_program(app, PALPATE_VERSION, "palpate-server --scene scenes/organ.json --listen 0.0.0.0:47800 --keys site.keys");
  ServerFlags flags;
  describe_flags(app, flags);
  return run_program(app, [&] {
    app.parse(argc, argv);
    flags.has_duration = app.count("--duration-s") > 0;
    flags.has_record = app.count("--record") > 0;
    flags.has_keys = app.count("--keys") > 0;
    flags.has_shapes = app.count("--record-shapes-hz") > 0;
    flags.has_metrics = app.count("--metrics") > 0;
    check(flags);
    if (flags.print_scene)
      fmt::print("{}\n", print_scene(split_name(flags.scenes.front()).second, flags.mesh_folders));
    else if (flags.describe)
      describe_scenes(flags);
    else
      serve(flags);
    return 0;
  });
}
