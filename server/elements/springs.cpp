#include "server/elements/springs.hpp"

namespace palpate {

[[gnu::always_inline]] inline ElementState Springs::element_state(const Element& e, const Vector& x, const Vector& v) const {
  return kernel_.evaluate(e, at_node(x, e.b) - at_node(x, e.a), at_node(v, e.b) - at_node(v, e.a));
}

Springs::Springs(const LumpedBody& body, const BlockMatrix& pattern)
    : body_(&body), kernel_(body.law, body.stiffening), groups_(spring_groups(body)), first_(body.nodes.size() + 1, 0) {
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
  if (!groups_.empty()) {
    const double stiffening = body_->law == SpringLaw::stiffening ? body_->stiffening : 0;
    spring_loops().back().run(groups_, stiffening, x.data(), v.data(), f.data());
    return;
  }
  for (const Element& e : body_->elements) {
    const Vec3 force = SpringKernel::force_on_a(element_state(e, x, v));
    at_node(f, e.a) += force;
    at_node(f, e.b) -= force;
  }
}

Vec3 Springs::force_on(const BodyState& state, std::uint32_t node) const {
  Vec3 sum = Vec3::Zero();
  for (std::uint32_t k = first_[node]; k < first_[node + 1]; ++k) {
    const Element& e = body_->elements[incident_[k]];
    const Vec3 force = SpringKernel::force_on_a(element_state(e, state.x, state.v));
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
    Mat3 block = c_k * SpringKernel::stiffness_symmetric(s, clamp) + c_d * SpringKernel::damping(e, s);
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

void Springs::add_products(const BodyState& state, const Vector& y, Vector& k_y, Vector& d_y) const {
  for (const Element& e : body_->elements) {
    const ElementState s = element_state(e, state.x, state.v);
    Vec3 difference = at_node(y, e.a) - at_node(y, e.b);
    if (body_->planar) difference.z() = 0;
    const double along = s.direction.dot(difference), across = s.axial * s.inv_length;
    const Vec3 k = (s.slope - across) * along * s.direction + across * difference;
    const Vec3 d = e.damping_n_s_m * along * s.direction;
    at_node(k_y, e.a) += k;
    at_node(k_y, e.b) -= k;
    at_node(d_y, e.a) += d;
    at_node(d_y, e.b) -= d;
  }
}

double Springs::energy(const Vector& x) const {
  double energy = 0;
  for (const Element& e : body_->elements)
    energy += spring_energy(body_->law, body_->stiffening, e, (at_node(x, e.b) - at_node(x, e.a)).norm() - e.rest_length_m);
  return energy;
}

}  // namespace palpate
