// All elements of one kind of a body: springs, tetrahedra with the triangles of a membrane, or hexahedra (element_shape.hpp,
// element_loops.hpp). Signs and symbols as in dynamics.hpp.
//
// Masses are lumped: a node's share of an element is the integral of its shape function. Mass-proportional damping is a force
// -c m_i v_i on each node, c = LumpedBody::mass_damping_1_s, m_i the node's mass.
#pragma once

#include <array>
#include <memory>
#include <span>
#include <vector>

#include "server/elements/body_state.hpp"
#include "server/elements/element_loops.hpp"

namespace palpate {

template <class Shape>
class Elements {
 public:
  using Blocks = ElementBlocks<Shape>;

  /// `body` must outlive it. `pattern` has a block for every pair of nodes that share an element.
  Elements(const LumpedBody& body, const BlockMatrix& pattern);

  bool empty() const { return cells_.empty(); }
  const Shape& shape(std::uint32_t element) const { return (*shapes_)[cells_[element].shape]; }
  const MaterialOf<Shape>& material(std::uint32_t element) const { return materials_[cells_[element].material]; }
  /// Returns (F, q) of one element for any nodal field.
  typename Shape::Gradient gradient(std::uint32_t element, const Eigen::Ref<const Vector>& y) const;
  /// Returns the elastic stress of (F, q), times V [J and N].
  typename Shape::Gradient elastic_stress(std::uint32_t element, const typename Shape::Gradient& at) const
      requires(!kIsTruss<Shape>);
  /// Adds the forces of the elements to f.
  void add_forces(const Vector& x, const Vector& v, Vector& f) const;
  Vec3 force_on(const BodyState& state, std::uint32_t node) const;
  /// Adds c_d D + c_k K (symmetric part) to A, except rows and columns of held nodes; see ElementLoops for `clamp`.
  void add_tangents(const BodyState& state, double c_d, double c_k, const std::vector<std::uint8_t>& held, bool clamp,
                    BlockMatrix& a) const;
  /// Elements of one material side by side, with their indices.
  struct Batch {
    ElementGroup<Shape> group;
    std::array<std::uint32_t, kElementLanes> cells{};
  };
  /// Groups these cells, those of one shape together.
  std::vector<Batch> batches(std::span<const std::uint32_t> cells) const;
  /// Computes c_d D + c_k K between the nodes of each, without mass-proportional damping; see ElementLoops for `clamp`.
  void blocks(const Batch& batch, const BodyState& at, double c_d, double c_k, bool clamp, Blocks& blocks) const {
    loops().blocks(materials_[batch.group.material], batch.group, at.x.data(), at.v.data(), c_d, c_k, clamp, blocks);
  }
  /// Computes the tangent of each element at one state, for products with K and D.
  void find_tangents(const BodyState& state, std::vector<ElementTangent<Shape>>& tangents) const;
  /// Adds c_k K Y to k_y and c_d D Y to d_y, which may be one, for the columns of Y.
  void add_products(const std::vector<ElementTangent<Shape>>& at, const std::vector<NodeLanes>& y, double c_k, double c_d,
                    std::vector<NodeLanes>& k_y, std::vector<NodeLanes>& d_y) const;
  /// Elastic energy [J].
  double energy(const Vector& x) const;

 private:
  using Cell = ElementCell<Shape>;
  using Nodes = std::array<std::uint32_t, Shape::kNodes>;
  static const ElementLoops<Shape>& loops() { return element_loops<Shape>().back(); }
  void find_shapes();
  void list_incident();
  /// Adds the blocks of one lane; `entries`: their positions in `a`.
  static void add_blocks(const Blocks& blocks, std::size_t lane, const Cell& cell, const std::uint32_t* entries,
                         const std::vector<std::uint8_t>& held, BlockMatrix& a);

  const LumpedBody* body_;
  std::vector<MaterialOf<Shape>> materials_;
  std::vector<Cell> cells_;
  std::vector<std::uint32_t> entries_;                // of the pattern, for each cell's pairs of nodes
  std::shared_ptr<const std::vector<Shape>> shapes_;  // batches point into it
  std::vector<std::uint32_t> of_shape_;               // number of cells of each shape
  std::vector<Batch> batches_;                        // of all cells
  std::vector<std::uint32_t> first_, incident_;       // cells of each node
  std::vector<double> mass_damping_n_s_m_;            // c m_i of each node where these elements apply it, or empty
};

using Springs = Elements<TrussShape>;
using Tetrahedra = Elements<TetraShape>;
using Hexahedra = Elements<HexaShape>;
extern template class Elements<TrussShape>;
extern template class Elements<TetraShape>;
extern template class Elements<HexaShape>;

}  // namespace palpate
