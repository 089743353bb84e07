// A solid as tetrahedra: from the cells of a lattice or from a file, checked, with its outer surface and its masses.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "server/scene/grid.hpp"
#include "server/scene/scene.hpp"

namespace palpate {

struct TetraMesh {
  std::vector<Vec3> vertices;      ///< [m]
  std::vector<Tetrahedron> cells;  ///< `material` is the region's number in the file, 0 from a lattice
};

/// Every cell of a lattice as six tetrahedra around its diagonal (Kuhn): neighbours agree on the diagonal of the face they share.
std::vector<Tetrahedron> split_cells(const CellSet& cells, const Grid& grid, std::span<const std::uint32_t> number);

Vec3 centre_of(const Tetrahedron& cell, std::span<const Vec3> x);

/// Signed volume of a tetrahedron [m^3].
double volume_of(const Tetrahedron& cell, std::span<const Vec3> x);

/// Mean ratio 12 (3 V)^(2/3) / sum of squared edges: 1 for a regular tetrahedron, 0 for a flat one, negative inside out.
double quality_of(const Tetrahedron& cell, std::span<const Vec3> x);

/// Faces that belong to one tetrahedron only, counter-clockwise seen from outside.
std::vector<Triangle> outer_faces(std::span<const Tetrahedron> cells);

/// A quarter of each tetrahedron's mass to each of its nodes.
std::vector<double> lumped_masses(std::span<const Tetrahedron> cells, std::span<const Vec3> x, double density_kg_m3);

inline constexpr double kMinQuality = 0.02;  ///< a mesh with a flatter tetrahedron is refused

/// A mesh of a file that a body can be made of: turns what is inside out, drops vertices that no cell has. Throws InputError that
/// begins with `where` when cells are flat (kMinQuality), the mesh falls apart or faces belong to three cells.
void check_mesh(TetraMesh& mesh, const std::string& where);

}  // namespace palpate
