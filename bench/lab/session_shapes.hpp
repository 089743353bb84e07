// Exports the shapes of a recording for other programs: PLY, or VTK's XML (.vtp, with a .pvd that gives ParaView the times).
// Points with `displacement` [m] from rest; triangles, or for a body without a surface the edges of its lattice.
#pragma once

#include <filesystem>

#include "common/record/reader.hpp"

namespace palpate {

enum class ShapeFormat : std::uint8_t { ply, vtk };

using Edges = std::vector<std::array<std::uint32_t, 2>>;
/// Edges between the recorded vertices of a body without triangles, from the scene in the head.
Edges edges_of(const RecordingHead& head);

/// Write one shape. Throw InputError if that fails.
void write_ply(const std::filesystem::path& file, const BodyMesh& mesh, const Edges& edges, const std::vector<Vec3>& positions);
void write_vtp(const std::filesystem::path& file, const BodyMesh& mesh, const Edges& edges, const std::vector<Vec3>& positions);

/// Writes OUT/shapes/shape_00000.EXT and so on, and OUT/shapes.pvd for VTK: one shape every 1 / `frames_hz`, from the first on.
/// Returns their number. The scene's rigid parts are OUT/parts/part_01.EXT and so on.
std::size_t export_shapes(RecordingReader& recording, const std::filesystem::path& out, ShapeFormat format, double frames_hz);

}  // namespace palpate
