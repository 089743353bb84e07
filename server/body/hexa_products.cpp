// Products of many columns with the tangents of hexahedra, four columns side by side.
#include "server/body/hexahedra.hpp"
#include "server/body/solid_columns.hpp"

namespace palpate {
namespace {

/// A change of (F, q), or of its stress.
struct ColumnMat37 {
  ColumnLanes of[3][7];
};
/// A change of F^T q, or of its stress: [mode][component].
struct ColumnModes {
  ColumnLanes of[kModesOfHexa][3];
};

[[gnu::always_inline]] inline void gradient_columns(const std::array<std::uint32_t, 8>& nodes, const Mat78& g,
                                                    const std::vector<NodeLanes>& y, ColumnMat37& sum) {
  sum = {};
  for (int i = 0; i < 8; ++i) {
    const NodeLanes& at = y[nodes[static_cast<std::size_t>(i)]];
    for (int m = 0; m < 7; ++m) {
      add_product(g(m, i), lanes(at.x), sum.of[0][m]);
      add_product(g(m, i), lanes(at.y), sum.of[1][m]);
      add_product(g(m, i), lanes(at.z), sum.of[2][m]);
    }
  }
}

[[gnu::always_inline]] inline void scatter_columns(const std::array<std::uint32_t, 8>& nodes, const Mat78& g,
                                                   const ColumnMat37& p, std::vector<NodeLanes>& to) {
  for (int i = 0; i < 8; ++i) {
    NodeLanes& at = to[nodes[static_cast<std::size_t>(i)]];
    for (int m = 0; m < 7; ++m) {
      add_product(g(m, i), p.of[0][m], lanes(at.x));
      add_product(g(m, i), p.of[1][m], lanes(at.y));
      add_product(g(m, i), p.of[2][m], lanes(at.z));
    }
  }
}

[[gnu::always_inline]] inline void take_mean(const ColumnMat37& all, ColumnMat& f) {
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) f.of[r][c] = all.of[r][c];
}

/// Computes dF^T q + F^T dq.
[[gnu::always_inline]] inline void turned_back_change(const Mat3& f, const Mat34& q, const ColumnMat37& change, ColumnModes& to) {
  to = {};
  for (int a = 0; a < kModesOfHexa; ++a)
    for (int m = 0; m < 3; ++m)
      for (int r = 0; r < 3; ++r) {
        add_product(q(r, a), change.of[r][m], to.of[a][m]);
        add_product(f(r, m), change.of[r][3 + a], to.of[a][m]);
      }
}

/// Adds (q s^T, F s) to p, s = `much` k_a times a change of F^T q.
[[gnu::always_inline]] inline void add_braked(const Mat3& f, const Mat34& q, const Hourglass& modes, const ColumnModes& change,
                                              double much, ColumnMat37& p) {
  for (int a = 0; a < kModesOfHexa; ++a)
    for (int m = 0; m < 3; ++m) {
      const ColumnLanes push = much * modes.k[a] * change.of[a][m];
      for (int r = 0; r < 3; ++r) {
        add_product(q(r, a), push, p.of[r][m]);
        add_product(f(r, m), push, p.of[r][3 + a]);
      }
    }
}

struct Change {
  Mat3 f;
  Mat34 q;
  ColumnMat37 of;
  ColumnMat mean;

  [[gnu::always_inline]] Change(const HexaTangent& at, const HexaShape& shape, const std::array<std::uint32_t, 8>& nodes,
                                const std::vector<NodeLanes>& y)
      : f(at.f()), q(at.q()) {
    gradient_columns(nodes, shape.rest.g, y, of);
    take_mean(of, mean);
  }
  [[gnu::always_inline]] void add_elastic(const HexaTangent& at, const HexaShape& shape, double c_k, ColumnMat37& p) const {
    ColumnMat stress;
    apply_elastic(at.of_law(), mean, stress);
    const double volume = shape.rest.volume_m3;
    ColumnMat37 all{};
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) all.of[r][c] = volume * stress.of[r][c];
    for (int r = 0; r < 3; ++r)
      for (int a = 0; a < kModesOfHexa; ++a) all.of[r][3 + a] = shape.modes.k[a] * of.of[r][3 + a];
    for (int r = 0; r < 3; ++r)
      for (int m = 0; m < 7; ++m) p.of[r][m] += c_k * all.of[r][m];
  }
  [[gnu::always_inline]] void add_viscous(const TetraMaterial& m, const HexaShape& shape, double c_d, ColumnMat37& p) const {
    ColumnMat stress{};
    add_viscous_columns(m, c_d * shape.rest.volume_m3, f, mean, stress);
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) p.of[r][c] += stress.of[r][c];
    ColumnModes change;
    turned_back_change(f, q, of, change);
    add_braked(f, q, shape.modes, change, c_d * shape.modes.damping_s, p);
  }
};

}  // namespace

void Hexahedra::add_products(const std::vector<HexaTangent>& at, const std::vector<NodeLanes>& y, std::vector<NodeLanes>& k_y,
                             std::vector<NodeLanes>& d_y) const {
  for (std::uint32_t k = 0; k < cells_.size(); ++k) {
    const HexaShape& here = shape(k);
    const Change change(at[k], here, cells_[k].nodes, y);
    ColumnMat37 p{};
    change.add_elastic(at[k], here, 1, p);
    scatter_columns(cells_[k].nodes, here.rest.g, p, k_y);
    if (!material(k).is_viscous()) continue;
    p = {};
    change.add_viscous(material(k), here, 1, p);
    scatter_columns(cells_[k].nodes, here.rest.g, p, d_y);
  }
  add_mass_damping(y, 1, d_y);
}

void Hexahedra::add_sums(const std::vector<HexaTangent>& at, const std::vector<NodeLanes>& y, double c_k, double c_d,
                         std::vector<NodeLanes>& sum) const {
  for (std::uint32_t k = 0; k < cells_.size(); ++k) {
    const HexaShape& here = shape(k);
    const Change change(at[k], here, cells_[k].nodes, y);
    ColumnMat37 p{};
    change.add_elastic(at[k], here, c_k, p);
    if (material(k).is_viscous()) change.add_viscous(material(k), here, c_d, p);
    scatter_columns(cells_[k].nodes, here.rest.g, p, sum);
  }
  add_mass_damping(y, c_d, sum);
}

void Hexahedra::add_mass_damping(const std::vector<NodeLanes>& y, double much, std::vector<NodeLanes>& to) const {
  if (empty() || body_->mass_damping_1_s == 0) return;
  for (std::size_t i = 0; i < body_->nodes.size(); ++i) {
    const double c = much * body_->mass_damping_1_s * body_->masses_kg[i];
    lanes(to[i].x) += c * lanes(y[i].x);
    lanes(to[i].y) += c * lanes(y[i].y);
    lanes(to[i].z) += c * lanes(y[i].z);
  }
}

}  // namespace palpate
