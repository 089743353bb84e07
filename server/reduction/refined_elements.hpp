// K and D of a locally refined body (refined_body.hpp) of springs or of finite elements, assembled from those of its elements:
//
//     K_y = sum_e T_e^T k_e T_e,     D_y = sum_e T_e^T d_e T_e + c M_y
//
// k_e, d_e the tangents of element e (spring_subset.hpp), c [1/s] the body's mass-proportional damping (solids only). T_e is the
// motion of its nodes: a near node moves by itself; the far ones all move with the corners q of one cell, by N_q (far_field.hpp).
// That cell is, if e has a near node, the far cell that has most of its nodes; else its home. So e joins near nodes and the
// corners of one cell: with A_ab the sum over the elements of such a cell between nodes a and b (BunchLinks),
//
//     a, b near:  A_ab to (a, b)      a near, b far:  N_q(b) A_ab to (a, q)      a, b far:  N_p(a) N_q(b) A_ab to (p, q)
//
// Shapes: a, b, p, q are coordinates of three numbers; blocks 3 x 3 [N/m], [N s/m], of the upper triangle.
//
// K_y is not definite where a compressed body softens; `clamp` drops the softening of elements with a near node, not of the
// others. For far nodes of e in other cells its N is extrapolated beyond the cell, which differs slightly from their motion (T).
// Elements between far nodes may have tangents that are some frames old (far_tangents.hpp).
#pragma once

#include "server/reduction/far_tangents.hpp"
#include "server/reduction/refined_body.hpp"

namespace palpate {

/// `Bunch`: SpringSubset or SolidBunch.
template <class Bunch>
class RefinedElements final : public RefinedTangents {
 public:
  /// `body` must outlive it.
  explicit RefinedElements(const RefinedBody& body) : body_(&body), far_(body.dynamics(), body.far()), forces_(body.dynamics()) {}
  std::vector<std::uint32_t> near_elements() const override { return far_.elements_at(body_->near()); }
  void lay_out() override;
  void take(const BodyState& state) override;
  const NodeArrays& forces(const BodyState& state) override { return forces_.at(state); }
  const BlockPattern& pattern() const override { return tangents_.pattern(); }
  void assemble(double c_d, double c_k, bool clamp, BlockMatrix& a) const override;
  void multiply(const Matrix& y, Matrix& k_y, Matrix& d_y) const override { tangents_.multiply(y, k_y, d_y); }
  void multiply_sum(const Matrix& y, double c_k, double c_d, Matrix& sum) const override {
    tangents_.multiply_sum(y, c_k, c_d, sum);
  }

 private:
  using Matrices = TangentMatrices<Bunch::kNumbers>;
  using Pair = typename Bunch::Pair;
  /// Elements whose nodes are near, or in the same far cell.
  struct Near {
    Bunch bunch;
    std::uint32_t cell = RefinedBody::kNone;  // kNone: all are near
    std::vector<std::uint32_t> rows;          // coordinates of its nodes; kNone for far ones
    std::vector<FarField::Shape> shapes;      // in the cell; zero for near nodes
    std::vector<std::uint32_t> places;        // per link: the entry between near nodes, or the border; unused for far ones
  };
  std::uint32_t far_home(std::span<const std::uint32_t> nodes) const;
  void take_near();
  void find_places(Near& near) const;
  void add_far(Matrices& to) const;
  void add_near(bool clamp, Matrices& to) const;
  void add_to_corners(std::uint32_t cell, const CornerTangent<Bunch::kNumbers>& tangent, Matrices& to) const;
  /// Adds a block with the rows of coordinate p and the columns of q.
  static void add(const Pair& pair, std::uint32_t p, std::uint32_t q, std::uint32_t entry, Matrices& to);

  const RefinedBody* body_;
  FarTangents<Bunch> far_;
  typename Bunch::Forces forces_;
  RefinedPattern pattern_;
  Matrices tangents_;
  std::vector<Near> near_;
  const BodyState* state_ = nullptr;
};

extern template class RefinedElements<SpringSubset>;
extern template class RefinedElements<SolidBunch>;

}  // namespace palpate
