// The patch as a FlatBuffers table. Fields that a contact kind or a constant patch does not use are not sent.
#pragma once

#include <array>

#include "common/wire/codec.hpp"
#include "common/wire/pack.hpp"

namespace palpate {

flatbuffers::Offset<wire::Patch> write_patch(flatbuffers::FlatBufferBuilder& builder, pack::Packer& packer, const Patch& patch);
WireFault read_patch(const wire::Patch& table, Patch& patch);

/// Numbers in `floats` and `shorts` (schema/wire.fbs) of a patch with r modes: those of the modes first, for both kinds of
/// contact.
inline constexpr int touch_floats(int r) { return r + (r > 0 ? 3 : 0); }
inline constexpr int attach_floats(int r) { return touch_floats(r) + 6 * r; }
inline constexpr int mode_shorts(int r) { return 3 * r + r * (r - 1) / 2; }
inline constexpr int surface_shorts(int r, int vertices) { return r + 3 * (vertices - 1) + 3 * vertices * r; }

/// A unit vector in two numbers of 16 bits: projected onto the octahedron |x| + |y| + |z| = 1, whose lower half is folded
/// outwards; 0 to 65534 for -1 to 1. Accurate to 5e-5. kNoNormal twice: none.
inline constexpr std::uint16_t kNoNormal = 65535;
std::array<std::uint16_t, 2> pack_normal(const Vec3& normal);
Vec3 unpack_normal(std::uint16_t u, std::uint16_t v);

enum PatchFlag : std::uint8_t { kTouchFlag = 1, kConstantFlag = 2, kTouchingFlag = 4, kTermsFlag = 8, kAllFlags = 15 };
enum ThreadFlag : std::uint8_t { kFirstTiedFlag = 1, kLastTiedFlag = 2, kBarbedFlag = 4, kAllThreadFlags = 7 };
enum TermsFlag : std::uint8_t {
  kGraspFlag = 1,
  kRepairedFlag = 2,
  kSolidFlag = 4,
};

}  // namespace palpate
