// Cuts the mesh of a room into datagrams: first its vertices, then its triangles.
#pragma once

#include "common/wire/messages.hpp"
#include "server/core/room_info.hpp"

namespace palpate {

std::uint32_t mesh_pieces(const BodyMesh& mesh);
/// Requires piece < mesh_pieces(facts.mesh).
MeshPiece mesh_piece(const RoomInfo& facts, std::uint32_t piece);

}  // namespace palpate
