// K and D of a body at one state, element by element: evaluated once, multiplied often. Of springs
//
//     K y = sum_e ( (T' - t) n n^T + t I ) (y_a - y_b),     D y = sum_e b n n^T (y_a - y_b),     t = s / L
//
// n direction, T' slope, s force, L length and b damper of element e between nodes a and b (element_kernel.hpp); what acts on a
// acts the other way on b; of finite elements those of tetrahedra.hpp, hexahedra.hpp and relaxation.hpp. For products the
// matrices are not put together: a spring has six numbers and its two blocks of a row eighteen, and it is memory that limits a
// product.
#pragma once

#include <cstdint>
#include <vector>

#include "server/body/dynamics.hpp"
#include "server/body/upper_blocks.hpp"

namespace palpate {

class Tangents {
 public:
  /// `dynamics` must outlive it. At no state yet.
  explicit Tangents(const Dynamics& dynamics);

  /// From here on at this state.
  void take(const BodyState& state);
  /// K Y and D Y for the columns of Y, nothing held.
  void multiply(const Matrix& y, Matrix& k_y, Matrix& d_y) const;
  /// (c_k K + c_d D) Y, for less than both.
  void multiply_sum(const Matrix& y, double c_k, double c_d, Matrix& sum) const;
  /// Whether assemble() knows all that the body is made of: springs.
  bool can_assemble() const { return !dynamics_->body().is_solid(); }
  /// c_m M + c_d D + c_k K; see Dynamics::assemble.
  void assemble(double c_m, double c_d, double c_k, const std::vector<std::uint8_t>& held, bool clamp, UpperBlocks& a) const;

 private:
  struct Spring {
    Vec3 direction = Vec3::Zero();
    double slope_n_m = 0, across_n_m = 0, damping_n_s_m = 0;  // T', t, b
    std::uint32_t b = 0;                                      // a < b
  };
  void add_springs(const std::vector<NodeLanes>& in, std::vector<NodeLanes>& k, std::vector<NodeLanes>& d) const;
  void add_sum_of_springs(const std::vector<NodeLanes>& in, double c_k, double c_d, std::vector<NodeLanes>& sum) const;

  const Dynamics* dynamics_;
  std::vector<std::uint32_t> order_;  // index in the body for each spring here
  std::vector<std::uint32_t> first_;  // springs are sorted by a; those of node i begin at first_[i]
  std::vector<Spring> springs_;
  std::vector<TetraTangent> tetrahedra_;
  std::vector<HexaTangent> hexahedra_;
  std::shared_ptr<const StressHistory> history_;
};

}  // namespace palpate
