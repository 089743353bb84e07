#include "server/dynamics/tangents.hpp"

#include <algorithm>
#include <numeric>

#include "server/solve/fused.hpp"

namespace palpate {
namespace {

/// Adds a symmetric block, given as its lower half column by column.
[[gnu::always_inline]] inline void add_lower(const double (&block)[6], Mat3& to) {
  double* const m = to.data();
  m[0] += block[0], m[1] += block[1], m[2] += block[2], m[4] += block[3], m[5] += block[4], m[8] += block[5];
}

}  // namespace

Tangents::Tangents(const Dynamics& dynamics) : dynamics_(&dynamics), order_(dynamics.body().elements.size()) {
  const auto& elements = dynamics.body().elements;
  std::iota(order_.begin(), order_.end(), 0U);
  const auto ends = [&](std::uint32_t k) { return std::minmax(elements[k].a, elements[k].b); };
  std::sort(order_.begin(), order_.end(), [&](std::uint32_t i, std::uint32_t j) {
    const auto p = ends(i), q = ends(j);
    return p != q ? p < q : i < j;
  });
  springs_.resize(order_.size());
  first_.assign(dynamics.nodes() + 1, 0);
  for (std::size_t k = 0; k < order_.size(); ++k) {
    const auto [a, b] = ends(order_[k]);
    springs_[k].b = b;
    springs_[k].damping_n_s_m = elements[order_[k]].damping_n_s_m;
    ++first_[a + 1];
  }
  std::partial_sum(first_.begin(), first_.end(), first_.begin());
}

void Tangents::take(const BodyState& state) {
  const LumpedBody& body = dynamics_->body();
  const SpringKernel kernel(body.law, body.stiffening);
  for (std::size_t k = 0; k < order_.size(); ++k) {
    Spring& e = springs_[k];
    const Element& element = body.elements[order_[k]];
    const ElementState s = kernel.evaluate(element, at_node(state.x, element.b) - at_node(state.x, element.a),
                                           at_node(state.v, element.b) - at_node(state.v, element.a));
    e.direction = s.direction;
    e.slope_n_m = s.slope;
    e.across_n_m = s.axial * s.inv_length;
  }
  tetrahedra_ = dynamics_->tetrahedra().tangents(state);
  hexahedra_ = dynamics_->hexahedra().tangents(state);
  history_ = state.history;
}

void Tangents::assemble(double c_m, double c_d, double c_k, const std::vector<std::uint8_t>& held, bool clamp,
                        UpperBlocks& a) const {
  const LumpedBody& body = dynamics_->body();
  const auto nodes = static_cast<std::uint32_t>(dynamics_->nodes());
  const double spatial = body.planar ? 0 : 1;
  a.clear(nodes);
  a.pairs.reserve(springs_.size());
  const Spring* e = springs_.data();
  for (std::uint32_t i = 0; i < nodes; ++i) {
    for (const Spring* const end = springs_.data() + first_[i + 1]; e != end; ++e) {
      const double t = clamp ? std::max(e->across_n_m, 0.0) : e->across_n_m, across = c_k * t,
                   along = c_k * (e->slope_n_m - t) + c_d * e->damping_n_s_m;
      const double x = e->direction[0], y = e->direction[1], z = spatial * e->direction[2];
      // xx yx zx, yy zy, zz
      const double block[6] = {along * x * x + across, along * y * x, along * z * x,
                               along * y * y + across, along * z * y, along * z * z + spatial * across};
      if (!held[i]) add_lower(block, a.diagonal[i]);
      if (!held[e->b]) add_lower(block, a.diagonal[e->b]);
      if (held[i] || held[e->b]) continue;
      if (a.pairs.size() == a.first.back() || a.pairs.back().column != e->b) a.pairs.push_back({{}, e->b});
      float(&pair)[9] = a.pairs.back().block;
      constexpr int kOf[9] = {0, 1, 2, 1, 3, 4, 2, 4, 5};
      for (int k = 0; k < 9; ++k) pair[k] -= static_cast<float>(block[kOf[k]]);
    }
    a.end_row();
  }
  for (std::uint32_t i = 0; i < nodes; ++i) {
    Mat3& block = a.diagonal[i];
    block = block.selfadjointView<Eigen::Lower>().toDenseMatrix();
    block.diagonal().array() += held[i] ? 1.0 : c_m * body.masses_kg[i];
    // The nodes of a planar body are not coupled across its plane.
    if (body.planar && !(block(2, 2) > 0)) block(2, 2) = 1;
  }
}

void Tangents::multiply(const Matrix& y, Matrix& k_y, Matrix& d_y) const {
  k_y.resize(y.rows(), y.cols());
  d_y.resize(y.rows(), y.cols());
  std::vector<NodeLanes> in(dynamics_->nodes()), k(in.size()), d(in.size());
  for (Eigen::Index first = 0; first < y.cols(); first += kColumnLanes) {
    pack_columns(y, first, in);
    std::fill(k.begin(), k.end(), NodeLanes{});
    std::fill(d.begin(), d.end(), NodeLanes{});
    add_products(in, 1, 1, k, d);
    unpack_columns(k, first, k_y);
    unpack_columns(d, first, d_y);
  }
}

void Tangents::multiply_sum(const Matrix& y, double c_k, double c_d, Matrix& sum) const {
  sum.resize(y.rows(), y.cols());
  std::vector<NodeLanes> in(dynamics_->nodes()), out(in.size());
  for (Eigen::Index first = 0; first < y.cols(); first += kColumnLanes) {
    pack_columns(y, first, in);
    std::fill(out.begin(), out.end(), NodeLanes{});
    add_products(in, c_k, c_d, out, out);
    unpack_columns(out, first, sum);
  }
}

void Tangents::add_products(const std::vector<NodeLanes>& in, double c_k, double c_d, std::vector<NodeLanes>& k,
                            std::vector<NodeLanes>& d) const {
  const bool together = &k == &d;
  add_springs<true>(in, c_k, together ? c_d : 0, k);
  if (!together) add_springs<false>(in, 0, c_d, d);
  dynamics_->tetrahedra().add_products(tetrahedra_, in, c_k, c_d, k, d);
  dynamics_->hexahedra().add_products(hexahedra_, in, c_k, c_d, k, d);
  dynamics_->relaxation().add_products(history_.get(), in, c_k, k);
}

template <bool kWithStiffness>
void Tangents::add_springs(const std::vector<NodeLanes>& in, double c_k, double c_d, std::vector<NodeLanes>& sum) const {
  const double spatial = dynamics_->body().planar ? 0.0 : 1.0;  // a planar body has no motion across its plane
  const Spring* e = springs_.data();
  for (std::size_t i = 0; i < in.size(); ++i) {
    const ColumnLanes x = lanes(in[i].x), y = lanes(in[i].y), z = lanes(in[i].z);
    ColumnLanes sx{}, sy{}, sz{};
    for (const Spring* const end = springs_.data() + first_[i + 1]; e != end; ++e) {
      const double nx = e->direction[0], ny = e->direction[1], nz = e->direction[2];
      const double t = kWithStiffness ? c_k * e->across_n_m : 0, axial = c_k * e->slope_n_m - t + c_d * e->damping_n_s_m;
      const NodeLanes& other = in[e->b];
      const ColumnLanes ux = x - lanes(other.x), uy = y - lanes(other.y), uz = spatial * (z - lanes(other.z));
      ColumnLanes pull = nz * uz, fx{}, fy{}, fz{};
      if constexpr (kWithStiffness) fx = t * ux, fy = t * uy, fz = t * uz;
      add_product(ny, uy, pull), add_product(nx, ux, pull);
      pull *= axial;
      add_product(nx, pull, fx), add_product(ny, pull, fy), add_product(nz, pull, fz);
      sx += fx, sy += fy, sz += fz;
      NodeLanes& to = sum[e->b];
      lanes(to.x) -= fx, lanes(to.y) -= fy, lanes(to.z) -= fz;
    }
    lanes(sum[i].x) += sx, lanes(sum[i].y) += sy, lanes(sum[i].z) += sz;
  }
}

}  // namespace palpate
