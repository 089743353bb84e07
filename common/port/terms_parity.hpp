// One more piece for the terms of a patch, which restores any one of the others that is lost.
//
// It has the number behind the last piece, and for words the exclusive or of theirs,
//
//     p_i = w_{0,i} ^ w_{1,i} ^ ... ,   a piece counting as zeros beyond its end,
//
// so that the words of a lost piece are the exclusive or of p and of the pieces that came (RAID 4; RFC 5109 protects the packets
// of a medium so). Of n datagrams that each get lost with probability l, n l of the wholes lack one without it, and about
// n (n + 1) l^2 / 2 with it. Its words mean nothing by themselves; what they restore is checked as if it had come.
#pragma once

#include <span>

#include "common/port/terms_pieces.hpp"

namespace palpate {

inline bool is_parity(const PatchTerms& piece) { return piece.piece == piece.pieces; }

/// Of all pieces of a whole, in order; at least one.
PatchTerms parity_of(std::span<const PatchTerms> pieces);

}  // namespace palpate
