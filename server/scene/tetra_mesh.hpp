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
  std::vector<Tetrahedron> flat;   ///< left out between cells, whose faces they share (check_mesh)
};

/// Cells and flat ones together.
std::vector<Tetrahedron> all_of(const TetraMesh& mesh);

/// Corners of the cells in files: for hexahedra and prisms one end after the other, in the same direction; for pyramids the base
/// first.
enum class CellKind : std::uint8_t { tetrahedron = 4, pyramid = 5, prism = 6, hexahedron = 8 };

/// Adds a cell as tetrahedra that share its corner of the lowest number, with the square faces cut through their own lowest
/// corner (Dompierre et al., 1999): cells that share a face cut it in the same way.
void add_cell(CellKind kind, std::span<const std::uint32_t> corners, std::uint32_t region, std::vector<Tetrahedron>& out);

/// Splits every cell of a lattice into six tetrahedra around its diagonal (Kuhn): neighbours agree on the diagonal of the face
/// they share.
std::vector<Tetrahedron> split_cells(const CellSet& cells, const Grid& grid, std::span<const std::uint32_t> number);

Vec3 centre_of(const Tetrahedron& cell, std::span<const Vec3> x);

/// Signed volume of a tetrahedron [m^3].
double volume_of(const Tetrahedron& cell, std::span<const Vec3> x);

/// Mean ratio 12 (3 V)^(2/3) / sum of squared edges: 1 for a regular tetrahedron, 0 for a flat one, negative if inside out.
double quality_of(const Tetrahedron& cell, std::span<const Vec3> x);

/// Faces that belong to one tetrahedron only, counter-clockwise seen from outside.
std::vector<Triangle> outer_faces(std::span<const Tetrahedron> cells);

/// Lumped masses of the nodes: each tetrahedron adds a quarter of its mass, by its share, to each of its nodes.
std::vector<double> lumped_masses(std::span<const Tetrahedron> cells, std::span<const Vec3> x, double density_kg_m3);

inline constexpr double kMinQuality = 0.02;     ///< at most kMostFlat of the tetrahedra may be flatter, or a mesh is refused
inline constexpr double kLeastQuality = 0.005;  ///< lowest quality of those few with which a body can still be stepped
inline constexpr double kMostFlat = 0.01;       ///< largest share of flat tetrahedra, of their number and of the volume

/// Returns the connected part of every tetrahedron; parts have no face in common, at most nodes and edges: hinges.
std::vector<std::uint32_t> parts_by_faces(std::span<const Tetrahedron> cells);

/// Checks a mesh from a file and makes it usable for a body: reorients cells that are inside out, drops vertices that no cell has
/// and, with a line on stderr, duplicate cells and those with a corner twice. The few that are flatter than kLeastQuality move to
/// `flat`, or are dropped at the surface: they have next to no volume, and their neighbours have their nodes. Throws an
/// InputError that begins with `where` if more than few cells are flat, a node has flat cells alone, the mesh falls apart or a
/// face belongs to three cells.
void check_mesh(TetraMesh& mesh, const std::string& where);

}  // namespace palpate
