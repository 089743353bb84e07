// Products of many columns with the tangents of tetrahedra, four columns side by side.
#include "server/body/solid_columns.hpp"
#include "server/body/tetrahedra.hpp"

namespace palpate {
namespace {

template <class Lanes>
struct Corners {
  Lanes* of[4];
};

template <class Lanes>
[[gnu::always_inline]] inline Corners<Lanes> at_corners(const std::array<std::uint32_t, 4>& n, auto& nodes) {
  return {{&nodes[n[0]], &nodes[n[1]], &nodes[n[2]], &nodes[n[3]]}};
}

/// Computes sum over the nodes of y_i b_i^T.
[[gnu::always_inline]] inline void gradient(const Corners<const NodeLanes>& y, const Mat34& b, ColumnMat& f) {
  f = {};
  for (int i = 0; i < 4; ++i)
    for (int c = 0; c < 3; ++c) {
      add_product(b(c, i), lanes(y.of[i]->x), f.of[0][c]);
      add_product(b(c, i), lanes(y.of[i]->y), f.of[1][c]);
      add_product(b(c, i), lanes(y.of[i]->z), f.of[2][c]);
    }
}

/// Adds V P b_i on each node.
[[gnu::always_inline]] inline void scatter(const TetraRest& rest, const ColumnMat& p, const Corners<NodeLanes>& to) {
  for (int i = 0; i < 4; ++i) {
    const Vec3 b = rest.volume_m3 * rest.b.col(i);
    for (int c = 0; c < 3; ++c) {
      add_product(b[c], p.of[0][c], lanes(to.of[i]->x));
      add_product(b[c], p.of[1][c], lanes(to.of[i]->y));
      add_product(b[c], p.of[2][c], lanes(to.of[i]->z));
    }
  }
}

/// Calls `take`(k, cell, dF, dP) for each cell: the change of its F with the columns of y, and the elastic part of its stress.
[[gnu::always_inline]] inline void for_each_change(const auto& cells, const std::vector<TetraTangent>& at,
                                                   const std::vector<NodeLanes>& y, const auto& take) {
  for (std::size_t k = 0; k < cells.size(); ++k) {
    ColumnMat change, p;
    gradient(at_corners<const NodeLanes>(cells[k].nodes, y), cells[k].rest.b, change);
    apply_elastic(at[k], change, p);
    take(k, cells[k], change, p);
  }
}

}  // namespace

void Tetrahedra::add_products(const std::vector<TetraTangent>& at, const std::vector<NodeLanes>& y, std::vector<NodeLanes>& k_y,
                              std::vector<NodeLanes>& d_y) const {
  for_each_change(cells_, at, y, [&](std::size_t k, const Cell& cell, const ColumnMat& change, ColumnMat& p) {
    const TetraMaterial& m = materials_[cell.material];
    scatter(cell.rest, p, at_corners<NodeLanes>(cell.nodes, k_y));
    if (!m.is_viscous()) return;
    p = {};
    add_viscous_columns(m, 1, at[k].f(), change, p);
    scatter(cell.rest, p, at_corners<NodeLanes>(cell.nodes, d_y));
  });
  add_mass_damping(y, 1, d_y);
}

void Tetrahedra::add_sums(const std::vector<TetraTangent>& at, const std::vector<NodeLanes>& y, double c_k, double c_d,
                          std::vector<NodeLanes>& sum) const {
  for_each_change(cells_, at, y, [&](std::size_t k, const Cell& cell, const ColumnMat& change, ColumnMat& p) {
    const TetraMaterial& m = materials_[cell.material];
    for (auto& row : p.of)
      for (ColumnLanes& part : row) part *= c_k;
    if (m.is_viscous()) add_viscous_columns(m, c_d, at[k].f(), change, p);
    scatter(cell.rest, p, at_corners<NodeLanes>(cell.nodes, sum));
  });
  add_mass_damping(y, c_d, sum);
}

void Tetrahedra::add_mass_damping(const std::vector<NodeLanes>& y, double much, std::vector<NodeLanes>& to) const {
  if (!has_mass() || body_->mass_damping_1_s == 0) return;
  for (std::size_t i = 0; i < body_->nodes.size(); ++i) {
    const double c = much * body_->mass_damping_1_s * body_->masses_kg[i];
    lanes(to[i].x) += c * lanes(y[i].x);
    lanes(to[i].y) += c * lanes(y[i].y);
    lanes(to[i].z) += c * lanes(y[i].z);
  }
}

}  // namespace palpate
