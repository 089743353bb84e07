// Converts messages to datagrams and back. Uses FlatBuffers (schema/wire.fbs), but does not expose them.
//
// The wire rounds: positions to 2^-27 m, those of a mesh to 2^-19 m, forces and the numbers of a model to float32, a patch's
// local surface to 16 bits (docs/reference/wire.md has the table). decode() returns the values to which encode() rounded:
// encode(decode(bytes)) == bytes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "common/wire/messages.hpp"

namespace palpate {

/// Reason for which bytes from the wire were dropped. Each is counted by the receiver.
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

inline constexpr std::size_t kHelloBytes = 512;      ///< least size of a Hello, largest of a Welcome or Refuse
inline constexpr std::size_t kMaxRefuseBytes = 200;  ///< longer refusal texts are truncated
inline constexpr std::size_t kMaxRoomNames = 64;     ///< limit of a RoomList
inline constexpr std::size_t kMaxPieceTriangles = 116, kMaxPieceVertices = 104, kMaxPieceRemoved = 340;  ///< of a MeshPiece
inline constexpr std::size_t kMaxParts = 16, kMaxPartItems = 90;  ///< of a scene; vertices or triangles of a PartPiece
inline constexpr double kMaxPartStiffnessNM = 1e6, kMaxPartFriction = 10;
inline constexpr std::uint32_t kMaxPartTriangles = 20'000, kMaxPartVertices = 3 * kMaxPartTriangles;
inline constexpr std::size_t kTriangleBytes = 9, kVertexBytes = 10, kRemovedBytes = 3;  ///< sizes in a MeshPiece
inline constexpr std::size_t kMaxPieceBytes = 1060;                                     ///< size of the blocks of a ShapePiece
inline constexpr std::uint32_t kMaxMeshVertices = 1u << 24;                             ///< limit of a surface

/// Verifies the buffer, then bounds, then finiteness, then consistency, and runs check() on a patch. `message` is valid only when
/// `none` is returned, except that after `version` its instance, station and seq are set if they could be read. Never throws,
/// never reads outside `bytes`.
[[nodiscard]] WireFault decode(std::span<const std::byte> bytes, Message& message);

/// Returns the number of bytes written into `out`; 0 when the message does not fit (the caller sends fewer vertices, samples or
/// modes), or contains a number that the wire cannot carry (not finite, a position outside the world).
[[nodiscard]] std::size_t encode(const Message& message, std::span<std::byte> out);

/// Couplings of D are sent as multiples of 1/32767 of sqrt(D_ii D_jj). This reduces each of them, and B_d, by (r - 1) / 65534, so
/// that the patch passes check() for any rounding; g is adjusted, so that nothing changes at the stamp.
void leave_room_for_rounding(Patch& patch);

/// Returns the largest number of vertices of a local surface that always fit into kMaxDatagramBytes with `modes` modes and
/// `triangles` triangles, at most the number that such a surface can have and kMaxPortVertices; less than 3 when no surface fits.
/// `loaded`: the patch has a load_rate; `branches`: number for a stress that relaxes; `contacts`: those besides that at the
/// surface.
int max_port_vertices(int modes, int triangles = kMaxPortTriangles, bool loaded = false, int branches = 0,
                      PatchContacts contacts = {});

/// Returns the largest number of modes of a patch that fit into kMaxDatagramBytes, with `branches` of a stress that relaxes: for
/// attach without branches kMaxModes; for touch as many as leave room for a triangle, as terms add more.
int max_port_modes(ContactKind contact, int branches = 0);

}  // namespace palpate
