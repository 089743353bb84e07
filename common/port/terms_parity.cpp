#include "common/port/terms_parity.hpp"

#include <cassert>

namespace palpate {

PatchTerms parity_of(std::span<const PatchTerms> pieces) {
  assert(!pieces.empty());
  PatchTerms parity = pieces.front();  // no other piece is longer
  parity.piece = parity.pieces;
  for (const PatchTerms& piece : pieces.subspan(1))
    for (std::size_t i = 0; i < piece.numbers.size(); ++i) parity.numbers[i] ^= piece.numbers[i];
  return parity;
}

}  // namespace palpate
