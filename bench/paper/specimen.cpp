#include "bench/paper/specimen.hpp"

#include <cmath>

#include "server/scene/lattice.hpp"

namespace palpate {
namespace {

LatticeSettings box(int nodes, bool planar, const Material& material) {
  LatticeSettings s;
  s.planar = planar;
  s.nodes = {nodes, nodes, planar ? 1 : nodes + 1};
  s.size_m = Vec3::Constant(kSpecimenSizeM);
  if (!planar) s.size_m.z() *= nodes / (nodes - 1.0);
  s.stiffness_n_m = material.stiffness_n_m;
  s.damping_n_s_m = material.damping_n_s_m;
  if (planar)
    s.fixed.faces = {"x-", "x+", "y-"};
  else
    s.fixed.faces = {"z-"};
  const double count = nodes * nodes * s.nodes[2];
  s.density_kg_m3 = material.node_mass_kg * count / s.size_m.prod();
  return s;
}

}  // namespace

double Material::damping_ratio() const { return damping_n_s_m / std::sqrt(stiffness_n_m * node_mass_kg); }

Specimen::Specimen(LumpedBody body, std::uint32_t port_node)
    : body_(std::move(body)), dynamics_(body_), rest_(dynamics_.rest_state()), port_node_(port_node) {}

Specimen Specimen::sheet(int nodes, const Material& material) {
  LatticeBody lattice = build_box(box(nodes, true, material));
  const auto port = lattice.number[lattice.grid.index({(nodes - 1) / 2, nodes - 1, 0})];
  return Specimen(std::move(lattice.body), port);
}

Specimen Specimen::cube(int nodes, const Material& material) {
  LatticeBody lattice = build_box(box(nodes, false, material));
  const auto port = lattice.number[lattice.grid.index({(nodes - 1) / 2, (nodes - 1) / 2, nodes})];
  return Specimen(std::move(lattice.body), port);
}

SecondOrderSystem Specimen::system() const { return second_order_system(dynamics_, rest_, port_node_, body().fixed); }

std::vector<std::uint8_t> Specimen::near_port(int layers) const {
  std::vector<std::uint8_t> near(body().nodes.size(), 0);
  near[port_node_] = 1;
  const auto edges = edges_of(body());
  for (int layer = 0; layer < layers; ++layer) {
    const std::vector<std::uint8_t> before = near;
    for (const auto& [a, b] : edges)
      if (before[a] || before[b]) near[a] = near[b] = 1;
  }
  return near;
}

SecondOrderSystem Specimen::ring(int layers) const {
  std::vector<std::uint8_t> held = near_port(layers);
  for (auto& h : held) h = !h;
  return second_order_system(dynamics_, rest_, port_node_, held);
}

}  // namespace palpate
