// Tetrahedral meshes from files: Gmsh (.msh, versions 2.2 and 4.1, text) and VTK (.vtk, legacy UNSTRUCTURED_GRID, text).
//
// Tetrahedra are read; hexahedra, prisms and pyramids become tetrahedra, and of nodes on edges and faces cells keep their
// corners. Points, lines and faces are passed over. Regions: the physical group of an element in .msh (the first of several, 0
// without one), the integer cell data "region" in .vtk, of SCALARS or FIELD. Whatever else a file holds is skipped.
#pragma once

#include <string>
#include <string_view>

#include "server/scene/settings.hpp"
#include "server/scene/tetra_mesh.hpp"

namespace palpate {

/// The mesh in its place: scaled, rotated, moved, and checked (check_mesh). Throws InputError that begins with `where`.
TetraMesh read_tetra_mesh(const MeshSettings& settings, const std::string& where);

enum class TetraFormat { gmsh, vtk };
/// The same from memory; of `settings` the file's name is not used.
TetraMesh tetra_mesh(std::string_view text, TetraFormat format, const MeshSettings& settings, const std::string& where);

}  // namespace palpate
