// Meshes of the specimens of classic solutions, with `n` cells over the length that determines the error.
#pragma once

#include "bench/tissue/block_mesh.hpp"

namespace palpate {

/// Cube from 0 to its size with n x n x n cells; inner nodes are moved by up to a sixth of a cell, so there are no straight lines
/// inside.
BlockMesh crooked_cube(int n, double size_m);
/// Box from 0, of nx x ny x nz cells.
BlockMesh box_mesh(const std::array<int, 3>& cells, const Vec3& size_m);
/// Whole cylinder around z, with n cells over its radius and cells of that length along it: a square core and four blocks around
/// it.
BlockMesh cylinder(int n, double radius_m, double length_m);
/// Octant x, y, z > 0 of a hollow sphere, n cells through its wall.
BlockMesh hollow_sphere_octant(int n, double inner_m, double outer_m);
/// Quarter x, y > 0 of a disc around z, surface at z = 0, matter below, n cells over the radius `near_m` of the punch or ball;
/// cells grow with the distance from there.
BlockMesh layer_quarter(int n, double near_m, double thickness_m, double outer_m);
/// Cook's membrane [mm to m]: (0, 0), (48, 44), (48, 60), (0, 44); n x n cells and one through its thickness.
BlockMesh cooks_membrane(int n, double thickness_m);

/// Nodes whose position passes a test.
std::vector<std::uint32_t> nodes_where(const std::vector<Vec3>& nodes, const std::function<bool(const Vec3&)>& test);

}  // namespace palpate
