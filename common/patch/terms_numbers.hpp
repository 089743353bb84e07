// Layout of the numbers of terms (terms_pieces.hpp), and conversion of each kind of terms to and from them.
//
// r modes, N nodes, m elements, v vertices and t triangles of a surface, n variables; words of 16 bits:
//
//     first    halves   r + N + 2 m of springs, r + N + 3 m of finite elements
//     packed   others   c(3 r N) + c(N) + 3 N + 2 m of springs, and c(m) where their law stiffens;
//                       c(3 r N) + c(N) + 6 N + 2 m of finite elements;   c(k) = k / 2 rounded up: two bytes a word
//     after    halves   n (n + 1) / 2 where there is an E2;  7 + r + 4 v where v > 0
//     last     others   c(3 r v) + c(v) + 3 v where v > 0;  t
//
// in the order in which terms_pieces.hpp lists them.
#pragma once

#include <cstdint>
#include <vector>

#include "common/patch/terms_pieces.hpp"

namespace palpate {

/// Number of modes and of products of E2. Halves are `first` and `after`; they enclose the words of 16 bits that are none
/// (`packed`), more of which are the `last`.
struct TermsLayout {
  int modes, e2;
  int first, packed, after, last;
  int total() const { return first + packed + after + last; }
  int pieces() const { return (total() + kPieceNumbers - 1) / kPieceNumbers; }
  bool is_half(int at) const { return at < first || (at >= first + packed && at < first + packed + after); }
};

TermsLayout layout(const PatchTerms& p);

/// Append terms, all of whose numbers are finite; the units of the appended numbers are stored in the head.
void append_elements(const NonlinearTerms& terms, PatchTerms& head, std::vector<std::uint16_t>& out);
void append_surface(const NonlinearTerms& terms, std::vector<std::uint16_t>& out);

/// Take terms from `at` on, which is advanced past them. Return false for an invalid element or node, for a corner that is no
/// vertex of any surface, and for a vertex whose parent is not before it.
bool take_elements(const std::vector<std::uint16_t>& numbers, int& at, const PatchTerms& head, NonlinearTerms& terms);
bool take_surface(const std::vector<std::uint16_t>& numbers, int at, const PatchTerms& head, NonlinearTerms& terms);

}  // namespace palpate
