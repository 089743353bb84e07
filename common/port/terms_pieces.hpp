// The terms of a patch in pieces that each fit a datagram (docs/wire.md): a list of numbers of 16 bits, half precision unless
// said, cut, every piece with all it takes to know the whole.
//
//     the modes' part of S by rows, E2 where there is a repair; E3, E4, Q of the first kTurning variables, 12 bits each, half
//     precision less its last four; each in a unit of its own, the largest number some thousands;
//     or, of springs: a scale for each variable, one for each spring, G as multiples of 1/127 of their product, a byte each; d
//     and L spring by spring; w k; w c; and E2 where there is a repair; the surface that a touch brings: of every vertex its
//     position as a sum of two numbers an axis [1/1024 m], its normal, and how the modes move it [1/kg^1/2]; of every triangle
//     its three corners, five bits each
//
// Half precision is right to 5e-4 of each number, 12 bits to 8e-3, G to 4e-3 of the largest of its spring. Sender and receiver
// have the energies from the same numbers, so forces from them stay conservative; and as K_e has the same G, no spring pushes at
// the stamp.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/port/cubic_terms.hpp"
#include "common/port/patch.hpp"

namespace palpate {

inline constexpr int kPieceNumbers = 524;
inline constexpr int kUsualPieces = 4;  ///< with these and its patch a frame takes at most 6000 bytes
inline constexpr int kTurning = 8;      ///< variables whose motion turns dampers, on the wire

/// As many springs, and variables with terms of fourth order, as go into kUsualPieces beside the largest surface that a touch may
/// bring when `vertices` are in its patch; at most kMaxSprings and `most`.
struct TermsRoom {
  int variables = 0;
  bool grasp = false, repaired = false;  ///< there is an E2
  int vertices = 3;                      ///< of the patch
};
int springs_that_fit(const TermsRoom& room);
int leading_that_fit(const TermsRoom& room, int most);

/// Corners of a triangle of a local surface, below kMaxPortVertices, in the lowest 15 bits.
std::uint16_t pack_corners(const Triangle& triangle);
Triangle unpack_corners(std::uint16_t bits);

struct PatchTerms {
  std::uint32_t patch_seq = 0;  ///< of the patch that they go with
  std::uint8_t piece = 0, pieces = 0, variables = 0, leading = 0, vertices = 0, triangles = 0;
  bool grasp = false, repaired = false;  ///< u starts with the tool's displacement; there is an E2
  std::uint8_t springs = 0;              ///< instead of polynomials: leading, radius and port_scale are 0
  float radius = 0;
  float stiffening = 0;               ///< of the springs' law
  std::array<float, 3> port_scale{};  ///< of a grasp
  std::array<float, 5> unit{};        ///< of S, E2, E3, E4, Q; of G, d and L, w k, w c, E2
  std::vector<std::uint16_t> numbers;
};

/// What is wrong with a piece by itself.
enum class TermsFault : std::uint8_t { none, sizes, not_finite, out_of_range };
TermsFault check(const PatchTerms& piece);

/// Nothing when a number is beyond what check() allows.
std::vector<PatchTerms> to_pieces(const CubicTerms& terms, std::uint32_t patch_seq);

/// y'* of terms that go with `patch`.
Eigen::VectorXd stamp_rate(const CubicTerms& terms, const Patch& patch);

/// Collects the pieces of the newest patch of which there was one, in any order.
class TermsAssembly {
 public:
  /// A piece that passed check(). False when it is old, known, or does not go with those that came before it.
  bool take(const PatchTerms& piece);
  /// The terms for `patch`, when all their pieces are there and they fit it.
  std::optional<CubicTerms> terms_for(const Patch& patch) const;
  void reset() { any_ = false; }

 private:
  bool any_ = false;
  PatchTerms head_;  // of the first piece that came; its numbers are not used
  std::vector<std::uint8_t> there_;
  int missing_ = 0;
  std::vector<std::uint16_t> numbers_;
};

}  // namespace palpate
