// How nodes move (node_motion.hpp), and where they are, as words of 16 bits in terms (terms_pieces.hpp): of the nodes of springs
// and tetrahedra, and of the vertices of a surface.
//
//     motion    b, bytes, two a word: node by node, of each axis by axis, of each mode by mode: 3 r N / 2 words, rounded
//               up (r modes, N nodes), signed; then p(i), bytes: N / 2 words, rounded up
//     places    for each node x, y and z, int16 of a unit [m]: 3 N words, right to half a unit
//
// Scales s and steps h of a motion are not here: they are halves, and go ahead of all words that are none.
// What can go wrong: a motion that arrives may name a parent that is not before its node, or a tool's node that is none:
// take_motion() says so. append_places() asserts that all places fit an int16.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "common/port/node_motion.hpp"

namespace palpate::packed {

constexpr float kPlaceMax = 32767;  // of an int16: a place from the middle of all, in its unit

/// b and p(i): two bytes a word.
void append_motion(const NodeMotion& motion, std::vector<std::uint16_t>& out);
/// Of `motion`, that has all but these. False when one moves with a node that is none before it, or the tool's is none.
bool take_motion(const std::vector<std::uint16_t>& numbers, int& at, int modes, int nodes, NodeMotion& motion);

/// As whole numbers of a length, none beyond kPlaceMax of it.
void append_places(const Eigen::Matrix3Xf& place, float unit, std::vector<std::uint16_t>& out);
Eigen::Matrix3Xf take_places(const std::vector<std::uint16_t>& numbers, int& at, int nodes, float unit);

}  // namespace palpate::packed
