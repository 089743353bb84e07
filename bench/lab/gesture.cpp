// palpate-lab gesture: a motion for any body, derived from its own surface, as a file that every program accepts.
#include <fmt/format.h>

#include "bench/lab/experiments.hpp"
#include "bench/measure/surface_gesture.hpp"
#include "bench/output/output.hpp"
#include "common/base/error.hpp"
#include "common/command_line/mesh_folders.hpp"
#include "server/body/unload.hpp"

namespace palpate {
namespace {

struct GestureFlags {
  std::string scene, kind = "press", out;
  MeshFolders mesh_folders;
};

int run_gesture(const GestureFlags& flags) {
  const std::filesystem::path file(flags.out);
  if (file.extension() != ".csv") throw InputError("--out " + flags.out, "is not the name of a motion file", "FILE.csv");
  const Motion motion = surface_gesture(open_scene(flags.scene, flags.mesh_folders), *surface_gesture_from_name(flags.kind));
  if (file.has_parent_path()) make_output_folder(file.parent_path().string());
  write_motion(file, motion);
  fmt::print("{} of {:.1f} s in {}: for --motion of palpate-client and palpate-lab replay\n", flags.kind, motion.duration_s(),
             flags.out);
  return 0;
}

}  // namespace

void add_gesture(CLI::App& app, Run& run) {
  auto flags = std::make_shared<GestureFlags>();
  CLI::App* c = app.add_subcommand(
      "gesture", "make a motion for any body from its own surface: press, stroke, tap, circle, a tour or an insertion");
  c->add_option("--scene", flags->scene, "scene file (JSON)")->type_name("FILE")->required();
  add_mesh_folders(*c, flags->mesh_folders);
  c->add_option("--kind", flags->kind, "gesture of the hand")
      ->check(one_of(std::vector<std::string>(kSurfaceGestureNames.begin(), kSurfaceGestureNames.end())));
  c->add_option("--out", flags->out, "motion file to write (CSV t_s,x_m,y_m,z_m)")->type_name("FILE")->required();
  c->callback([flags, &run] { run = [flags] { return run_gesture(*flags); }; });
}

}  // namespace palpate
