// How nodes move (node_motion.hpp), and where they are, as words of 16 bits in terms (terms_pieces.hpp): of the nodes of springs
// and tetrahedra, and of the vertices of a surface.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "common/port/node_motion.hpp"

namespace palpate::packed {

constexpr float kPlaceMost = 32767;  // a place from the middle of all, in its unit

/// b and p(i): two bytes a word.
void append_motion(const NodeMotion& motion, std::vector<std::uint16_t>& out);
/// Of `motion`, that has all but these. False when one moves with a node that is none before it, or the tool's is none.
bool take_motion(const std::vector<std::uint16_t>& numbers, int& at, int modes, int nodes, NodeMotion& motion);

/// The least power of two that is `most` or above.
float length_unit(float most);
/// As whole numbers of a length, none beyond kPlaceMost of it.
void append_places(const Eigen::Matrix3Xf& place, float unit, std::vector<std::uint16_t>& out);
Eigen::Matrix3Xf take_places(const std::vector<std::uint16_t>& numbers, int& at, int nodes, float unit);

}  // namespace palpate::packed
