// A locally refined body with fewer coordinates, fine around the tools and coarse elsewhere, from which patches of a large body
// are made.
//
// Cells of the far field (far_field.hpp) with their centre close to a tool are near. Nodes of near cells keep their own
// coordinates, those of the others move with the corners of their cell. With T the map from the coordinates y to the nodes,
// x - x* = T y,
//
//     M_y = lumped T^T M T (its rows summed),   K_y = T^T K T,   D_y = T^T D T,   F_y = T^T F,   v_y = M_y^-1 T^T M v
//
// Shapes as in body_operator.hpp; T is 3 N x 3 n, its row for a node has one 1 (near) or eight N_k (far), and is zero if the node
// is fixed and far. K and D are assembled element by element, with T as each element has it (refined_tangents.hpp).
//
// K and D of elements with a near node are those of the state; those of the others are kept by FarTangents. A load on near nodes
// has a stiffer response than on the full body, as with any Galerkin projection: docs/notebook.md, 14 says by how much. A corner
// that moves no mass is held. F_y uses the forces of elements in single precision. The number of coordinates grows with the
// tools; there are at most FarField::kCellsMax far cells, whatever the body.
//
// Near nodes at the border move freely: they are coupled to the adjacent cell only by the elements between (no hanging nodes).
// Source: full resolution near, interpolation elsewhere, as for atoms in the quasicontinuum method, Tadmor, Ortiz and Phillips,
// Phil. Mag. A 73 (1996); cells: far_field.hpp.
#pragma once

#include <cassert>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/patch/patch.hpp"
#include "server/body/coarse_space.hpp"
#include "server/body/skin.hpp"
#include "server/operators/body_operator.hpp"
#include "server/operators/refined_tangents.hpp"

namespace palpate {

class RefinedBody final : public BodyOperator {
 public:
  /// Largest distance of a near cell's centre from a tool, in node spacings. Measured: 8 gain less than 0.5 dB
  /// (docs/notebook.md, 14, 19).
  static constexpr double kNearSpacings = 6;
  static constexpr std::size_t kCoarsePieces = 16;    ///< of a coarse space for solves; 64 cost more than the matrix itself
  static constexpr std::uint32_t kNodesLeast = 2500;  ///< for a smaller body the whole body is as good

  /// Returns true for springs or finite elements in three dimensions with at least kNodesLeast nodes, of one body.
  static bool suits(const Dynamics& dynamics);
  /// `dynamics` must outlive it.
  explicit RefinedBody(const Dynamics& dynamics);

  /// Makes near the cells around these places of the body at rest, and those of these nodes. Coordinates are kept as long as all
  /// cells that are close enough are near, and near cells are at most twice as many as would be chosen now.
  void focus(std::span<const Vec3> places, std::span<const std::uint32_t> nodes) override;
  std::uint64_t generation() const override { return generation_; }
  void take(const BodyState& state) override;
  const BodyState& state() const override {
    assert(state_);
    return *state_;
  }

  const Dynamics& dynamics() const override { return *dynamics_; }
  const FarField& far() const { return far_; }
  double spacing_m() const { return far_.spacing_m(); }  ///< mean spacing of nodes
  /// Per cell, 1 = near.
  const std::vector<std::uint8_t>& near() const { return near_; }
  /// Elements with a near node.
  std::vector<std::uint32_t> near_elements() const { return tangents_->near_elements(); }
  std::uint32_t size() const { return rows_; }  ///< coordinates, three numbers each
  const Vector& masses() const override { return masses_; }
  const Vector& velocity() const override { return velocity_; }
  const std::vector<std::uint8_t>& fixed() const override { return fixed_; }
  /// Returns kNone for a far node.
  std::uint32_t coordinate(std::uint32_t node) const override { return coordinate_[node]; }
  /// Returns the coordinate of a corner of far cells.
  std::uint32_t corner(std::uint32_t corner) const { return corner_[corner]; }
  /// Returns F_y, from element forces in single precision.
  Vector forces() const override { return loads_; }
  std::vector<Vector> fading() const override;
  Vector displacement(const Vector& from, const Vector& to) const override;
  NodeWeights restricted(const NodeWeights& weights) const override;
  /// Dependence of a node on a coordinate: its own, or a corner of its cell.
  struct Share {
    std::uint32_t coordinate = 0;
    double weight = 0;
  };
  std::span<const Share> shares(std::uint32_t node, std::array<Share, FarField::kCorners>& scratch) const;
  PortRows rows(std::uint32_t node, const Matrix& v) const override;
  /// Returns the rows of T Y for these nodes.
  Matrix moved(const Matrix& y, std::span<const std::uint32_t> nodes) const;
  Matrix of_nodes(const Matrix& v) const override;

  CoarseSpace* coarse() override { return &coarse_; }
  std::span<const CoarseSpace::Node> pieces() const override { return pieces_; }

  BlockMatrix make_matrix() const override { return BlockMatrix(tangents_->pattern()); }
  void assemble(double c_m, double c_d, double c_k, const std::vector<std::uint8_t>& held, bool clamp,
                BlockMatrix& a) const override;
  bool assemble(double, double, double, const std::vector<std::uint8_t>&, bool, UpperBlocks&) const override { return false; }
  void multiply(const Matrix& y, Matrix& k_y, Matrix& d_y) const override { tangents_->multiply(y, k_y, d_y); }
  void multiply_sum(const Matrix& y, double c_k, double c_d, Matrix& sum) const override {
    tangents_->multiply_sum(y, c_k, c_d, sum);
  }

 private:
  bool is_close(std::uint32_t cell, std::span<const Vec3> places, double spacings) const;
  /// Assigns each corner to the piece of the nearest node of a cell that it moves.
  void place_corners();
  void number();
  void take_loads(const BodyState& state);
  /// Applies T^T to N vectors at once: of(node) returns their values at a node.
  template <std::size_t N, typename Of>
  std::array<Vector, N> restricted_of(const Of& of) const;

  const Dynamics* dynamics_;
  const BodyState* state_ = nullptr;
  FarField far_;
  CoarseSpace coarse_;
  std::vector<CoarseSpace::Node> corner_pieces_, pieces_;  // for corners, and for coordinates
  std::uint64_t generation_ = 0;
  std::vector<std::uint8_t> near_;         // per cell
  std::vector<std::uint32_t> coordinate_;  // per node
  std::vector<std::uint32_t> corner_;      // coordinate of each corner
  std::uint32_t rows_ = 0;
  std::vector<std::uint8_t> fixed_;
  std::unique_ptr<RefinedTangents> tangents_;
  Vector masses_, velocity_, loads_;
};

}  // namespace palpate
