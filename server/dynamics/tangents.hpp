// K and D of a body at one state, element by element, evaluated once and multiplied often. For springs
//
//     K y = sum_e ( (T' - t) n n^T + t I ) (y_a - y_b),     D y = sum_e b n n^T (y_a - y_b),     t = s / L
//
// n direction, T' slope, s force, L length and b damper of element e between nodes a and b (spring_kernel.hpp), with the
// opposite sign on b; for finite elements the tangents of elements.hpp and relaxation.hpp. For products the
// matrices are not assembled: a spring has six numbers, its two blocks of a row have eighteen, and products are limited by memory
// bandwidth.
#pragma once

#include <cstdint>
#include <vector>

#include "server/dynamics/dynamics.hpp"
#include "server/solve/upper_blocks.hpp"

namespace palpate {

class Tangents {
 public:
  /// `dynamics` must outlive it. It has no state until take().
  explicit Tangents(const Dynamics& dynamics);

  /// Linearises at this state.
  void take(const BodyState& state);
  /// Computes K Y and D Y for the columns of Y, with no node held.
  void multiply(const Matrix& y, Matrix& k_y, Matrix& d_y) const;
  /// Computes (c_k K + c_d D) Y, at a lower cost than both products.
  void multiply_sum(const Matrix& y, double c_k, double c_d, Matrix& sum) const;
  /// Returns true if assemble() supports everything that the body is made of: springs.
  bool can_assemble() const { return !dynamics_->body().is_solid(); }
  /// Assembles c_m M + c_d D + c_k K; see Dynamics::assemble.
  void assemble(double c_m, double c_d, double c_k, const std::vector<std::uint8_t>& held, bool clamp, UpperBlocks& a) const;

 private:
  struct Spring {
    Vec3 direction = Vec3::Zero();
    double slope_n_m = 0, across_n_m = 0, damping_n_s_m = 0;  // T', t, b
    std::uint32_t b = 0;                                      // a < b
  };
  /// Adds c_k K and c_d D times the columns of `in` to `k` and to `d`, which may be one.
  void add_products(const std::vector<NodeLanes>& in, double c_k, double c_d, std::vector<NodeLanes>& k,
                    std::vector<NodeLanes>& d) const;
  /// Adds c_k K + c_d D of the springs alone; kWithStiffness false: c_d D, whose forces are along the springs.
  template <bool kWithStiffness>
  void add_springs(const std::vector<NodeLanes>& in, double c_k, double c_d, std::vector<NodeLanes>& sum) const;

  const Dynamics* dynamics_;
  std::vector<std::uint32_t> order_;  // index in the body of each spring
  std::vector<std::uint32_t> first_;  // springs are sorted by a; those of node i begin at first_[i]
  std::vector<Spring> springs_;
  std::vector<ElementTangent<TetraShape>> tetrahedra_;
  std::vector<ElementTangent<HexaShape>> hexahedra_;
  std::shared_ptr<const StressHistory> history_;
};

}  // namespace palpate
