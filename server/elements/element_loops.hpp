// Eight elements of one material and one kind side by side: their forces, the blocks of their stiffness and damping between
// nodes, and products with their tangents (element_shape.hpp, element_material.hpp, spring_material.hpp). Each lane of a vector
// holds one element; the bits do not depend on the width of vectors or on the neighbours (lane_variants.hpp).
//
//     K_ij = V (b_i . dP/dF . b_j) + sum_a k_a gamma_ai gamma_aj 1      block of K = -df/dx between nodes i and j
//
// D = -df/dv likewise, from the viscous stress, whose change with x is neglected. For a spring between nodes a and b, with
// d = x_b - x_a, n = d / |d|, w = v_b - v_a, its tension T(e) at the elongation e = |d| - l, and its damper c,
//
//     f_a = s n = -f_b,   s = T(e) + c n . w           K_aa = K_bb = -K_ab = (T' - t) n n^T + t 1,   t = s / |d|
//                                                      D_aa = D_bb = -D_ab = c n n^T
//
// without the term of K from the rotation of the damper, c n (w - n n . w)^T / |d|, which is not symmetric.
// The cells of a lattice are boxes of one shape, except those at a clipped surface: a group of one shape stores its numbers once.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <type_traits>
#include <vector>

#include "common/base/doubles.hpp"
#include "server/elements/column_lanes.hpp"
#include "server/elements/element_material.hpp"
#include "server/elements/element_shape.hpp"
#include "server/elements/spring_material.hpp"

namespace palpate {

inline constexpr std::size_t kElementLanes = 8;

template <class Shape>
inline constexpr bool kIsTruss = std::is_same_v<Shape, TrussShape>;
template <class Shape>
using MaterialOf = std::conditional_t<kIsTruss<Shape>, SpringMaterial, ElementMaterial>;

/// The numbers of elements with shapes of their own, one lane each: V, k_a, and g_i by node and column.
template <class Shape>
struct ShapeNumbers {
  static constexpr std::size_t kModesAt = 1, kGradientsAt = kModesAt + Shape::kModes,
                               kSize = kGradientsAt + std::size_t{Shape::kNodes} * Shape::kColumns;
  static constexpr std::size_t gradient_at(std::size_t node, std::size_t column) {
    return kGradientsAt + Shape::kColumns * node + column;
  }
  /// Returns the numbers of up to eight elements; 0 in unused lanes.
  static std::vector<EightNumbers> of(std::span<const Shape* const> shapes);
};
/// Stiffness, rest length and damper of springs.
template <>
struct ShapeNumbers<TrussShape> {
  static std::vector<EightNumbers> of(std::span<const TrussShape* const> shapes);
};

template <class Shape>
struct ElementGroup {
  const Shape* shape = nullptr;                                                 ///< shared by all elements of the group, or null
  std::vector<EightNumbers> numbers;                                            ///< ShapeNumbers; empty if they share a shape
  std::array<std::array<std::uint32_t, kElementLanes>, Shape::kNodes> nodes{};  ///< unused lanes repeat the first
  std::uint32_t material = 0, count = 0;                                        ///< number of lanes in use
};

constexpr std::size_t pair_index(std::size_t i, std::size_t j) { return i * (i + 1) / 2 + j; }

/// c_k K + c_d D between nodes i and j <= i of each element, row by row: at[pair_index(i, j)][3 row + column].
template <class Shape>
struct ElementBlocks {
  std::array<std::array<EightNumbers, 9>, pair_index(Shape::kNodes, 0)> at;
};

/// An element at one state, for products with its K and D.
template <class Shape>
struct ElementTangent {
  double elastic[45];                   ///< V dP/dF (common/mechanics/tangent.hpp)
  double gradient[3][Shape::kColumns];  ///< (F, q)
};
template <>
struct ElementTangent<TrussShape> {
  double direction[3], slope_n_m, across_n_m, damping_n_s_m;  ///< n, T', t, c
};

template <class Shape>
struct ElementCell {
  std::array<std::uint32_t, Shape::kNodes> nodes;
  std::uint32_t shape, material;
};

/// All elements of one kind, and their tangents.
template <class Shape>
struct ElementProducts {
  std::span<const ElementCell<Shape>> cells;
  std::span<const Shape> shapes;
  std::span<const MaterialOf<Shape>> materials;
  std::span<const ElementTangent<Shape>> tangents;
};

/// The loops compiled for vectors of so many doubles.
template <class Shape>
struct ElementLoops {
  std::size_t width;
  /// f += forces at positions x and velocities v, 3 N each.
  void (*add_forces)(const MaterialOf<Shape>& material, const ElementGroup<Shape>& group, const double* x, const double* v,
                     double* f);
  /// Computes the blocks; `clamp` drops the negative eigenvalues of dP/dF, for springs negative t, so that K is positive
  /// semi-definite. Only springs' blocks depend on v.
  void (*blocks)(const MaterialOf<Shape>& material, const ElementGroup<Shape>& group, const double* x, const double* v,
                 double c_d, double c_k, bool clamp, ElementBlocks<Shape>& blocks);
  /// Computes the tangent of each lane in use.
  void (*tangents)(const MaterialOf<Shape>& material, const ElementGroup<Shape>& group, const double* x, const double* v,
                   const std::array<ElementTangent<Shape>*, kElementLanes>& tangents);
  /// Adds c_k K Y to k_y and c_d D Y to d_y, which may be one, for four columns of Y.
  void (*add_products)(const ElementProducts<Shape>& elements, const NodeLanes* y, double c_k, double c_d, NodeLanes* k_y,
                       NodeLanes* d_y);
};

/// Returns the variants that this processor can run, the widest last.
template <class Shape>
std::span<const ElementLoops<Shape>> element_loops();

}  // namespace palpate
