#include "server/body/tangents.hpp"

#include <algorithm>
#include <numeric>

namespace palpate {
namespace {

/// Adds a symmetric block, given as its lower half column by column.
[[gnu::always_inline]] inline void add_lower(const double (&block)[6], Mat3& to) {
  double* const m = to.data();
  m[0] += block[0], m[1] += block[1], m[2] += block[2], m[4] += block[3], m[5] += block[4], m[8] += block[5];
}

void add_block(const Mat3& m, const NodeLanes& y, NodeLanes& to) {
  const ColumnLanes x[3] = {lanes(y.x), lanes(y.y), lanes(y.z)};
  ColumnLanes* const rows[3] = {&lanes(to.x), &lanes(to.y), &lanes(to.z)};
  for (int r = 0; r < 3; ++r) *rows[r] += m(r, 0) * x[0] + m(r, 1) * x[1] + m(r, 2) * x[2];
}

/// Returns the weighted sum of nodes.
NodeLanes weighted(const NodeWeights& nodes, const std::vector<NodeLanes>& y) {
  NodeLanes sum{};
  for (const auto& [node, weight] : nodes) {
    lanes(sum.x) += weight * lanes(y[node].x);
    lanes(sum.y) += weight * lanes(y[node].y);
    lanes(sum.z) += weight * lanes(y[node].z);
  }
  return sum;
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
  first_.assign(dynamics.nodes() + 1, 0);
  for (const std::uint32_t k : order_) ++first_[ends(k).first + 1];
  std::partial_sum(first_.begin(), first_.end(), first_.begin());
}

void Tangents::take(const BodyState& state) {
  dynamics_->springs().find_tangents(state, springs_);
  dynamics_->tetrahedra().find_tangents(state, tetrahedra_);
  dynamics_->hexahedra().find_tangents(state, hexahedra_);
  history_ = state.history;
  contacts_ = dynamics_->contacts().tangents(state);
  threads_ = dynamics_->sutures().tangents(state);
}

void Tangents::assemble(double c_m, double c_d, double c_k, const std::vector<std::uint8_t>& held, bool clamp,
                        UpperBlocks& a) const {
  const LumpedBody& body = dynamics_->body();
  const auto nodes = static_cast<std::uint32_t>(dynamics_->nodes());
  const double spatial = body.planar ? 0 : 1;
  a.clear(nodes);
  a.pairs.reserve(springs_.size());
  for (std::uint32_t i = 0; i < nodes; ++i) {
    for (std::uint32_t k = first_[i]; k < first_[i + 1]; ++k) {
      const ElementTangent<TrussShape>& e = springs_[order_[k]];
      const auto& ends = body.elements[order_[k]];
      const std::uint32_t other = ends.a + ends.b - i;
      const double t = clamp ? std::max(e.across_n_m, 0.0) : e.across_n_m, across = c_k * t,
                   along = c_k * (e.slope_n_m - t) + c_d * e.damping_n_s_m;
      const double x = e.direction[0], y = e.direction[1], z = spatial * e.direction[2];
      // xx yx zx, yy zy, zz
      const double block[6] = {along * x * x + across, along * y * x, along * z * x,
                               along * y * y + across, along * z * y, along * z * z + spatial * across};
      if (!held[i]) add_lower(block, a.diagonal[i]);
      if (!held[other]) add_lower(block, a.diagonal[other]);
      if (held[i] || held[other]) continue;
      if (a.pairs.size() == a.first.back() || a.pairs.back().column != other) a.pairs.push_back({{}, other});
      float(&pair)[9] = a.pairs.back().block;
      constexpr int kOf[9] = {0, 1, 2, 1, 3, 4, 2, 4, 5};
      for (int n = 0; n < 9; ++n) pair[n] -= static_cast<float>(block[kOf[n]]);
    }
    a.end_row();
  }
  for (const Contacts::Block& contact : contacts_)  // of springs each is with a rigid part
    if (const std::uint32_t node = contact.nodes.front().first; !held[node])
      a.diagonal[node] += c_k * contact.stiffness + c_d * contact.damping;
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
  dynamics_->springs().add_products(springs_, in, c_k, c_d, k, d);
  dynamics_->tetrahedra().add_products(tetrahedra_, in, c_k, c_d, k, d);
  dynamics_->hexahedra().add_products(hexahedra_, in, c_k, c_d, k, d);
  dynamics_->relaxation().add_products(history_.get(), in, c_k, k);
  for (const Contacts::Block& contact : contacts_) {
    const NodeLanes moved = weighted(contact.nodes, in);
    for (const auto& [node, weight] : contact.nodes) {
      add_block(weight * c_k * contact.stiffness, moved, k[node]);
      add_block(weight * c_d * contact.damping, moved, d[node]);
    }
  }
  for (const Sutures::Block& thread : threads_) {
    ColumnLanes moved{};
    for (const auto& [node, y] : thread.y)
      moved += y[0] * lanes(in[node].x) + y[1] * lanes(in[node].y) + y[2] * lanes(in[node].z);
    moved *= c_k * thread.stiffness_n_m;
    for (const auto& [node, y] : thread.y) {
      lanes(k[node].x) += y[0] * moved;
      lanes(k[node].y) += y[1] * moved;
      lanes(k[node].z) += y[2] * moved;
    }
  }
}

}  // namespace palpate
