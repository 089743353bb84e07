// Cuts the mesh of a room into datagrams: first its vertices, then its triangles.
#pragma once

#include "common/wire/messages.hpp"
#include "server/core/room_info.hpp"

namespace palpate {

std::uint32_t mesh_pieces(const BodyMesh& mesh);
/// Number of pieces of a rigid part, and one of them; `part`: its number, from 1 on.
std::uint32_t part_pieces(const PartMesh& part);
PartPiece part_piece(const PartMesh& part, std::uint32_t number, std::uint32_t piece);
/// Requires piece < mesh_pieces(facts.mesh).
MeshPiece mesh_piece(const RoomInfo& facts, std::uint32_t piece);

}  // namespace palpate
