// All hexahedra of a body: hexa_kernel.hpp summed over its finite elements. Signs and symbols as in dynamics.hpp; masses and
// mass-proportional damping as in tetrahedra.hpp, where a node's share of an element is the integral of its shape function.
#pragma once

#include <array>
#include <memory>
#include <span>
#include <vector>

#include "server/body/body_state.hpp"
#include "server/body/column_lanes.hpp"
#include "server/body/hexa_lanes.hpp"

namespace palpate {

class Hexahedra {
 public:
  using Blocks = HexaBlocks;

  /// `body` must outlive it. `pattern` has a block for every pair of nodes that share an element.
  Hexahedra(const LumpedBody& body, const BlockMatrix& pattern);

  bool empty() const { return cells_.empty(); }
  const HexaShape& shape(std::uint32_t hexahedron) const { return (*shapes_)[cells_[hexahedron].shape]; }
  const TetraMaterial& material(std::uint32_t hexahedron) const { return materials_[shape(hexahedron).material]; }
  /// Returns (F, q) of one hexahedron for any nodal field.
  Mat37 gradient(std::uint32_t hexahedron, const Eigen::Ref<const Vector>& y) const;
  /// Adds the forces of the elements to f.
  void add_forces(const Vector& x, const Vector& v, Vector& f) const;
  Vec3 force_on(const BodyState& state, std::uint32_t node) const;
  /// Adds c_d D + c_k K (symmetric part) to A, except rows and columns of held nodes; see HexaTangent for `clamp`.
  void add_tangents(const BodyState& state, double c_d, double c_k, const std::vector<std::uint8_t>& held, bool clamp,
                    BlockMatrix& a) const;
  /// Hexahedra of one material side by side, with their indices.
  struct Batch {
    HexaGroup group;
    std::array<std::uint32_t, kHexaLanes> cells{};
  };
  /// Groups these cells, those of one shape together.
  std::vector<Batch> batches(std::span<const std::uint32_t> cells) const;
  /// Computes c_d D + c_k K between the nodes of each, without mass-proportional damping; see HexaTangent for `clamp`.
  void blocks(const Batch& batch, const Vector& x, double c_d, double c_k, bool clamp, HexaBlocks& blocks) const;
  /// Returns the tangent of each hexahedron at one state, for products with K and D.
  std::vector<HexaTangent> tangents(const BodyState& state) const;
  /// Adds K Y and D Y for the columns of Y.
  void add_products(const std::vector<HexaTangent>& at, const std::vector<NodeLanes>& y, std::vector<NodeLanes>& k_y,
                    std::vector<NodeLanes>& d_y) const;
  /// Adds (c_k K + c_d D) Y, at a lower cost than both products.
  void add_sums(const std::vector<HexaTangent>& at, const std::vector<NodeLanes>& y, double c_k, double c_d,
                std::vector<NodeLanes>& sum) const;
  /// Elastic energy [J].
  double energy(const Vector& x) const;

 private:
  struct Cell {
    std::array<std::uint32_t, 8> nodes;
    std::uint32_t shape;
    std::array<std::array<std::uint32_t, 8>, 8> entries;  // of the pattern
  };
  void take_shapes();
  void list_incident();
  /// Adds `much` times the mass-proportional damping's share of D Y.
  void add_mass_damping(const std::vector<NodeLanes>& y, double much, std::vector<NodeLanes>& to) const;

  const LumpedBody* body_;
  std::vector<TetraMaterial> materials_;
  std::shared_ptr<const std::vector<HexaShape>> shapes_;  // batches point into it
  std::vector<std::uint32_t> of_shape_;                   // number of cells of each shape
  std::vector<Cell> cells_;
  std::vector<Batch> batches_;                   // of all cells
  std::vector<std::uint32_t> first_, incident_;  // cells of each node
};

}  // namespace palpate
