#include "bench/paper/cube.hpp"

#include <fmt/format.h>

#include <cmath>

#include "server/scene/lattice.hpp"

namespace palpate {
namespace {

constexpr double kStiffnessNM = 60, kDampingPerStiffnessS = 0.004;

LatticeSettings cube_settings(double stiffness_n_m, double width_m = kPaperCubeM) {
  LatticeSettings s;
  constexpr int kCells = 5;
  const int across = static_cast<int>(std::lround(kCells * width_m / kPaperCubeM)) + 1;
  s.nodes = {across, across, kCells + 1};
  s.size_m = Vec3(width_m, width_m, kPaperCubeM);
  s.stiffness_n_m = stiffness_n_m;
  s.damping_n_s_m = kDampingPerStiffnessS * stiffness_n_m;
  s.fixed.faces = {"z-"};
  return s;
}

Scene scene_of(const std::string& name, const LatticeSettings& settings, ContactKind contact) {
  constexpr std::array<int, 3> kNode{2, 2, 5};
  LatticeBody lattice = build_box(settings);
  Scene scene;
  scene.name = name;
  scene.tool.contact = contact;
  scene.tool.node = lattice.number[lattice.grid.index(kNode)];
  scene.body = std::move(lattice.body);
  return scene;
}

LayerSettings region(const Vec3& above_m, const Vec3& below_m, double stiffness_n_m) {
  return {below_m, above_m, stiffness_n_m, kDampingPerStiffnessS * stiffness_n_m};
}

}  // namespace

Scene paper_cube(ContactKind contact, double width_m) { return scene_of("cube6", cube_settings(kStiffnessNM, width_m), contact); }

Scene solid_cube(ContactKind contact, double width_m) {
  LatticeSettings s = cube_settings(kStiffnessNM, width_m);
  s.solid = SolidSettings{.material = {SolidLaw::neo_hookean, 10e3, 0.45, kDampingPerStiffnessS}};
  return scene_of("solid-cube6", s, contact);
}

Scene flawed_cube(Flaw flaw, double ratio) {
  constexpr double kAll = 1;  // beyond the body
  constexpr double kSoftCoreTopNM = 120;
  LatticeSettings s = cube_settings(flaw == Flaw::soft_below ? kSoftCoreTopNM : kStiffnessNM);
  // Elements whose midpoint lies inside: the bounds exclude the planes of nodes at which a region ends.
  constexpr double kEdge = 0.001;
  const auto lump = [&](double bottom_m) {
    return region(Vec3(0.02 - kEdge, 0.02 - kEdge, bottom_m - kEdge), Vec3(0.06 + kEdge, 0.06 + kEdge, bottom_m + 0.04 + kEdge),
                  kStiffnessNM * ratio);
  };
  switch (flaw) {
    case Flaw::soft_below:
      s.layers = {region(Vec3::Constant(-kAll), Vec3(kAll, kAll, 0.06), kSoftCoreTopNM / ratio)};
      break;
    case Flaw::stiff_inside:
      s.layers = {lump(0.02)};
      break;
    case Flaw::stiff_at_top:
      s.layers = {lump(0.06)};
      break;
    case Flaw::torn:
      s.layers = {region(Vec3(-kAll, -kAll, 0.06 + kEdge), Vec3(kAll, kAll, 0.08 - kEdge), kStiffnessNM / ratio)};
      break;
  }
  return scene_of(fmt::format("{}, ratio {:g}", name_of(flaw), ratio), s, ContactKind::attach);
}

}  // namespace palpate
