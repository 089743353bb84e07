#include <fmt/format.h>

#include <cmath>

#include "bench/world/draw.hpp"

namespace palpate {
namespace {

struct Lattice {
  bool planar = false;
  int nx = 3, ny = 3, nz = 3;
  double spacing_m = 0.02, density_kg_m3 = 1000;

  double depth_m() const { return planar ? spacing_m : spacing_m * (nz - 1); }
  double node_mass_kg() const {
    const double volume = spacing_m * (nx - 1) * spacing_m * (ny - 1) * depth_m();
    return density_kg_m3 * volume / (nx * ny * (planar ? 1 : nz));
  }
  std::string json() const {
    const double x = spacing_m * (nx - 1), y = spacing_m * (ny - 1);
    if (planar)
      return fmt::format("\"nodes\": [{}, {}], \"size_m\": [{:.6g}, {:.6g}], \"thickness_m\": {:.6g}", nx, ny, x, y, depth_m());
    return fmt::format("\"nodes\": [{}, {}, {}], \"size_m\": [{:.6g}, {:.6g}, {:.6g}]", nx, ny, nz, x, y, depth_m());
  }
};

Lattice draw_lattice(Random& random, bool planar, bool small) {
  const auto few = [&](std::uint64_t from, std::uint64_t more) { return static_cast<int>(from + random.bits() % more); };
  Lattice l;
  l.planar = planar;
  l.nx = few(3, 3);
  l.ny = few(3, 3);
  l.nz = few(3, 2);
  if (small) l.nx = l.ny = l.nz = 3;
  l.spacing_m = random.uniform(0.015, 0.03);
  l.density_kg_m3 = random.uniform(800, 1200);
  return l;
}

std::string draw_tool(Random& random, bool attach, double spacing_m) {
  const double friction = random.uniform(0, 0.8), coupling = random.uniform(300, 1500);
  const double radius = random.chance(0.5) ? random.uniform(1.05, 1.6) * spacing_m : 0;
  if (attach) return "{ \"contact\": \"attach\" }";
  return fmt::format("{{ \"contact\": \"touch\", \"mu\": {:.6g}, \"contact_stiffness_n_m\": {:.6g}, \"radius_m\": {:.6g} }}",
                     friction, coupling, radius);
}

}  // namespace

std::string draw_scene(std::uint64_t seed, bool small) {
  Random random = part_of(seed, Part::body);
  const bool attach = random.chance(0.35), planar = attach && random.chance(0.25);
  const Lattice lattice = draw_lattice(random, planar, small);
  // As stiff as a Phantom can still render at the port (about 6 k for a node of the surface), and not so soft that the body
  // collapses.
  const double k = random.uniform(15, 90), ratio = random.uniform(0.1, 0.6);
  const double b = 2 * ratio * std::sqrt(k * lattice.node_mass_kg());
  std::string more;
  const double law = random.uniform(), stiffening = random.uniform(3, 30);
  if (law > 0.75 && law <= 0.95) more += fmt::format(", \"spring_law\": \"stiffening\", \"stiffening\": {:.6g}", stiffening);
  if (law > 0.95) more += ", \"spring_law\": \"thigh-skin\"";
  const double softer = random.uniform(0.25, 0.7), share = random.uniform(0.3, 0.8);
  if (random.chance(0.3) && !planar)
    more += fmt::format(", \"layers\": [ {{\"below_z_m\": {:.6g}, \"stiffness_n_m\": {:.6g}, \"damping_n_s_m\": {:.6g}}} ]",
                        share * lattice.depth_m(), softer * k, softer * b);
  if (random.chance(0.2) && !planar && k > 45) more += ", \"gravity_m_s2\": [0, 0, -9.81]";
  return fmt::format(
      "{{\n  \"name\": \"world{}\",\n  \"body\": {{ \"lattice\": {{\n    {}, \"density_kg_m3\": {:.6g},\n"
      "    \"stiffness_n_m\": {:.6g}, \"damping_n_s_m\": {:.6g}, \"fixed_faces\": [{}]{}\n  }} }},\n  \"tool\": {}\n}}\n",
      seed, lattice.json(), lattice.density_kg_m3, k, b, planar ? "\"x-\", \"x+\", \"y-\"" : "\"z-\"", more,
      draw_tool(random, attach, lattice.spacing_m));
}

}  // namespace palpate
