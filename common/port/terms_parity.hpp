// A parity piece for the terms of a patch, which restores any one lost piece.
//
// Its number follows that of the last piece, and its words are the exclusive or of theirs,
//
//     p_i = w_{0,i} ^ w_{1,i} ^ ... ,   a piece counting as zeros beyond its end,
//
// so that the words of a lost piece are the exclusive or of p and of the received pieces (as in RAID 4, and for media packets in
// RFC 5109). For n datagrams that are each lost with probability l, the share of incomplete terms is n l without it, and about n
// (n + 1) l^2 / 2 with it. Its words have no meaning by themselves; restored words are checked like received ones.
#pragma once

#include <span>

#include "common/port/terms_pieces.hpp"

namespace palpate {

inline bool is_parity(const PatchTerms& piece) { return piece.piece == piece.pieces; }

/// Returns the parity of all pieces of one patch's terms, in order; at least one.
PatchTerms parity_of(std::span<const PatchTerms> pieces);

}  // namespace palpate
