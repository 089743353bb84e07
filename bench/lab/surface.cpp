// palpate-lab surface: a surface as scenes read it, repaired, for programs that fill it (./dev mesh).
#include "bench/tissue/mended_surface.hpp"

#include <fmt/format.h>

#include "bench/lab/experiments.hpp"
#include "bench/output/output.hpp"
#include "common/command_line/flags.hpp"

namespace palpate {
namespace {

struct SurfaceFlags {
  std::string surface, out;
  double edge = 0;
  bool skin = false;
};

int run_surface(const SurfaceFlags& flags) {
  const MendedSurface surface = mended_surface(flags.surface, flags.edge, flags.skin);
  write_text(flags.out, as_stl(surface.mesh));
  if (surface.inner > 0) fmt::print("shells inside the solid that bound no hollow are left out, {} in all\n", surface.inner);
  if (flags.skin) fmt::print("the skin of a lattice of {:g} has {:.1f} % of the volume\n", flags.edge, 100 * surface.skin_share);
  fmt::print("{} is {:.4g} across and encloses {:.4g}: if those are {}, with \"scale\": {}\n", flags.surface, surface.across,
             surface.volume, surface.unit, surface.metres > 1e-4 ? fmt::format("{:g}", surface.metres) : "0.000001");
  return 0;
}

}  // namespace

void add_surface(CLI::App& app, Run& run) {
  auto flags = std::make_shared<SurfaceFlags>();
  CLI::App* c = app.add_subcommand("surface", "read a closed surface as scenes do, repair it, and write it for other programs");
  c->add_option("--surface", flags->surface, "closed surface (STL, OBJ)")->type_name("FILE")->required();
  c->add_option("--edge", flags->edge, "edge length of the mesh to be made, in the surface's units; checked; 0: none")
      ->capture_default_str();
  c->add_flag("--skin", flags->skin,
              "write the surface of a lattice of this spacing in its place, for a surface that crosses itself");
  c->add_option("--out", flags->out, "binary STL file to write, in the surface's units")->type_name("FILE.stl")->required();
  c->callback([flags, &run] { run = [flags] { return run_surface(*flags); }; });
}

}  // namespace palpate
