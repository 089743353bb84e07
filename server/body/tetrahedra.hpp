// All tetrahedra of a body, and the triangles of a membrane: tetra_kernel.hpp summed over its finite elements. Signs and symbols
// as in dynamics.hpp.
//
// Masses are lumped: each node of a tetrahedron gets a quarter of its mass. Mass-proportional damping is a force -c m_i v_i on
// each node, c = LumpedBody::mass_damping_1_s, m_i the node's mass.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "server/body/body_state.hpp"
#include "server/body/column_lanes.hpp"
#include "server/body/tetra_lanes.hpp"

namespace palpate {

class Tetrahedra {
 public:
  using Blocks = TetraBlocks;

  /// `body` must outlive it. `pattern` has a block for every pair of nodes that share an element.
  Tetrahedra(const LumpedBody& body, const BlockMatrix& pattern);

  bool empty() const { return cells_.empty(); }
  const TetraRest& rest(std::uint32_t tetrahedron) const { return cells_[tetrahedron].rest; }
  const TetraMaterial& material(std::uint32_t tetrahedron) const { return materials_[cells_[tetrahedron].material]; }
  /// Returns F of one tetrahedron.
  Mat3 gradient(std::uint32_t tetrahedron, const Vector& x) const {
    return nodes_of(cells_[tetrahedron], x) * cells_[tetrahedron].rest.b.transpose();
  }
  /// Adds the forces of the elements to f.
  void add_forces(const Vector& x, const Vector& v, Vector& f) const;
  Vec3 force_on(const BodyState& state, std::uint32_t node) const;
  /// Adds c_d D + c_k K (symmetric part) to A, except rows and columns of held nodes; see TetraTangent for `clamp`.
  void add_tangents(const BodyState& state, double c_d, double c_k, const std::vector<std::uint8_t>& held, bool clamp,
                    BlockMatrix& a) const;
  /// Tetrahedra of one material side by side, with their indices.
  struct Batch {
    TetraGroup group;
    std::array<std::uint32_t, kTetraLanes> cells{};
  };
  /// Groups these cells into as few batches as possible.
  std::vector<Batch> batches(std::span<const std::uint32_t> cells) const;
  /// Computes c_d D + c_k K between the nodes of each, without mass-proportional damping; see TetraTangent for `clamp`.
  void blocks(const Batch& batch, const Vector& x, double c_d, double c_k, bool clamp, TetraBlocks& blocks) const;
  /// Returns the tangent of each tetrahedron at one state, for products with K and D.
  std::vector<TetraTangent> tangents(const BodyState& state) const;
  /// Adds K Y and D Y for the columns of Y.
  void add_products(const std::vector<TetraTangent>& at, const std::vector<NodeLanes>& y, std::vector<NodeLanes>& k_y,
                    std::vector<NodeLanes>& d_y) const;
  /// Adds (c_k K + c_d D) Y, at a lower cost than both products.
  void add_sums(const std::vector<TetraTangent>& at, const std::vector<NodeLanes>& y, double c_k, double c_d,
                std::vector<NodeLanes>& sum) const;
  /// Elastic energy [J].
  double energy(const Vector& x) const;

 private:
  struct Cell {
    std::array<std::uint32_t, 4> nodes;
    std::uint32_t material;
    TetraRest rest;
    std::array<std::array<std::uint32_t, 4>, 4> entries;  // of the pattern
  };
  /// Returns true if some elements have a volume: then mass-proportional damping is applied here.
  bool has_mass() const { return !empty() && body_->hexahedra.empty(); }
  Mat34 nodes_of(const Cell& cell, const Vector& y) const;
  /// Adds `much` times the mass-proportional damping's share of D Y.
  void add_mass_damping(const std::vector<NodeLanes>& y, double much, std::vector<NodeLanes>& to) const;
  /// Returns V P: its product with b_i is minus the force on node i.
  Mat3 stress(const Cell& cell, const Vector& x, const Vector& v) const;

  const LumpedBody* body_;
  std::vector<TetraMaterial> materials_;
  std::vector<Cell> cells_;
  std::vector<Batch> batches_;                   // of all cells
  std::vector<std::uint32_t> first_, incident_;  // cells of each node
};

}  // namespace palpate
