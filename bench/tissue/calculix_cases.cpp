// Bodies with reference solutions by CalculiX 2.20: quadratic hexahedra (C3D20R), neo-Hookean (bench/calculix/README.md).
//
//   bar      100 x 30 x 20 mm, 400 kPa, 1000 kg/m^3, clamped at one end, hangs in gravity: sag of its free end [mm]
//   punch    a square of 20 x 20 mm glued to the top of a block of 60 x 60 x 30 mm, 10 kPa, bonded below, pushed in by 3 and 9
//            mm: force [N]. The stress at its edge is unbounded, so the reference is extrapolated from two meshes to elements of
//            zero size, assuming an error proportional to their size.

#include <fmt/format.h>

#include <cmath>
#include <stdexcept>

#include "bench/tissue/tissue_case.hpp"
#include "server/body/settle.hpp"

namespace palpate {
namespace {

constexpr double kSmallM = 1e-9;

std::string matter(TissueElement element, double young_pa, double poisson) {
  if (element == TissueElement::spring) return fmt::format(R"("young_pa": {})", young_pa);
  return fmt::format(R"("solid": {{"element": "{}", "young_pa": {}, "poisson": {}}})",
                     kTissueElementNames[static_cast<int>(element)], young_pa, poisson);
}

Scene bar(TissueElement element, double poisson, int cells_high) {
  return read_scene(
      fmt::format(R"({{"body": {{"lattice": {{"nodes": [{}, {}, {}], "size_m": [0.1, 0.03, 0.02], "fixed_faces": ["x-"],
                                "gravity_m_s2": [0, 0, -9.81], {}}}}}}})",
                  5 * cells_high + 1, 3 * cells_high / 2 + 1, cells_high + 1, matter(element, 400e3, poisson)),
      "bar.json");
}

Scene block(TissueElement element, double poisson, int cells_high) {
  return read_scene(
      fmt::format(R"({{"body": {{"lattice": {{"nodes": [{0}, {0}, {1}], "size_m": [0.06, 0.06, 0.03], "fixed_faces": ["z-"],
                                {2}}}}}}})",
                  2 * cells_high + 1, cells_high + 1, matter(element, 10e3, poisson)),
      "block.json");
}

Equilibrium still(const Dynamics& dynamics, const BodyState& from) {
  Equilibrium found = find_equilibrium(dynamics, from);
  if (!found.found) throw std::runtime_error("no equilibrium was found");
  return found;
}

double sag_mm(const Scene& scene) {
  const Dynamics dynamics(scene.body);
  const Equilibrium hangs = still(dynamics, dynamics.rest_state());
  // Middle of the upper edge of its end, or the two nodes nearest to it.
  double sum_m = 0, nearest_m = 1;
  int count = 0;
  for (std::uint32_t i = 0; i < dynamics.nodes(); ++i) {
    const Vec3& x = scene.body.nodes[i];
    const double aside_m = std::abs(x.y() - 0.015);
    if (x.x() < 0.1 - kSmallM || x.z() < 0.02 - kSmallM || aside_m > nearest_m + kSmallM) continue;
    if (aside_m < nearest_m - kSmallM) sum_m = 0, count = 0;
    nearest_m = aside_m;
    sum_m += x.z() - at_node(hangs.state.x, i).z();
    ++count;
  }
  return 1e3 * sum_m / count;
}

double punch_n(Scene scene, double depth_m) {
  constexpr double kMostAtOnceM = 0.003;
  std::vector<std::uint32_t> pressed;
  for (std::uint32_t i = 0; i < scene.body.nodes.size(); ++i) {
    const Vec3& x = scene.body.nodes[i];
    const double across = std::max(std::abs(x.x() - 0.03), std::abs(x.y() - 0.03));
    if (x.z() < 0.03 - kSmallM || across > 0.01 + kSmallM) continue;
    pressed.push_back(i);
    scene.body.fixed[i] = 1;
  }
  const Dynamics dynamics(scene.body);
  BodyState state = dynamics.rest_state();
  const int steps = static_cast<int>(std::ceil(depth_m / kMostAtOnceM - kSmallM));
  for (int k = 0; k < steps; ++k) {
    for (const std::uint32_t i : pressed) at_node(state.x, i).z() -= depth_m / steps;
    state = still(dynamics, state).state;
  }
  double force_n = 0;
  for (const std::uint32_t i : pressed) force_n += dynamics.element_force(state, i).z();
  return force_n;
}

}  // namespace

std::vector<TissueCase> calculix_cases() {
  struct Asked {
    double poisson, punch_m, reference;
  };
  constexpr Asked kAsked[] = {{0.25, 0, 9.42},     {0.3, 0, 9.36},      {0.45, 0, 9.07},
                              {0.49, 0, 8.93},     {0.499, 0, 8.86},    {0.45, 0.003, 1.28},
                              {0.45, 0.009, 4.38}, {0.49, 0.003, 1.38}, {0.499, 0.003, 1.41}};
  std::vector<TissueCase> cases;
  for (const Asked& asked : kAsked) {
    const bool is_bar = asked.punch_m == 0;
    TissueCase& c = cases.emplace_back();
    c.family = "CalculiX";
    c.name = is_bar ? fmt::format("bar, nu = {}", asked.poisson)
                    : fmt::format("punch {:g} mm, nu = {}", 1e3 * asked.punch_m, asked.poisson);
    c.unit = is_bar ? "mm" : "N";
    c.reference = asked.reference;
    c.by = "CalculiX 2.20";
    c.elements = {TissueElement::hexahedron, TissueElement::tetrahedron};
    if (asked.poisson == 0.25) c.elements.push_back(TissueElement::spring);  // Poisson's ratio of springs, by Cauchy's relation
    c.cells = is_bar ? std::vector<int>{2, 4, 8} : std::vector<int>{3, 6, 9};
    c.scene = [asked, is_bar](TissueElement element, int cells) {
      return is_bar ? bar(element, asked.poisson, cells) : block(element, asked.poisson, cells);
    };
    c.solve = [asked, is_bar, of = c.scene](TissueElement element, int cells) {
      const Scene scene = of(element, cells);
      return TissueSolution{scene.body.nodes.size(), is_bar ? sag_mm(scene) : punch_n(scene, asked.punch_m)};
    };
  }
  return cases;
}

}  // namespace palpate
