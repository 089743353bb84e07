// K and D of a body at one state, element by element (elements.hpp, relaxation.hpp), evaluated once and multiplied often. For
// products the matrices are not assembled: a spring has six numbers, its two blocks of a row have eighteen, and products are
// limited by memory bandwidth.
#pragma once

#include <cstdint>
#include <vector>

#include "server/body/dynamics.hpp"
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
  /// Adds c_k K and c_d D times the columns of `in` to `k` and to `d`, which may be one.
  void add_products(const std::vector<NodeLanes>& in, double c_k, double c_d, std::vector<NodeLanes>& k,
                    std::vector<NodeLanes>& d) const;

  const Dynamics* dynamics_;
  std::vector<std::uint32_t> order_;  // springs by the lower of their nodes, then by the other
  std::vector<std::uint32_t> first_;  // those with the lower node i begin at first_[i]
  std::vector<ElementTangent<TrussShape>> springs_;
  std::vector<ElementTangent<TetraShape>> tetrahedra_;
  std::vector<ElementTangent<HexaShape>> hexahedra_;
  std::shared_ptr<const StressHistory> history_;
  std::vector<Contacts::Block> contacts_;
  std::vector<Sutures::Block> threads_;
};

}  // namespace palpate
