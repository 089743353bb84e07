// palpate-lab advise: recommends support, tip, mesh, step and scheme for a surface and a material on this machine, with the
// expected error and cost, and a scene that runs.
#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <optional>

#include "bench/lab/experiments.hpp"
#include "bench/output/output.hpp"
#include "bench/tissue/advice.hpp"
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
  Eigen::Index longest, thinnest;
  mm.maxCoeff(&longest);
  mm.minCoeff(&thinnest);
  fmt::print(
      "size         {:.4g} x {:.4g} x {:.4g} mm (x, y, z)\n"
      "volume       {:.4g} ml, {:.3g} kg\n"
      "orientation  z is up; longest along {}, thinnest along {}{}\n"
      "support      the lowest {:.3g} mm, {:.0f} % of the volume\n"
      "tip          {:.3g} mm radius\n",
      mm.x(), mm.y(), mm.z(), 1e6 * b.volume_m3, b.mass_kg, "xyz"[longest], "xyz"[thinnest],
      thinnest == 2 ? "" : fmt::format(" (--up {} lays it on its broad side)", "xyz"[thinnest]), 1e3 * b.held_below_m,
      100 * b.held_volume_share, 1e3 * b.radius_m);
  std::fflush(stdout);
}

void print_tried(const Advice& advice) {
  fmt::print("\n  {:>12}{:>8}{:>7}{:>8}{:>12}{:>11}{:>17}{:>12}\n", "spacing [mm]", "nodes", "held", "cells", "volume [%]",
             "error [%]", "worst error [%]", "frame [ms]");
  for (std::size_t i = 0; i < advice.tried.size(); ++i) {
    const AdvisedMesh& m = advice.tried[i];
    fmt::print("{} {:>12.2f}{:>8}{:>7}{:>8}{:>12.1f}{:>11.1f}{:>17.1f}{:>12}\n", i == advice.chosen ? '*' : ' ',
               1e3 * m.spacing_m, m.nodes, m.held, m.cells, 100 * m.filled_share, 100 * m.mesh_error, 100 * m.worst_error,
               m.frame_ms() > 0 ? fmt::format("{:.1f}", m.frame_ms()) : "");
  }
}

std::string in_mm(const Vec3& place) {
  return fmt::format("({:.0f}, {:.0f}, {:.0f}) mm", 1e3 * place.x(), 1e3 * place.y(), 1e3 * place.z());
}

/// Prints a line for each bound that the scene exceeds.
void print_misfits(const AdviseFlags& flags, const Advice& advice) {
  const AdvisedMesh& m = advice.tried[advice.chosen];
  if (!std::isfinite(m.frame_ms()))
    fmt::print("Does not fit: the steps find no solution with a hand at {}.\n", in_mm(m.worst_place));
  else if (!advice.fast_enough)
    fmt::print("Does not fit: {:.1f} ms a frame with a hand at {}, of {:.0f}; this machine keeps {:.2g} frames a second of it.\n",
               m.frame_ms(), in_mm(m.worst_place), 1e3 / flags.rate_hz, std::floor(1e3 * kShareOfFrame / m.frame_ms()));
  if (m.spacing_m > advice.body.radius_m)
    fmt::print(
        "Does not fit: a tip of {:.3g} mm is narrower than the spacing of the nodes and pokes single ones; {:.3g} mm would do.\n",
        1e3 * advice.body.radius_m, 2e3 * m.spacing_m);
  else if (!advice.true_enough)
    fmt::print("Does not fit: the force is {:.0f} % from the continuum's, {:.3g} % was requested{}.\n", 100 * advice.error(),
               100 * flags.error, advice.fast_enough ? "; this is the most accurate of the meshes that are fast enough" : "");
  if (!advice.step_known)
    fmt::print("The error of the step is not known; no step follows a node that is pulled down by 10 mm.\n");
  if (std::abs(m.filled_share - 1) > 0.03)
    fmt::print("The body has {:.0f} % of the volume that the surface encloses: {}the spacing is too coarse for it.\n",
               100 * m.filled_share, m.filled_share < 1 ? "parts that do not hang together with the rest are left out, or " : "");
}

void print_advice(const AdviseFlags& flags, const Advice& advice, const std::filesystem::path& scene) {
  const AdvisedMesh& m = advice.tried[advice.chosen];
  print_tried(advice);
  fmt::print(
      "\nA lattice of {:.2f} mm of hexahedra ({} nodes), steps of {:g} ms, patches '{}'.\n"
      "Force of a light touch: {:.1f} % from the continuum, of which the step {:.1f} %; at the worst place, {}, {:.0f} %. The "
      "model of the error is off by up to {:.1f} %.\n"
      "A frame takes {:.1f} ms of this machine (step {:.1f}, patch {:.1f}) of {:.0f}, with a hand where it takes longest, at "
      "{}.\n",
      1e3 * m.spacing_m, m.nodes, 1e3 * advice.step_s, name_of(m.scheme), 100 * advice.error(), 100 * advice.step_error,
      in_mm(m.worst_error_place), 100 * (m.worst_error + advice.step_error), 100 * advice.model_error, m.frame_ms(), m.step_ms,
      m.patch_ms, 1e3 / flags.rate_hz, in_mm(m.worst_place));
  print_misfits(flags, advice);
  fmt::print("\n  palpate-server --scene {} --rate-hz {:g}\n", scene.string(), flags.rate_hz);
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
  print_advice(flags, advice, scene);
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
