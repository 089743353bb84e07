#include "bench/measure/drawn_scene.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "common/base/random.hpp"

namespace palpate {
namespace {

class Draw {
 public:
  explicit Draw(std::uint64_t seed) : random_(seed) {}
  int whole(int low, int high) { return low + static_cast<int>(random_.uniform() * (high - low + 1)); }
  double evenly(double low, double high) { return random_.uniform(low, high); }
  double by_decades(double low, double high) { return low * std::pow(high / low, random_.uniform()); }
  bool chance(double probability) { return random_.chance(probability); }

 private:
  Random random_;
};

// Numbers are written with few digits, so that the last bits of pow() do not matter.
std::string springs_of(Draw& draw, double height_m) {
  const double stiffness = draw.by_decades(15, 200), damping = stiffness * draw.by_decades(0.0005, 0.005);
  std::string springs = fmt::format("\"stiffness_n_m\": {:.3g}, \"damping_n_s_m\": {:.3g}", stiffness, damping);
  const double kind = draw.evenly(0, 1), stiffening = draw.by_decades(3, 60);
  if (kind < 0.25)
    springs += fmt::format(", \"spring_law\": \"stiffening\", \"stiffening\": {:.3g}", stiffening);
  else if (kind < 0.5)
    springs += fmt::format(", \"layers\": [{{\"below_z_m\": {:.3g}, \"stiffness_n_m\": {:.3g}}}]", height_m / 2, stiffness / 4);
  return springs;
}

std::string solid_of(Draw& draw) {
  const char* law = draw.chance(0.5) ? "neo-hookean" : "corotational";
  const double young = draw.by_decades(2500, 63000), poisson = draw.evenly(0.3, 0.48), damping = draw.by_decades(0.001, 0.02);
  return fmt::format("\"solid\": {{\"law\": \"{}\", \"young_pa\": {:.0f}, \"poisson\": {:.2g}, \"damping_s\": {:.2g}}}", law,
                     young, poisson, damping);
}

}  // namespace

DrawnScene drawn_scene(std::uint64_t number, bool solid) {
  Draw draw(2 * number + (solid ? 1 : 0));
  const std::array<int, 3> nodes{draw.whole(4, 8), draw.whole(4, 8), draw.whole(4, 8)};
  const double cell_m = solid ? draw.evenly(0.006, 0.014) : draw.evenly(0.008, 0.016);
  const auto side = [&](std::size_t axis) { return (nodes[axis] - 1) * cell_m; };
  const double radius_m = cell_m * draw.evenly(1, 1.8), friction = 0.3 * draw.whole(0, 2);
  const std::string tool =
      number % 2 == 0 ? fmt::format("\"contact\": \"attach\", \"node\": [{}, {}, {}]", nodes[0] / 2, nodes[1] / 2, nodes[2] - 1)
                      : fmt::format("\"contact\": \"touch\", \"radius_m\": {:.3g}, \"mu\": {:.1f}", radius_m, friction);
  const std::string material = solid ? solid_of(draw) : springs_of(draw, side(2));
  DrawnScene scene{fmt::format("{}-{}", solid ? "solid" : "springs", number), {}};
  scene.json = fmt::format(
      "{{\n  \"name\": \"{}\",\n  \"body\": {{\"lattice\": {{\"nodes\": [{}, {}, {}], \"size_m\": [{:.4g}, {:.4g}, {:.4g}], "
      "\"density_kg_m3\": 1000, \"fixed_faces\": [\"z-\"],\n    {}}}}},\n  \"tool\": {{{}}}\n}}\n",
      scene.name, nodes[0], nodes[1], nodes[2], side(0), side(1), side(2), material, tool);
  return scene;
}

}  // namespace palpate
