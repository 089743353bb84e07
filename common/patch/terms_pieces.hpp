// The terms of a patch in pieces that each fit a datagram (docs/reference/wire.md): a list of numbers of 16 bits, half precision
// unless stated, cut into pieces, each with all that is needed to know the whole.
//
//     of springs: s, h (node_motion.hpp), w k and w c, half precision, each but h in a unit of its own, the largest number some
//     thousands; then b, two bytes a word, p(i) in bytes too, the nodes' places and L as multiples of a length, and the two
//     ends of each spring in a word; for a law that stiffens one byte each, its largest slope; E2 where there is a repair;
//     or, of finite elements: s, h, w V mu_L, w V lambda_L and t, likewise, but t like h; then b and p(i) as of springs, the
//     nodes' places and their places at rest as multiples of a length, and the four nodes of each in two words; E2 likewise; the
//     added surface of a touch: a length and, as a sum of two numbers an axis [1/1024 m], the middle of its vertices; their
//     motion with the modes, s and h as of springs, in [1/kg^1/2]; their normals; then b and p(i), and their places from the
//     middle as multiples of that length; of every triangle its three corners, five bits each
//
// Half precision has a relative error of 5e-4, b an error of 4e-3 of the largest of its node. Sender and receiver compute the
// energies from the same numbers, so their forces stay conservative; and as K_e has the same G, no spring pushes at the stamp.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/patch/nonlinear_terms.hpp"
#include "common/patch/patch.hpp"

namespace palpate {

inline constexpr int kPieceNumbers = 524;         ///< words of 16 bits that 1200 bytes hold besides the tables of a piece
inline constexpr int kUsualPieces = 5;            ///< a frame with these and its patch has at most 7200 bytes
inline constexpr std::uint8_t kNoHeldNode = 255;  ///< stored in a byte, above any of kMaxSampledNodes

/// Figures that are known before the number of terms is.
struct TermsBudget {
  int variables = 0;
  bool grasp = false, repaired = false;  ///< repaired: there is an E2
  int vertices = 3;                      ///< vertices of the patch
  bool stiffens = false;                 ///< true: the springs' law stiffens
  bool solid = false;                    ///< true: finite elements, false: springs
};
/// Numbers needed for that many elements and nodes, in addition to the largest surface that a touch may add when `vertices` are
/// in its patch; they fit while there are at most kUsualNumbers.
int numbers_of(const TermsBudget& budget, int nodes, int elements);
inline constexpr int kUsualNumbers = kUsualPieces * kPieceNumbers;  ///< words of a frame

/// Corners of a triangle of a local surface, below kMaxPortVertices, in the lowest 15 bits.
std::uint16_t pack_corners(const Triangle& triangle);
Triangle unpack_corners(std::uint16_t bits);

struct PatchTerms {
  std::uint32_t patch_seq = 0;  ///< seq of their patch
  std::uint8_t piece = 0, pieces = 0, variables = 0, vertices = 0, triangles = 0;
  bool grasp = false;               ///< true: u starts with the tool's displacement
  bool repaired = false;            ///< true: there is an E2
  bool solid = false;               ///< true: finite elements, false: springs
  std::uint8_t elements = 0;        ///< number of elements
  std::uint8_t nodes = 0;           ///< nodes of the elements
  LawParameters law;                ///< law of the finite elements
  std::uint8_t tool = kNoHeldNode;  ///< the one of these nodes that the tool holds
  std::uint8_t tool_axes = 3;       ///< axes along which the tool moves that node
  float stiffening = 0;             ///< parameter of the springs' law
  std::array<float, 5> unit{};      ///< units of s, lengths, w k, w c, E2; or of s, lengths, w V mu_L, w V lambda_L, E2
  std::vector<std::uint16_t> numbers;
};

/// Fault of a piece by itself.
enum class TermsFault : std::uint8_t { none, sizes, not_finite, out_of_range };
TermsFault check(const PatchTerms& piece);

/// Returns no pieces when a number is beyond what check() allows.
std::vector<PatchTerms> to_pieces(const NonlinearTerms& terms, std::uint32_t patch_seq);

/// Returns u'* of `patch`.
Eigen::VectorXd stamp_rate(const Patch& patch);

/// Collects the pieces of the newest patch that any was received for, in any order.
class TermsAssembly {
 public:
  /// Adds a piece that passed check(). Returns false when it is old, known, or does not match earlier ones.
  bool take(const PatchTerms& piece);
  /// Returns the terms for `patch` when all their pieces are there and they fit it.
  std::optional<NonlinearTerms> terms_for(const Patch& patch) const;
  void reset() { any_ = false; }

 private:
  bool any_ = false;
  PatchTerms head_;  // first piece received; its numbers are not used
  std::vector<std::uint8_t> there_;
  int missing_ = 0;
  std::vector<std::uint16_t> numbers_;
};

}  // namespace palpate
