#include "server/body/springs.hpp"

namespace palpate {

[[gnu::always_inline]] inline ElementState Springs::element_state(const Element& e, const Vector& x, const Vector& v) const {
  return kernel_.evaluate(e, at_node(x, e.b) - at_node(x, e.a), at_node(v, e.b) - at_node(v, e.a));
}

Springs::Springs(const LumpedBody& body, const BlockMatrix& pattern)
    : body_(&body), kernel_(body.law, body.stiffening), first_(body.nodes.size() + 1, 0) {
  for (const Element& e : body.elements) {
    entries_.push_back({pattern.diagonal(e.a), pattern.find(e.a, e.b), pattern.find(e.b, e.a), pattern.diagonal(e.b)});
    ++first_[e.a + 1];
    ++first_[e.b + 1];
  }
  for (std::size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
  incident_.resize(2 * body.elements.size());
  auto next = first_;
  for (std::uint32_t k = 0; k < body.elements.size(); ++k) {
    incident_[next[body.elements[k].a]++] = k;
    incident_[next[body.elements[k].b]++] = k;
  }
}

void Springs::add_forces(const Vector& x, const Vector& v, Vector& f) const {
  for (const Element& e : body_->elements) {
    const Vec3 force = ElementKernel::force_on_a(element_state(e, x, v));
    at_node(f, e.a) += force;
    at_node(f, e.b) -= force;
  }
}

Vec3 Springs::force_on(const BodyState& state, std::uint32_t node) const {
  Vec3 sum = Vec3::Zero();
  for (std::uint32_t k = first_[node]; k < first_[node + 1]; ++k) {
    const Element& e = body_->elements[incident_[k]];
    const Vec3 force = ElementKernel::force_on_a(element_state(e, state.x, state.v));
    sum += e.a == node ? force : Vec3(-force);
  }
  return sum;
}

void Springs::add_tangents(const BodyState& state, double c_d, double c_k, const std::vector<std::uint8_t>& held, bool clamp,
                           BlockMatrix& a) const {
  for (std::size_t k = 0; k < entries_.size(); ++k) {
    const Element& e = body_->elements[k];
    const bool hold_a = held[e.a], hold_b = held[e.b];
    if (hold_a && hold_b) continue;
    const ElementState s = element_state(e, state.x, state.v);
    Mat3 block = c_k * ElementKernel::stiffness_symmetric(s, clamp) + c_d * ElementKernel::damping(e, s);
    if (body_->planar) {
      block.row(2).setZero();
      block.col(2).setZero();
    }
    const Entries& at_entry = entries_[k];
    if (!hold_a) a.block(at_entry.aa) += block;
    if (!hold_b) a.block(at_entry.bb) += block;
    if (hold_a || hold_b) continue;
    a.block(at_entry.ab) -= block;
    a.block(at_entry.ba) -= block;
  }
}

void Springs::add_products(const BodyState& state, const NodeRows& y, NodeRows& k_y, NodeRows& d_y) const {
  using Row = Eigen::Map<Eigen::Array<double, 1, Eigen::Dynamic>>;
  const auto columns = y.cols();
  Eigen::Array<double, 3, Eigen::Dynamic, Eigen::RowMajor> difference(3, columns);
  Eigen::Array<double, 1, Eigen::Dynamic> along(columns), term(columns);
  for (const Element& e : body_->elements) {
    const ElementState s = element_state(e, state.x, state.v);
    const auto a = 3 * static_cast<Eigen::Index>(e.a), b = 3 * static_cast<Eigen::Index>(e.b);
    difference = y.middleRows<3>(a).array() - y.middleRows<3>(b).array();
    if (body_->planar) difference.row(2).setZero();
    along = s.direction.x() * difference.row(0) + s.direction.y() * difference.row(1) + s.direction.z() * difference.row(2);
    const double geometric = s.axial * s.inv_length, axial = s.slope - geometric;
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      term = (axial * s.direction[axis]) * along + geometric * difference.row(axis);
      Row(k_y.data() + (a + axis) * columns, columns) += term;
      Row(k_y.data() + (b + axis) * columns, columns) -= term;
      term = (e.damping_n_s_m * s.direction[axis]) * along;
      Row(d_y.data() + (a + axis) * columns, columns) += term;
      Row(d_y.data() + (b + axis) * columns, columns) -= term;
    }
  }
}

double Springs::energy(const Vector& x) const {
  double energy = 0;
  // The laws have no common closed primitive; Simpson's rule on 8 intervals is exact for linear and stiffening springs.
  for (const Element& e : body_->elements) {
    const double elongation = (at_node(x, e.b) - at_node(x, e.a)).norm() - e.rest_length_m;
    const double step = elongation / 8;
    double sum = 0;
    for (int k = 0; k <= 8; ++k) {
      const double weight = k == 0 || k == 8 ? 1.0 : (k % 2 ? 4.0 : 2.0);
      sum += weight * spring_response(body_->law, body_->stiffening, e, k * step).tension;
    }
    energy += sum * step / 3;
  }
  return energy;
}

}  // namespace palpate
