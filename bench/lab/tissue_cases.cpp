#include "bench/lab/tissue_cases.hpp"

#include <fmt/format.h>

#include <cmath>
#include <stdexcept>

#include "bench/output/output.hpp"
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
  // The middle of the upper edge of its end, or the two nodes beside it.
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

const std::vector<TissueCase>& tissue_cases() {
  static const std::vector<TissueCase> all{{"bar, nu = 0.25", "mm", 0.25, 0, 9.42},
                                           {"bar, nu = 0.3", "mm", 0.3, 0, 9.36},
                                           {"bar, nu = 0.45", "mm", 0.45, 0, 9.07},
                                           {"bar, nu = 0.49", "mm", 0.49, 0, 8.93},
                                           {"bar, nu = 0.499", "mm", 0.499, 0, 8.86},
                                           {"punch 3 mm, nu = 0.45", "N", 0.45, 0.003, 1.28},
                                           {"punch 9 mm, nu = 0.45", "N", 0.45, 0.009, 4.31},
                                           {"punch 3 mm, nu = 0.49", "N", 0.49, 0.003, 1.38},
                                           {"punch 3 mm, nu = 0.499", "N", 0.499, 0.003, 1.41}};
  return all;
}

std::optional<TissueAnswer> answer(const TissueCase& asked, TissueElement element, int cells_high) {
  if (element == TissueElement::spring && asked.poisson != 0.25) return std::nullopt;
  const bool is_bar = asked.punch_m == 0;
  const Scene scene = is_bar ? bar(element, asked.poisson, cells_high) : block(element, asked.poisson, cells_high);
  const std::int64_t begin = processor_ns();
  const double value = is_bar ? sag_mm(scene) : punch_n(scene, asked.punch_m);
  return TissueAnswer{element, cells_high, scene.body.nodes.size(), value, 1e-9 * static_cast<double>(processor_ns() - begin)};
}

}  // namespace palpate
