// palpate-lab advise: recommends support, tip, mesh, step and scheme for a surface and a material on this machine, with the
// expected error and cost, and a scene that runs.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>

#include "bench/lab/experiments.hpp"
#include "bench/output/output.hpp"
#include "bench/tissue/advice_text.hpp"
#include "common/base/error.hpp"
#include "common/command_line/flags.hpp"

namespace palpate {
namespace {

struct AdviseFlags {
  std::string surface, material, out, up = "z";
  double scale = 1, rate_hz = 20, error = 0.05;
  std::optional<double> radius_mm, held;
};

void print_body(const AdvisedBody& b) {
  const Vec3 mm = 1e3 * b.size_m;
  fmt::print(
      "size         {:.4g} x {:.4g} x {:.4g} mm (x, y, z)\n"
      "volume       {:.4g} ml, {:.3g} kg\n"
      "orientation  {}\n"
      "support      the lowest {:.3g} mm, {:.0f} % of the volume\n"
      "tip          {:.3g} mm radius\n",
      mm.x(), mm.y(), mm.z(), 1e6 * b.volume_m3, b.mass_kg, orientation_in_words(b.size_m), 1e3 * b.held_below_m,
      100 * b.held_volume_share, 1e3 * b.radius_m);
  std::fflush(stdout);
}

std::string frame_text(const AdvisedMesh& mesh) {
  if (!mesh.timed()) return "-";
  return std::isfinite(mesh.frame_ms()) ? fmt::format("{:.1f}", mesh.frame_ms()) : "unsolved";
}

void print_tried(const Advice& advice) {
  fmt::print("\n  {:>12}{:>8}{:>7}{:>8}{:>12}{:>11}{:>17}{:>12}\n", "spacing [mm]", "nodes", "held", "cells", "volume [%]",
             "error [%]", "worst error [%]", "frame [ms]");
  const auto error_text = [&](double error) { return advice.error_known() ? fmt::format("{:.1f}", 100 * error) : "-"; };
  for (std::size_t i = 0; i < advice.tried.size(); ++i) {
    const AdvisedMesh& m = advice.tried[i];
    fmt::print("{} {:>12.2f}{:>8}{:>7}{:>8}{:>12.1f}{:>11}{:>17}{:>12}\n", i == advice.chosen ? '*' : ' ', 1e3 * m.spacing_m,
               m.nodes, m.held, m.cells, 100 * m.filled_share, error_text(m.mesh_error), error_text(m.worst_error),
               frame_text(m));
  }
  fmt::print("  *: chosen");
  if (!std::ranges::all_of(advice.tried, &AdvisedMesh::timed))
    fmt::print("; - under frame: not timed, as a coarser mesh fits or is too slow already");
  fmt::print("\n");
}

void print_advice(const AdviceRequest& request, const Advice& advice, const std::filesystem::path& scene) {
  const AdvisedMesh& m = advice.tried[advice.chosen];
  print_tried(advice);
  fmt::print("\nA lattice of {:.2f} mm of hexahedra ({} nodes), steps of {:g} ms, patches '{}'.\n", 1e3 * m.spacing_m, m.nodes,
             1e3 * advice.step_s, name_of(m.scheme));
  if (advice.error_known())
    fmt::print(
        "Force of a light touch: {:.1f} % from the continuum, of which the step {:.1f} %; at the worst place, {}, {:.0f} %. The "
        "model of the error is off by up to {:.1f} %.\n",
        100 * advice.error(), 100 * advice.step_error, in_mm(m.worst_error_place), 100 * (m.worst_error + advice.step_error),
        100 * advice.model_error);
  fmt::print("A frame takes {:.1f} ms of a core (step {:.1f}, patch {:.1f}), with a hand at {}{}.\n", m.frame_ms(), m.step_ms,
             m.patch_ms, in_mm(m.worst_place), advice.fast_enough ? ", where it takes longest" : "");
  if (m.deep_ms > 0 && std::isfinite(m.deep_ms))
    fmt::print("Pressed {:.3g} mm deep it takes up to {:.1f} ms, at {}.\n", 1e3 * advice.deep_m, m.deep_ms, in_mm(m.deep_place));
  for (const std::string& line : misfits(request, advice)) fmt::print("{}\n", line);
  fmt::print("\n  palpate-server --scene {} --rate-hz {:g}\n", scene.string(), request.rate_hz);
}

/// Copies the surface next to the scene, as meshes must lie below the scene's folder.
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
  request.up = flags.up;
  request.material = flags.material;
  request.rate_hz = flags.rate_hz;
  request.error = flags.error;
  if (flags.radius_mm) request.radius_m = 1e-3 * *flags.radius_mm;
  request.held_share = flags.held;
  AdviceHearer hearer;
  hearer.says = [](const std::string& what) { fmt::print(stderr, "{}\n", what); };
  hearer.body = print_body;
  const Advice advice = advise(request, processor_ns, hearer);
  const std::filesystem::path scene = flags.out;
  const AdvisedMesh& m = advice.tried[advice.chosen];
  const std::string file = bring_surface(request.surface, scene);
  write_text(scene, advised_scene(request, advice.body, file, m.spacing_m, advice.step_s));
  print_advice(request, advice, scene);
  return 0;
}

}  // namespace

void add_advise(CLI::App& app, Run& run) {
  auto flags = std::make_shared<AdviseFlags>();
  CLI::App* c = app.add_subcommand(
      "advise", "recommend support, tip, mesh, step and scheme for a surface and a material, with the expected error and cost");
  c->add_option("--surface", flags->surface, "a closed surface, STL or OBJ")->type_name("FILE")->required();
  c->add_option("--scale", flags->scale, "factor from the units of the surface to metres; 0.001 for millimetres")
      ->check(number_from(1e-6, 1e3));
  c->add_option("--material", flags->material, "name of a material of palpate-server --list-materials")
      ->type_name("NAME")
      ->required();
  c->add_option("--rate-hz", flags->rate_hz, "frames a second")->check(number_from(1.0, 200.0));
  c->add_option("--error", flags->error, "allowed error of the force against the continuum, as a share")
      ->check(number_from(1e-3, 1.0));
  c->add_option("--up", flags->up, "axis of the surface that is up in the scene: x, -x, y, -y, z or -z")->type_name("AXIS");
  c->add_option("--radius-mm", flags->radius_mm, "contact radius of the tip; default: one is proposed")
      ->check(number_from(1.0, 200.0));
  c->add_option("--held", flags->held, "share of the height, from below, that is fixed; default: one is proposed")
      ->check(number_from(0.0, 0.9));
  c->add_option("--out", flags->out, "scene file to write; the surface is copied to its folder")->type_name("FILE")->required();
  c->callback([flags, &run] { run = [flags] { return run_advise(*flags); }; });
}

}  // namespace palpate
