// Messages to datagrams and back. FlatBuffers (schema/wire.fbs) underneath; nothing of it shows here.
//
// The wire rounds: positions to 2^-27 m, those of a mesh to 2^-19 m, forces and the numbers of a model to float32, a patch's
// local surface to 16 bits (docs/reference/wire.md has the table). What decode() returns is what encode() rounded to:
// encode(decode(bytes))
// == bytes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "common/wire/messages.hpp"

namespace palpate {

/// Why bytes from the wire were dropped. Each is counted by the receiver.
enum class WireFault : std::uint8_t {
  none,
  too_short,
  too_long,
  not_palpate,
  version,
  malformed,
  out_of_range,
  not_finite,
  patch_refused
};
inline constexpr std::size_t kWireFaults = 9;
const char* describe(WireFault fault);

inline constexpr std::size_t kHelloBytes = 512;      ///< every Hello has at least this size, every Welcome and Refuse at most
inline constexpr std::size_t kMaxRefuseBytes = 200;  ///< longer refusal texts are cut
inline constexpr std::size_t kMaxPieceTriangles = 116, kMaxPieceVertices = 104;  ///< of a MeshPiece
inline constexpr std::size_t kTriangleBytes = 9, kVertexBytes = 10;              ///< there
inline constexpr std::size_t kMaxPieceBytes = 1060;                              ///< of the blocks of a ShapePiece
inline constexpr std::uint32_t kMaxMeshVertices = 1u << 24;                      ///< of a surface

/// Verifies the buffer, then bounds, then finiteness, then sense, and runs check() on a patch. `message` is meaningful only
/// when `none` is returned, except that after `version` its instance, station and seq are read where they could be.
/// Never throws, never reads outside `bytes`.
[[nodiscard]] WireFault decode(std::span<const std::byte> bytes, Message& message);

/// Number of bytes written into `out`; 0 when the message does not fit (the caller sends fewer vertices, samples or modes),
/// or holds a number that the wire cannot carry (not finite, a position outside of the world).
[[nodiscard]] std::size_t encode(const Message& message, std::span<std::byte> out);

/// Couplings of D travel as multiples of 1/32767 of sqrt(D_ii D_jj). This takes (r - 1) / 65534 of each away, of B_d too, so that
/// the patch passes check() however they are rounded; g follows, so that nothing changes at the stamp.
void leave_room_for_rounding(Patch& patch);

/// The most vertices of a local surface that surely fit into kMaxDatagramBytes beside `modes` modes and `triangles` triangles, or
/// as many as such a surface may have, at most kMaxPortVertices; less than 3 when no surface fits. `loaded`: the patch has a
/// load_rate; `branches` of a stress that fades; so many `others` of the other tools are contacts.
int max_port_vertices(int modes, int triangles = kMaxPortTriangles, bool loaded = false, int branches = 0, int others = 0);

/// The most modes of a patch that fit into kMaxDatagramBytes, with `branches` of a stress that fades: kMaxModes for attach
/// without; for touch as many as leave room for kMinUsefulVertices vertices, enough for the tool to move about between frames, or
/// for a triangle where terms bring more.
inline constexpr int kMinUsefulVertices = 6;
int max_port_modes(ContactKind contact, Scheme scheme, int branches = 0);

}  // namespace palpate
