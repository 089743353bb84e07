// palpate-lab advise: mesh, element, step and scheme for a surface and a material on this machine, with the error and the cost to
// expect, and a scene that runs.
#include <fmt/format.h>

#include "bench/lab/experiments.hpp"
#include "bench/output/output.hpp"
#include "bench/tissue/advice.hpp"
#include "common/base/error.hpp"
#include "common/command_line/flags.hpp"

namespace palpate {
namespace {

struct AdviseFlags {
  std::string surface, material, out;
  double scale = 1, rate_hz = 20, error = 0.05, radius_mm = 15, held = 0.15;
};

void print_tried(const Advice& advice) {
  fmt::print("\n  {:>9}  {:<12}{:>7}{:>8}{:>12}{:>14}\n", "spacing", "element", "nodes", "cells", "error %", "ms a frame");
  for (std::size_t i = 0; i < advice.tried.size(); ++i) {
    const AdvisedMesh& m = advice.tried[i];
    fmt::print("{} {:>6.2f} mm  {:<12}{:>7}{:>8}{:>+12.1f}{:>14}\n", i == advice.chosen ? '*' : ' ', 1e3 * m.spacing_m,
               m.element_name(), m.nodes, m.cells, 100 * m.mesh_error,
               m.frame_ms() > 0 ? fmt::format("{:.1f}", m.frame_ms()) : "");
  }
}

void print_advice(const AdviseFlags& flags, const Advice& advice, const std::filesystem::path& scene) {
  const AdvisedMesh& m = advice.tried[advice.chosen];
  print_tried(advice);
  fmt::print(
      "\nA lattice of {:.2f} mm of {} ({} nodes), steps of {:g} ms, patches '{}'.\n"
      "Force of a light touch: {:.1f} % from the continuum, of which the step {:.1f} %; the model of the error is off by up to "
      "{:.1f} %.\n"
      "A frame takes {:.1f} ms of this machine (step {:.1f}, patches and datagrams {:.1f}) of {:.0f}.\n",
      1e3 * m.spacing_m, m.element == SolidElement::hexahedron ? "hexahedra" : "tetrahedra", m.nodes, 1e3 * advice.step_s,
      name_of(m.scheme), 100 * advice.error(), 100 * advice.step_error, 100 * advice.model_error, m.frame_ms(), m.step_ms,
      m.patch_ms, 1e3 / flags.rate_hz);
  if (!advice.true_enough)
    fmt::print("No mesh was within {:g} %{}.\n", 100 * flags.error,
               advice.fast_enough ? " and fast enough: this is the truest of those that are" : "");
  if (!advice.fast_enough) fmt::print("No mesh was fast enough for {:g} frames a second: this is the fastest.\n", flags.rate_hz);
  fmt::print("\n  palpate-server --scene {} --rate-hz {:g}\n", scene.string(), flags.rate_hz);
}

/// Beside the scene, whose meshes lie below its folder.
std::string bring_surface(const std::filesystem::path& surface, const std::filesystem::path& scene) {
  namespace fs = std::filesystem;
  const fs::path folder = fs::absolute(scene).parent_path();
  fs::create_directories(folder);
  const fs::path there = folder / surface.filename();
  if (fs::exists(there) && fs::equivalent(surface, there)) return surface.filename().string();
  fs::copy_file(surface, there, fs::copy_options::overwrite_existing);
  fmt::print("{} was copied to {}\n", surface.string(), there.string());
  return surface.filename().string();
}

int run_advise(const AdviseFlags& flags) {
  AdviceRequest request;
  request.surface = flags.surface;
  request.scale = flags.scale;
  request.material = flags.material;
  request.rate_hz = flags.rate_hz;
  request.error = flags.error;
  request.radius_m = 1e-3 * flags.radius_mm;
  request.held_share = flags.held;
  const Advice advice = advise(request, processor_ns, [](const std::string& what) { fmt::print(stderr, "{}\n", what); });
  const std::filesystem::path scene = flags.out;
  const AdvisedMesh& m = advice.tried[advice.chosen];
  const std::string file = bring_surface(request.surface, scene);
  write_text(scene, advised_scene(request, file, m.element, m.spacing_m, advice.step_s));
  print_advice(flags, advice, scene);
  return 0;
}

}  // namespace

void add_advise(CLI::App& app, Run& run) {
  auto flags = std::make_shared<AdviseFlags>();
  CLI::App* c = app.add_subcommand(
      "advise", "mesh, element, step and scheme for a surface and a material, and what to expect of them here");
  c->add_option("--surface", flags->surface, "a closed surface, STL or OBJ")->type_name("FILE")->required();
  c->add_option("--scale", flags->scale, "from the surface's units to metres: 0.001 of millimetres")
      ->check(number_from(1e-6, 1e3));
  c->add_option("--material", flags->material, "a name that palpate-server --list-materials knows")
      ->type_name("NAME")
      ->required();
  c->add_option("--rate-hz", flags->rate_hz, "frames a second")->check(number_from(1.0, 200.0));
  c->add_option("--error", flags->error, "of the force against the continuum, a share")->check(number_from(1e-3, 1.0));
  c->add_option("--radius-mm", flags->radius_mm, "contact radius of the tip")->check(number_from(1.0, 200.0));
  c->add_option("--held", flags->held, "share of the height, from below, that is fixed")->check(number_from(0.0, 0.9));
  c->add_option("--out", flags->out, "scene file to write; the surface is copied beside it")->type_name("FILE")->required();
  c->callback([flags, &run] { run = [flags] { return run_advise(*flags); }; });
}

}  // namespace palpate
