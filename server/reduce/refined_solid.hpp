// K and D of a locally refined body of finite elements.
//
// Mass-proportional damping c M is c M_y here. Of a tetrahedron with near and far nodes, the far ones move as the corners of that
// cell which has most of them.
#pragma once

#include "server/reduce/far_solid.hpp"
#include "server/reduce/refined_elements.hpp"

namespace palpate {

class RefinedSolid final : public RefinedElements<FarSolid> {
 public:
  /// `body` must outlive it.
  explicit RefinedSolid(const RefinedBody& body);
  void lay_out() override;
  void take(const BodyState& state) override;
  const NodeArrays& forces(const BodyState& state) override;
  void assemble(double c_d, double c_k, bool clamp, BlockMatrix& a) const override;

 private:
  using Pair = SolidMatrices::Pair;
  /// Tetrahedra whose nodes are near, or in the same far cell.
  struct Near {
    TetraBunch tetrahedra;
    std::uint32_t cell = RefinedBody::kNone;  // none: all are near
    std::vector<std::uint32_t> rows;          // coordinates of its nodes; none of far ones
    std::vector<FarField::Shape> shapes;      // in the cell; zero for near ones
    std::vector<std::uint32_t> places;        // for each link the entry between near nodes, or the border; none between far ones
  };
  std::uint32_t far_home(std::span<const std::uint32_t> nodes) const;
  void take_tetrahedra();
  void find_places(Near& near) const;
  void add_far(SolidMatrices& to) const;
  void add_near(bool clamp, SolidMatrices& to) const;
  void add_to_corners(std::uint32_t cell, const CornerTangent<TetraBunch::kNumbers>& tangent, SolidMatrices& to) const;
  /// A block with the rows of coordinate p and the columns of q.
  static void add(const Pair& pair, std::uint32_t p, std::uint32_t q, std::uint32_t entry, SolidMatrices& to);

  std::vector<Near> near_;
  Vector x_;  // of the state
  NodeArrays f_;
};

}  // namespace palpate
