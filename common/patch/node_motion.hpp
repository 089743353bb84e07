// Motion of some nodes of a body with the variables of a patch, one byte a number, as sent on the wire.
//
// Neighbours move alike: for a node i only the difference to an earlier node, p(i), is stored, where it has one,
//
//     V_i = V_p(i) + h_i b_i diag(s) / 127       [1/kg^1/2]
//
// Shapes: r modes, N nodes; V_i 3 x r, b_i 3 x r signed bytes, s r and h N halves (packed_numbers.hpp), s times a power of two.
// The node that the tool holds moves with the tool alone, all others with the modes alone. p(i) is the node before i with the
// least difference from i, by the largest difference of any entry as a share of the largest of its mode, or i itself where that
// is no less than its own; h_i is no less than what it scales, so that no byte overflows. What can go wrong: rounding. V_p(i) is
// the value that the reader has, so errors do not accumulate: V_i is accurate to h_i s / 254.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace palpate {

struct NodeMotion {
  static constexpr int kByteMax = 127;  ///< largest |b|: a signed byte
  using Bytes = Eigen::Matrix<std::int8_t, Eigen::Dynamic, Eigen::Dynamic>;

  Eigen::VectorXf scale;             ///< s, of each mode
  Eigen::VectorXf step;              ///< h, of each node
  std::vector<std::uint8_t> parent;  ///< p(i) < i; i itself without a parent
  Bytes bytes;                       ///< b, a row for each mode, three columns a node
  int tool = -1;                     ///< the node that the tool holds, if it is among them
  int tool_axes = 3;                 ///< axes along which the tool moves that node; 2 for a planar body

  int nodes() const { return static_cast<int>(step.size()); }
  int modes() const { return static_cast<int>(scale.size()); }
  /// V, three rows a node; the first columns are those of the tool's variables, 3 or none.
  Eigen::MatrixXf rows(int tool_variables) const;
};

/// Returns the motion nearest to `modes`, V of the modes, three rows a node; at most 255 nodes. All numbers finite.
NodeMotion rounded(const Eigen::MatrixXf& modes, int tool);

}  // namespace palpate
