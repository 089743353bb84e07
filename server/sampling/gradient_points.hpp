// The finite elements of a solid in the form of sampled tetrahedra (common/patch/sampled_tetrahedra.hpp): four places each that
// have the gradient of the element.
//
// The places of a tetrahedron or triangle are its nodes, which neighbours share. A hexahedron has its mean gradient, F = sum x_i
// b_i^T over eight nodes (element_shape.hpp), which is that of a tetrahedron of the places
//
//     y_0 = o,   y_c = o + F d_c,   c = 1, 2, 3      at rest o, o + d_c;  d_c orthogonal, of one length
//
// for any o: here a point that never moves, the same for all. V_c, the motion of y_c with a patch's variables, is sum (b_i . d_c)
// V_i. If an element has the node T that a tool holds, o is x_T and d_c such that b_T . d_c = -1, so that no place but T moves
// with the tool: y_c = sum over i != T of (b_i . d_c) x_i. The forces of hourglass modes are only in the linear patch.
#pragma once

#include <cstdint>
#include <vector>

#include "server/body/dynamics.hpp"
#include "server/sampling/sampling.hpp"

namespace palpate {

class GradientPoints {
 public:
  /// The places of these elements of a body at `state` that moves by `moved`, 3 N x n; `tool`: the node that a tool holds, or -1.
  GradientPoints(const Dynamics& dynamics, const BodyState& state, const Matrix& moved, std::vector<std::uint32_t> elements,
                 int tool);

  const std::vector<std::uint32_t>& elements() const { return elements_; }
  /// Number of places.
  std::size_t count() const { return static_cast<std::size_t>(moved_.rows()) / 3; }
  std::uint32_t place(std::uint32_t element, int i) const;
  /// Returns the place that the tool holds, or -1.
  int tool() const { return tool_; }
  const Rows& moved() const { return moved_; }
  const Vector& at_stamp() const { return at_stamp_; }
  const Vector& at_rest() const { return at_rest_; }
  /// Returns the columns b_0..b_3 of the places of an element, and its volume.
  TetraShape rest(std::uint32_t element) const;
  std::uint32_t material(std::uint32_t element) const;
  bool is_triangle(std::uint32_t element) const;

 private:
  static constexpr std::uint32_t kStill = 0, kHeld = 1, kFirst = 2;  // o, x_T, and the first other place
  void take_hexahedra(const BodyState& state, const Matrix& moved, int tool);
  /// Numbers the places and returns their count.
  std::uint32_t number_places(int tool);
  /// Adds the nodes of tetrahedra and triangles.
  void take_corners(const BodyState& state, const Matrix& moved, int tool);
  bool is_hexahedron(std::uint32_t element) const { return element < dynamics_->body().hexahedra.size(); }
  std::size_t number(std::uint32_t element) const;

  const Dynamics* dynamics_;
  std::vector<std::uint32_t> elements_;
  std::vector<Mat3> axes_;              // for hexahedra: d_c as columns [m]
  std::vector<std::uint8_t> is_held_;   // elements whose o is x_T
  std::vector<std::uint32_t> at_;       // of an element: its index in elements_
  std::vector<std::uint32_t> first_;    // of a hexahedron: the place y_1
  std::vector<std::uint32_t> corners_;  // of a node: its place, 0 if it has none
  int tool_ = -1;
  Rows moved_;
  Vector at_stamp_, at_rest_;
};

}  // namespace palpate
