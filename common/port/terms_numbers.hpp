// What stands where in the numbers of terms (terms_pieces.hpp), and how each kind of terms gets in and out of them.
//
// r modes, N nodes, m springs or tetrahedra, v vertices and t triangles of a surface, n variables; words of 16 bits:
//
//     first    halves   r + N + 2 m of springs, r + N + 3 m of tetrahedra
//     packed   others   c(3 r N) + c(N) + 3 N + 2 m of springs, and c(m) where their law stiffens;
//                       c(3 r N) + c(N) + 6 N + 2 m of tetrahedra;   c(k) = k / 2 rounded up: two bytes a word
//     after    halves   n (n + 1) / 2 where there is an E2;  7 + r + 4 v where v > 0
//     last     others   c(3 r v) + c(v) + 3 v where v > 0;  t
//
// in the order in which terms_pieces.hpp lists them.
#pragma once

#include <cstdint>
#include <vector>

#include "common/port/terms_pieces.hpp"

namespace palpate {

/// How many modes there are, and products of E2. Halves come `first` and `after` the words of 16 bits that are none (`packed`);
/// more of these are the `last`.
struct TermsLayout {
  int modes, e2;
  int first, packed, after, last;
  int total() const { return first + packed + after + last; }
  int pieces() const { return (total() + kPieceNumbers - 1) / kPieceNumbers; }
  bool is_half(int at) const { return at < first || (at >= first + packed && at < first + packed + after); }
};

TermsLayout layout(const PatchTerms& p);

/// Of terms all of whose numbers are finite; the units of what is appended get into the head.
void append_springs(const NonlinearTerms& terms, PatchTerms& head, std::vector<std::uint16_t>& out);
void append_tetrahedra(const NonlinearTerms& terms, PatchTerms& head, std::vector<std::uint16_t>& out);
void append_surface(const NonlinearTerms& terms, std::vector<std::uint16_t>& out);

/// From `at` on, which is behind them then. False when one is not what a spring, or a node, can be; what a tetrahedron can be;
/// when a corner is no vertex of any surface, or a vertex moves with one that is none before it.
bool take_springs(const std::vector<std::uint16_t>& numbers, int& at, const PatchTerms& head, NonlinearTerms& terms);
bool take_tetrahedra(const std::vector<std::uint16_t>& numbers, int& at, const PatchTerms& head, NonlinearTerms& terms);
bool take_surface(const std::vector<std::uint16_t>& numbers, int at, const PatchTerms& head, NonlinearTerms& terms);

}  // namespace palpate
