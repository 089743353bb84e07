#include "server/body/tangents.hpp"

#include <algorithm>
#include <numeric>

namespace palpate {
namespace {

constexpr int kLanes = 4;  // columns that are multiplied side by side
using Wide = double __attribute__((vector_size(kLanes * sizeof(double)), may_alias));

/// What one node does in kLanes columns.
struct alignas(sizeof(Wide)) Rows {
  double x[kLanes], y[kLanes], z[kLanes];
};

[[gnu::always_inline]] inline Wide& wide(double (&lanes)[kLanes]) { return *reinterpret_cast<Wide*>(lanes); }
[[gnu::always_inline]] inline const Wide& wide(const double (&lanes)[kLanes]) { return *reinterpret_cast<const Wide*>(lanes); }

/// Columns first ... first + kLanes - 1, zero beyond the last.
void pack(const Matrix& from, Eigen::Index first, std::vector<Rows>& to) {
  const Eigen::Index count = std::min<Eigen::Index>(kLanes, from.cols() - first);
  std::fill(to.begin(), to.end(), Rows{});
  for (Eigen::Index c = 0; c < count; ++c) {
    const double* column = from.col(first + c).data();
    for (Rows& r : to) {
      r.x[c] = *column++;
      r.y[c] = *column++;
      r.z[c] = *column++;
    }
  }
}

void unpack(const std::vector<Rows>& from, Eigen::Index first, Matrix& to) {
  const Eigen::Index count = std::min<Eigen::Index>(kLanes, to.cols() - first);
  for (Eigen::Index c = 0; c < count; ++c) {
    double* column = to.col(first + c).data();
    for (const Rows& r : from) {
      *column++ = r.x[c];
      *column++ = r.y[c];
      *column++ = r.z[c];
    }
  }
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
  multiply_springs(y, k_y, d_y);
  dynamics_->tetrahedra().add_products(tetrahedra_, y, k_y, d_y);
}

void Tangents::multiply_springs(const Matrix& y, Matrix& k_y, Matrix& d_y) const {
  const std::size_t nodes = dynamics_->nodes();
  const double spatial = dynamics_->body().planar ? 0.0 : 1.0;  // a planar body knows nothing of motion across its plane
  k_y.resize(y.rows(), y.cols());
  d_y.resize(y.rows(), y.cols());
  std::vector<Rows> in(nodes), k(nodes), d(nodes);
  for (Eigen::Index first = 0; first < y.cols(); first += kLanes) {
    pack(y, first, in);
    std::fill(k.begin(), k.end(), Rows{});
    std::fill(d.begin(), d.end(), Rows{});
    for (std::size_t i = 0; i < nodes; ++i) {
      const Wide x = wide(in[i].x), y_i = wide(in[i].y), z = wide(in[i].z);
      Wide kx{}, ky{}, kz{}, dx{}, dy{}, dz{};
      for (std::uint32_t at = first_[i]; at < first_[i + 1]; ++at) {
        const Spring& e = springs_[at];
        const double nx = e.direction[0], ny = e.direction[1], nz = e.direction[2];
        const double t = e.across_n_m, axial = e.slope_n_m - t;
        const Rows& other = in[e.b];
        const Wide ux = x - wide(other.x), uy = y_i - wide(other.y), uz = spatial * (z - wide(other.z));
        const Wide along = nx * ux + ny * uy + nz * uz;
        const Wide pull = axial * along, drag = e.damping_n_s_m * along;
        const Wide fx = nx * pull + t * ux, fy = ny * pull + t * uy, fz = nz * pull + t * uz;
        const Wide gx = nx * drag, gy = ny * drag, gz = nz * drag;
        kx += fx, ky += fy, kz += fz;
        dx += gx, dy += gy, dz += gz;
        wide(k[e.b].x) -= fx, wide(k[e.b].y) -= fy, wide(k[e.b].z) -= fz;
        wide(d[e.b].x) -= gx, wide(d[e.b].y) -= gy, wide(d[e.b].z) -= gz;
      }
      wide(k[i].x) += kx, wide(k[i].y) += ky, wide(k[i].z) += kz;
      wide(d[i].x) += dx, wide(d[i].y) += dy, wide(d[i].z) += dz;
    }
    unpack(k, first, k_y);
    unpack(d, first, d_y);
  }
}

}  // namespace palpate
