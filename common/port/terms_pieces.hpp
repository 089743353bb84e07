// The terms of a patch in pieces that each fit a datagram (docs/reference/wire.md): a list of numbers of 16 bits, half precision
// unless said, cut, every piece with all it takes to know the whole.
//
//     of springs: s, h (node_motion.hpp), w k and w c, half precision, each but h in a unit of its own, the largest number some
//     thousands; then b, two bytes a word, p(i) in bytes too, the nodes' places and L as whole numbers of a length, and the two
//     ends of each spring in a word; of a law that stiffens a byte each, how steep it may become; E2 where there is a repair;
//     or, of tetrahedra: s, h, w V mu_L, w V lambda_L and t, likewise, but t as h; then b and p(i) as of springs, the nodes'
//     places and their places at rest as whole numbers of a length, and the four nodes of each in two words; E2 likewise;
//     the surface that a touch brings: a length and, as a sum of two numbers an axis [1/1024 m], the middle of its vertices; how
//     the modes move those, s and h as of springs, in [1/kg^1/2]; their normals; then b and p(i), and their places from the
//     middle as whole numbers of that length; of every triangle its three corners, five bits each
//
// Half precision is right to 5e-4 of each number, b to 4e-3 of the largest of its node. Sender and receiver have the energies
// from the same numbers, so forces from them stay conservative; and as K_e has the same G, no spring pushes at the stamp.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/port/nonlinear_terms.hpp"
#include "common/port/patch.hpp"

namespace palpate {

inline constexpr int kPieceNumbers = 524;         ///< words of 16 bits: what 1200 bytes leave beside the tables of a piece
inline constexpr int kUsualPieces = 4;            ///< with these and its patch a frame takes at most 6000 bytes
inline constexpr std::uint8_t kNoHeldNode = 255;  ///< in a byte, above any of kMaxSpringNodes

/// What is known before it is known how many terms there are.
struct TermsBudget {
  int variables = 0;
  bool grasp = false, repaired = false;  ///< there is an E2
  int vertices = 3;                      ///< of the patch
  bool stiffens = false;                 ///< the springs' law
  bool solid = false;                    ///< tetrahedra, else springs
};
/// Numbers that so many elements between so many nodes take, beside the largest surface that a touch may bring when `vertices`
/// are in its patch; they fit while there are at most kUsualNumbers.
int numbers_of(const TermsBudget& budget, int nodes, int elements);
inline constexpr int kUsualNumbers = kUsualPieces * kPieceNumbers;  ///< words of a frame

/// Corners of a triangle of a local surface, below kMaxPortVertices, in the lowest 15 bits.
std::uint16_t pack_corners(const Triangle& triangle);
Triangle unpack_corners(std::uint16_t bits);

struct PatchTerms {
  std::uint32_t patch_seq = 0;  ///< of the patch that they go with
  std::uint8_t piece = 0, pieces = 0, variables = 0, vertices = 0, triangles = 0;
  bool grasp = false;               ///< u starts with the tool's displacement
  bool repaired = false;            ///< there is an E2
  std::uint8_t springs = 0;         ///< or
  std::uint8_t tetrahedra = 0;      ///< instead
  LawParameters law;                ///< theirs
  std::uint8_t nodes = 0;           ///< of springs or tetrahedra
  std::uint8_t tool = kNoHeldNode;  ///< node of these that the tool holds
  std::uint8_t tool_axes = 3;       ///< along which it moves that
  float stiffening = 0;             ///< of the springs' law
  std::array<float, 5> unit{};      ///< of s, lengths, w k, w c, E2; or of s, lengths, w V mu_L, w V lambda_L, E2
  std::vector<std::uint16_t> numbers;
};

/// What is wrong with a piece by itself.
enum class TermsFault : std::uint8_t { none, sizes, not_finite, out_of_range };
TermsFault check(const PatchTerms& piece);

/// Nothing when a number is beyond what check() allows.
std::vector<PatchTerms> to_pieces(const NonlinearTerms& terms, std::uint32_t patch_seq);

/// u'* of `patch`.
Eigen::VectorXd stamp_rate(const Patch& patch);

/// Collects the pieces of the newest patch of which there was one, in any order.
class TermsAssembly {
 public:
  /// A piece that passed check(). False when it is old, known, or does not go with those that came before it.
  bool take(const PatchTerms& piece);
  /// The terms for `patch`, when all their pieces are there and they fit it.
  std::optional<NonlinearTerms> terms_for(const Patch& patch) const;
  void reset() { any_ = false; }

 private:
  bool any_ = false;
  PatchTerms head_;  // of the first piece that came; its numbers are not used
  std::vector<std::uint8_t> there_;
  int missing_ = 0;
  std::vector<std::uint16_t> numbers_;
};

}  // namespace palpate
