// K and D of a body at one state, element by element: evaluated once, multiplied often.
//
//     K y = sum_e ( (T' - t) n n^T + t I ) (y_a - y_b),     D y = sum_e b n n^T (y_a - y_b),     t = s / L
//
// n direction, T' slope, s force, L length and b damper of element e between nodes a and b (element_kernel.hpp); what acts on a
// acts the other way on b. The matrices are never put together: an element has six numbers and its two blocks of a row eighteen,
// and it is memory that limits a product.
#pragma once

#include <cstdint>
#include <vector>

#include "server/body/dynamics.hpp"

namespace palpate {

struct ElementTangent {
  Vec3 direction = Vec3::Zero();
  double slope_n_m = 0, across_n_m = 0, damping_n_s_m = 0;  ///< T', t, b
  std::uint32_t a = 0, b = 0;                               ///< a < b
};

class Tangents {
 public:
  /// `dynamics` must outlive it. At no state yet.
  explicit Tangents(const Dynamics& dynamics);

  /// From here on at this state.
  void take(const BodyState& state);
  /// K y and D y for the columns of y, nothing held; with `clamp` compressed elements do not soften K.
  void multiply(const Matrix& y, bool clamp, Matrix& k_y, Matrix& d_y) const;

  const Dynamics& dynamics() const { return *dynamics_; }
  /// Sorted by a; those of node i begin at first(i).
  const std::vector<ElementTangent>& elements() const { return elements_; }
  std::uint32_t first(std::uint32_t node) const { return first_[node]; }

 private:
  const Dynamics* dynamics_;
  std::vector<std::uint32_t> order_, first_;  // index in the body for each element here
  std::vector<ElementTangent> elements_;
};

/// t where it may soften K or not.
inline double across(const ElementTangent& e, bool clamp) { return clamp && e.across_n_m < 0 ? 0.0 : e.across_n_m; }

}  // namespace palpate
