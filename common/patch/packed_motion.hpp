// The motion of nodes (node_motion.hpp), and their positions, as words of 16 bits in terms (terms_pieces.hpp): for the nodes of
// springs and tetrahedra, and for the vertices of a surface.
//
//     motion    b, bytes, two a word: by node, then by axis, then by mode: 3 r N / 2 words, rounded
//               up (r modes, N nodes), signed; then p(i), bytes: N / 2 words, rounded up
//     places    for each node x, y and z, int16 of a unit [m]: 3 N words, accurate to half a unit
//
// Scales s and steps h of a motion are stored elsewhere: they are halves, which precede all words that are none. What can go
// wrong: a received motion may name a parent that is not before its node, or an invalid node of the tool: take_motion() reports
// this. append_places() asserts that all places fit an int16.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "common/patch/node_motion.hpp"

namespace palpate::packed {

constexpr float kPlaceMax = 32767;  // largest int16: a position relative to the middle of all, in its unit

/// Appends b and p(i): two bytes a word.
void append_motion(const NodeMotion& motion, std::vector<std::uint16_t>& out);
/// Completes `motion`, which has all but these. Returns false when a parent is not before its node, or the tool's node does not
/// exist.
bool take_motion(const std::vector<std::uint16_t>& numbers, int& at, int modes, int nodes, NodeMotion& motion);

/// Appends places as multiples of `unit`, each at most kPlaceMax of it.
void append_places(const Eigen::Matrix3Xf& place, float unit, std::vector<std::uint16_t>& out);
Eigen::Matrix3Xf take_places(const std::vector<std::uint16_t>& numbers, int& at, int nodes, float unit);

}  // namespace palpate::packed
