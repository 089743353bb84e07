// A solid as hexahedra: the cells of a lattice, clipped or not.
#pragma once

#include <span>
#include <vector>

#include "server/scene/grid.hpp"
#include "server/scene/scene.hpp"

namespace palpate {

/// Returns every cell of a lattice as one element.
std::vector<Hexahedron> cells_as_hexahedra(const CellSet& cells, const Grid& grid, std::span<const std::uint32_t> number);

Vec3 centre_of(const Hexahedron& cell, std::span<const Vec3> x);

/// Lumped masses of the nodes: each hexahedron adds to each of its nodes its share of the density times the integral of the
/// node's trilinear shape function.
std::vector<double> lumped_masses(std::span<const Hexahedron> cells, std::span<const Vec3> x, double density_kg_m3);

}  // namespace palpate
