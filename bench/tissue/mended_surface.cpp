#include "bench/tissue/mended_surface.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "common/base/error.hpp"
#include "server/scene/clip.hpp"
#include "server/scene/mesh_solid.hpp"
#include "server/scene/surface_repair.hpp"

namespace palpate {
namespace {

constexpr double kOrganM = 0.15;

std::pair<double, const char*> likely_unit(double across) {
  constexpr std::array<std::pair<double, const char*>, 4> kUnits{
      {{1, "metres"}, {0.01, "centimetres"}, {0.001, "millimetres"}, {0.000001, "micrometres"}}};
  const auto off = [&](const auto& unit) { return std::abs(std::log(unit.first * across / kOrganM)); };
  return *std::ranges::min_element(kUnits, {}, off);
}

TriangleMesh skin_of(const SignedDistance& solid, double spacing_m) {
  const Clipped clipped = clip_lattice(grid_around(solid, spacing_m), solid);
  TriangleMesh skin{clipped.nodes.positions, {}};
  skin.triangles = split_shorter(clipped.faces, skin.vertices);
  return skin;
}

}  // namespace

MendedSurface mended_surface(const std::string& file, double edge, bool skin) {
  const TriangleMesh given = read_surface(file, file);
  MendedSurface out;
  out.across = extent_of(given.vertices).maxCoeff();
  if (!(out.across > 0)) throw InputError(file, "holds no triangles", "a closed surface");
  std::tie(out.metres, out.unit) = likely_unit(out.across);
  if (edge != 0 && !(edge >= out.across / 100 && edge <= out.across / 2))
    throw InputError("--edge", fmt::format("is {:g} on a surface that is {:.4g} across", edge, out.across),
                     fmt::format("one in the surface's own units, for example {:.2g}", out.across / 15));
  MeshSettings settings;
  settings.scale = kOrganM / out.across;  // a size that a body may have, whatever the units
  out.mesh = closed_mesh(given, settings, file);
  const auto solid = make_mesh_solid(out.mesh);
  out.volume = solid->volume() / std::pow(settings.scale, 3);
  if (skin) {
    if (edge == 0) throw InputError("--skin", "needs --edge", "the spacing of the lattice");
    out.mesh = skin_of(*solid, settings.scale * edge);
    out.skin_share = signed_volume(out.mesh.triangles, out.mesh.vertices) / solid->volume();
  } else {
    out.inner = drop_inner_shells(out.mesh);
  }
  for (Vec3& x : out.mesh.vertices) x /= settings.scale;
  return out;
}

}  // namespace palpate
