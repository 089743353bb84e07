// A linearised body, the input of patches. Around its state (x*, v*) it moves over coordinates y,
//
//     x = x* + T y,     M_y y'' + D_y (y' - v_y) + K_y y = F_y + T^T b(t),     y = 0,  y' = v_y  at first
//     M_y = T^T M T lumped,   D_y = T^T D T,   K_y = T^T K T,   F_y = T^T F(x*, v*),   v_y = M_y^-1 T^T M v*
//
// b [N] the forces of tools, D and K the symmetric tangents of F (dynamics.hpp). There are two kinds: the whole body, T = 1
// (here), and one that is fine around the tools and coarse elsewhere (refined_body.hpp).
//
// Shapes: N nodes, n coordinates of three numbers each. x, v, F: 3 N [m], [m/s], [N]; y: 3 n [m]; T: 3 N x 3 n; M_y diagonal, 3 n
// numbers [kg]; D_y, K_y: 3 n x 3 n, symmetric [N s/m], [N/m].
//
// K_y is indefinite where a compressed body softens, and so may c_m M + c_d D + c_k K be: `clamp` drops the softening. Nothing is
// held except by the caller; fixed() are the fixed nodes of the scene. A basis in these coordinates is valid until generation()
// changes.
#pragma once

#include <cassert>
#include <cstdint>
#include <optional>
#include <span>

#include "common/patch/patch.hpp"
#include "server/body/coarse_space.hpp"
#include "server/body/skin.hpp"
#include "server/body/tangents.hpp"

namespace palpate {

class BodyOperator {
 public:
  static constexpr std::uint32_t kNone = 0xffffffff;  ///< no coordinate

  BodyOperator() = default;
  BodyOperator(const BodyOperator&) = delete;
  BodyOperator& operator=(const BodyOperator&) = delete;
  virtual ~BodyOperator() = default;

  virtual const Dynamics& dynamics() const = 0;
  /// Chooses coordinates for tools at these places of the body at rest and on these nodes.
  virtual void focus(std::span<const Vec3> places, std::span<const std::uint32_t> nodes) = 0;
  /// Number that changes with the coordinates; 0: they are the nodes.
  virtual std::uint64_t generation() const = 0;
  /// Linearises at this state, which must outlive the calls below.
  virtual void take(const BodyState& state) = 0;
  virtual const BodyState& state() const = 0;

  virtual const std::vector<std::uint8_t>& fixed() const = 0;  ///< per coordinate
  virtual const Vector& masses() const = 0;                    ///< M_y = T^T M T, lumped [kg]
  virtual const Vector& velocity() const = 0;                  ///< M_y^-1 T^T M v [m/s]
  virtual Vector forces() const = 0;                           ///< T^T F(x*, v*) [N]
  virtual std::vector<Vector> fading() const = 0;              ///< T^T of Relaxation::pulls [N]
  /// Returns M_y^-1 T^T M (to - from) for positions of all nodes [m].
  virtual Vector displacement(const Vector& from, const Vector& to) const = 0;
  /// Computes K Y and D Y, with nothing held.
  virtual void multiply(const Matrix& y, Matrix& k_y, Matrix& d_y) const = 0;
  /// Computes (c_k K + c_d D) Y.
  virtual void multiply_sum(const Matrix& y, double c_k, double c_d, Matrix& sum) const = 0;

  /// Returns a matrix for assemble(): the upper triangle.
  virtual BlockMatrix make_matrix() const = 0;
  /// Assembles c_m M + c_d D + c_k K, as Dynamics::assemble.
  virtual void assemble(double c_m, double c_d, double c_k, const std::vector<std::uint8_t>& held, bool clamp,
                        BlockMatrix& a) const = 0;
  /// Assembles the same without a BlockMatrix; returns false if that is not supported.
  virtual bool assemble(double c_m, double c_d, double c_k, const std::vector<std::uint8_t>& held, bool clamp,
                        UpperBlocks& a) const = 0;
  /// Returns the coarse space for iterative solves, or null; pieces() are the pieces in it of each coordinate.
  virtual CoarseSpace* coarse() = 0;
  virtual std::span<const CoarseSpace::Node> pieces() const = 0;

  /// Returns the coordinate of a node; kNone: it has none of its own.
  virtual std::uint32_t coordinate(std::uint32_t node) const = 0;
  /// Returns the rows of T V for one node.
  virtual PortRows rows(std::uint32_t node, const Matrix& v) const = 0;
  /// Returns T V for all nodes.
  virtual Matrix of_nodes(const Matrix& v) const = 0;
  /// Returns T^T B for the B of a point on the skin.
  virtual NodeWeights restricted(const NodeWeights& weights) const = 0;
};

class WholeBody final : public BodyOperator {
 public:
  /// `dynamics` must outlive it. It has no state until take().
  explicit WholeBody(const Dynamics& dynamics) : dynamics_(&dynamics), tangents_(dynamics) {}
  WholeBody(const Dynamics& dynamics, const BodyState& state) : WholeBody(dynamics) { take(state); }

  const Tangents& tangents() const { return tangents_; }

  const Dynamics& dynamics() const override { return *dynamics_; }
  void focus(std::span<const Vec3>, std::span<const std::uint32_t>) override {}
  std::uint64_t generation() const override { return 0; }
  void take(const BodyState& state) override {
    state_ = &state;
    tangents_.take(state);
  }
  const BodyState& state() const override {
    assert(state_);
    return *state_;
  }
  const std::vector<std::uint8_t>& fixed() const override { return dynamics_->body().fixed; }
  const Vector& masses() const override { return dynamics_->masses(); }
  const Vector& velocity() const override { return state_->v; }
  Vector forces() const override;
  std::vector<Vector> fading() const override { return dynamics_->relaxation().pulls(*state_); }
  Vector displacement(const Vector& from, const Vector& to) const override { return to - from; }
  void multiply(const Matrix& y, Matrix& k_y, Matrix& d_y) const override { tangents_.multiply(y, k_y, d_y); }
  void multiply_sum(const Matrix& y, double c_k, double c_d, Matrix& sum) const override {
    tangents_.multiply_sum(y, c_k, c_d, sum);
  }
  BlockMatrix make_matrix() const override { return dynamics_->make_matrix(); }
  void assemble(double c_m, double c_d, double c_k, const std::vector<std::uint8_t>& held, bool clamp,
                BlockMatrix& a) const override {
    dynamics_->assemble(*state_, c_m, c_d, c_k, held, clamp, a);
  }
  bool assemble(double c_m, double c_d, double c_k, const std::vector<std::uint8_t>& held, bool clamp,
                UpperBlocks& a) const override;
  /// Returns null for a factorised or planar body; the space is created on the first call.
  CoarseSpace* coarse() override;
  std::span<const CoarseSpace::Node> pieces() const override;
  std::uint32_t coordinate(std::uint32_t node) const override { return node; }
  PortRows rows(std::uint32_t node, const Matrix& v) const override {
    return v.middleRows<3>(3 * static_cast<Eigen::Index>(node));
  }
  Matrix of_nodes(const Matrix& v) const override { return v; }
  NodeWeights restricted(const NodeWeights& weights) const override { return weights; }

  /// Returns true if P is cheap to factorise, for a small number of nodes.
  static bool factorises(const Dynamics& dynamics);

 private:
  const Dynamics* dynamics_;
  const BodyState* state_ = nullptr;
  Tangents tangents_;
  std::optional<CoarseSpace> coarse_;
};

}  // namespace palpate
