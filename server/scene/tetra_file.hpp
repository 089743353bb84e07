// Tetrahedral meshes from files: Gmsh (.msh, versions 2.2 and 4.1, text) and VTK (.vtk, legacy UNSTRUCTURED_GRID, text).
//
// Tetrahedra are read; hexahedra, prisms and pyramids are split into tetrahedra; cells with nodes on edges and faces keep only
// their corners. Points, lines and faces are ignored. Regions: the physical group of an element in .msh (the first of several, 0
// without one), the integer cell data "region" in .vtk, of SCALARS or FIELD. Everything else in a file is skipped.
#pragma once

#include <string>
#include <string_view>

#include "server/scene/settings.hpp"
#include "server/scene/tetra_mesh.hpp"

namespace palpate {

/// Reads the mesh, scales, rotates and moves it, and checks it (check_mesh). Throws an InputError that begins with `where`.
TetraMesh read_tetra_mesh(const MeshSettings& settings, const std::string& where);

enum class TetraFormat { gmsh, vtk };
/// The same from memory; the file name in `settings` is not used.
TetraMesh tetra_mesh(std::string_view text, TetraFormat format, const MeshSettings& settings, const std::string& where);

}  // namespace palpate
