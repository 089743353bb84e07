// Meshes of the specimens that classic solutions are about, with `n` cells over what decides the error.
#pragma once

#include "bench/tissue/block_mesh.hpp"

namespace palpate {

/// n x n x n cells of a cube from 0 to its size, nodes inside it moved by up to a sixth of a cell: no straight lines within.
BlockMesh crooked_cube(int n, double size_m);
/// A box from 0, of cells nx x ny x nz.
BlockMesh box_mesh(const std::array<int, 3>& cells, const Vec3& size_m);
/// A whole cylinder around z, n cells over its radius and as long ones along it: a square core and four blocks around it.
BlockMesh cylinder(int n, double radius_m, double length_m);
/// The octant x, y, z > 0 of a hollow sphere, n cells through its wall.
BlockMesh hollow_sphere_octant(int n, double inner_m, double outer_m);
/// The quarter x, y > 0 of a disc around z, surface at z = 0, matter below, n cells over the radius `near_m` of what presses on
/// it; cells grow with the distance from there.
BlockMesh layer_quarter(int n, double near_m, double thickness_m, double outer_m);
/// Cook's membrane [mm to m]: (0, 0), (48, 44), (48, 60), (0, 44); n x n cells and one through its thickness.
BlockMesh cooks_membrane(int n, double thickness_m);

/// Nodes for which a test of the place holds.
std::vector<std::uint32_t> nodes_where(const std::vector<Vec3>& nodes, const std::function<bool(const Vec3&)>& test);

}  // namespace palpate
