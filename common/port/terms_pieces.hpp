// The terms of a patch in pieces that each fit a datagram (docs/wire.md): a list of half-precision numbers, cut, every piece with
// all it takes to know the whole.
//
//     the modes' part of S by rows, E2 where there is a repair, E3, E4, Q of the first kTurning variables,
//     each in a unit of its own, the largest number some thousands;
//     or, of springs: G; d and L spring by spring; w k; w c; and E2 where there is a repair;
//     the surface that a touch brings: of every vertex its position as a sum of two numbers an axis [1/1024 m], its normal, and
//     how the modes move it [1/kg^1/2]; of every triangle its three corners
//
// Half precision is right to 5e-4 of each number: S and the
// energies stay what they are for sender and receiver alike, so forces from them stay conservative.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/port/cubic_terms.hpp"
#include "common/port/patch.hpp"

namespace palpate {

inline constexpr int kPieceNumbers = 500;
inline constexpr int kTurning = 8;  ///< variables whose motion turns dampers, on the wire

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
