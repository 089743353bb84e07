#include "server/body/tangents.hpp"

#include <algorithm>
#include <numeric>

namespace palpate {

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
  const ElementKernel kernel(body.law, body.stiffening);
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
}

void Tangents::multiply(const Matrix& y, Matrix& k_y, Matrix& d_y) const {
  const std::size_t nodes = dynamics_->nodes();
  k_y.resize(y.rows(), y.cols());
  d_y.resize(y.rows(), y.cols());
  std::vector<NodeLanes> in(nodes), k(nodes), d(nodes);
  for (Eigen::Index first = 0; first < y.cols(); first += kColumnLanes) {
    pack_columns(y, first, in);
    std::fill(k.begin(), k.end(), NodeLanes{});
    std::fill(d.begin(), d.end(), NodeLanes{});
    add_springs(in, k, d);
    dynamics_->tetrahedra().add_products(tetrahedra_, in, k, d);
    unpack_columns(k, first, k_y);
    unpack_columns(d, first, d_y);
  }
}

void Tangents::multiply_sum(const Matrix& y, double c_k, double c_d, Matrix& sum) const {
  if (!tetrahedra_.empty()) {
    Matrix d_y;
    multiply(y, sum, d_y);
    sum = c_k * sum + c_d * d_y;
    return;
  }
  sum.resize(y.rows(), y.cols());
  std::vector<NodeLanes> in(dynamics_->nodes()), out(in.size());
  for (Eigen::Index first = 0; first < y.cols(); first += kColumnLanes) {
    pack_columns(y, first, in);
    std::fill(out.begin(), out.end(), NodeLanes{});
    add_sum_of_springs(in, c_k, c_d, out);
    unpack_columns(out, first, sum);
  }
}

void Tangents::add_sum_of_springs(const std::vector<NodeLanes>& in, double c_k, double c_d, std::vector<NodeLanes>& sum) const {
  const double spatial = dynamics_->body().planar ? 0.0 : 1.0;
  for (std::size_t i = 0; i < in.size(); ++i) {
    const ColumnLanes x = lanes(in[i].x), y = lanes(in[i].y), z = lanes(in[i].z);
    ColumnLanes sx{}, sy{}, sz{};
    for (std::uint32_t at = first_[i]; at < first_[i + 1]; ++at) {
      const Spring& e = springs_[at];
      const double nx = e.direction[0], ny = e.direction[1], nz = e.direction[2];
      const double t = c_k * e.across_n_m, axial = c_k * e.slope_n_m - t + c_d * e.damping_n_s_m;
      const NodeLanes& other = in[e.b];
      const ColumnLanes ux = x - lanes(other.x), uy = y - lanes(other.y), uz = spatial * (z - lanes(other.z));
      const ColumnLanes pull = axial * (nx * ux + ny * uy + nz * uz);
      const ColumnLanes fx = nx * pull + t * ux, fy = ny * pull + t * uy, fz = nz * pull + t * uz;
      sx += fx, sy += fy, sz += fz;
      lanes(sum[e.b].x) -= fx, lanes(sum[e.b].y) -= fy, lanes(sum[e.b].z) -= fz;
    }
    lanes(sum[i].x) += sx, lanes(sum[i].y) += sy, lanes(sum[i].z) += sz;
  }
}

void Tangents::add_springs(const std::vector<NodeLanes>& in, std::vector<NodeLanes>& k, std::vector<NodeLanes>& d) const {
  const double spatial = dynamics_->body().planar ? 0.0 : 1.0;  // a planar body knows nothing of motion across its plane
  for (std::size_t i = 0; i < in.size(); ++i) {
    const ColumnLanes x = lanes(in[i].x), y = lanes(in[i].y), z = lanes(in[i].z);
    ColumnLanes kx{}, ky{}, kz{}, dx{}, dy{}, dz{};
    for (std::uint32_t at = first_[i]; at < first_[i + 1]; ++at) {
      const Spring& e = springs_[at];
      const double nx = e.direction[0], ny = e.direction[1], nz = e.direction[2];
      const double t = e.across_n_m, axial = e.slope_n_m - t;
      const NodeLanes& other = in[e.b];
      const ColumnLanes ux = x - lanes(other.x), uy = y - lanes(other.y), uz = spatial * (z - lanes(other.z));
      const ColumnLanes along = nx * ux + ny * uy + nz * uz;
      const ColumnLanes pull = axial * along, drag = e.damping_n_s_m * along;
      const ColumnLanes fx = nx * pull + t * ux, fy = ny * pull + t * uy, fz = nz * pull + t * uz;
      const ColumnLanes gx = nx * drag, gy = ny * drag, gz = nz * drag;
      kx += fx, ky += fy, kz += fz;
      dx += gx, dy += gy, dz += gz;
      lanes(k[e.b].x) -= fx, lanes(k[e.b].y) -= fy, lanes(k[e.b].z) -= fz;
      lanes(d[e.b].x) -= gx, lanes(d[e.b].y) -= gy, lanes(d[e.b].z) -= gz;
    }
    lanes(k[i].x) += kx, lanes(k[i].y) += ky, lanes(k[i].z) += kz;
    lanes(d[i].x) += dx, lanes(d[i].y) += dy, lanes(d[i].z) += dz;
  }
}

}  // namespace palpate
