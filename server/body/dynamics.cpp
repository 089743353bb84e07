#include "server/body/dynamics.hpp"

namespace palpate {
namespace {

auto at(const Vector& v, std::uint32_t node) { return v.segment<3>(3 * static_cast<Eigen::Index>(node)); }
auto at(Vector& v, std::uint32_t node) { return v.segment<3>(3 * static_cast<Eigen::Index>(node)); }

std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs_of(const LumpedBody& body) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
  pairs.reserve(body.elements.size());
  for (const Element& e : body.elements) pairs.emplace_back(e.a, e.b);
  return pairs;
}

}  // namespace

[[gnu::always_inline]] inline ElementState Dynamics::element_state(const Element& e, const Vector& x, const Vector& v) const {
  return kernel_.evaluate(e, at(x, e.b) - at(x, e.a), at(v, e.b) - at(v, e.a));
}

Dynamics::Dynamics(const LumpedBody& body)
    : body_(&body),
      kernel_(body.law, body.stiffening),
      masses_(3 * static_cast<Eigen::Index>(body.nodes.size())),
      pattern_(static_cast<std::uint32_t>(body.nodes.size()), pairs_of(body)) {
  for (std::uint32_t i = 0; i < nodes(); ++i) at(masses_, i).setConstant(body.masses_kg[i]);
  first_.assign(nodes() + 1, 0);
  for (const Element& e : body.elements) {
    entries_.push_back({pattern_.diagonal(e.a), pattern_.find(e.a, e.b), pattern_.find(e.b, e.a), pattern_.diagonal(e.b)});
    ++first_[e.a + 1];
    ++first_[e.b + 1];
  }
  for (std::uint32_t i = 0; i < nodes(); ++i) first_[i + 1] += first_[i];
  incident_.resize(2 * body.elements.size());
  auto next = first_;
  for (std::uint32_t k = 0; k < body.elements.size(); ++k) {
    incident_[next[body.elements[k].a]++] = k;
    incident_[next[body.elements[k].b]++] = k;
  }
}

BodyState Dynamics::rest_state() const {
  BodyState s;
  s.x.resize(masses_.size());
  s.v = Vector::Zero(masses_.size());
  for (std::uint32_t i = 0; i < nodes(); ++i) at(s.x, i) = body_->nodes[i];
  return s;
}

void Dynamics::forces(const Vector& x, const Vector& v, Vector& f) const {
  f.resize(x.size());
  for (std::uint32_t i = 0; i < nodes(); ++i) at(f, i) = body_->masses_kg[i] * body_->gravity_m_s2;
  for (const Element& e : body_->elements) {
    const Vec3 force = ElementKernel::force_on_a(element_state(e, x, v));
    at(f, e.a) += force;
    at(f, e.b) -= force;
  }
}

Vec3 Dynamics::element_force(const BodyState& state, std::uint32_t node) const {
  Vec3 sum = Vec3::Zero();
  for (std::uint32_t k = first_[node]; k < first_[node + 1]; ++k) {
    const Element& e = body_->elements[incident_[k]];
    const Vec3 force = ElementKernel::force_on_a(element_state(e, state.x, state.v));
    sum += e.a == node ? force : Vec3(-force);
  }
  return sum;
}

BlockMatrix Dynamics::make_matrix() const { return pattern_; }

void Dynamics::assemble(const BodyState& state, double c_m, double c_d, double c_k, const std::vector<std::uint8_t>& held,
                        bool clamp, BlockMatrix& a) const {
  a.set_zero();
  for (std::uint32_t i = 0; i < nodes(); ++i)
    a.block(a.diagonal(i)).diagonal().setConstant(held[i] ? 1.0 : c_m * body_->masses_kg[i]);
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
  if (!body_->planar) return;
  // Nothing couples the nodes of a planar body across its plane; with c_m = 0 those rows would be empty.
  for (std::uint32_t i = 0; i < nodes(); ++i)
    if (!(a.block(a.diagonal(i))(2, 2) > 0)) a.block(a.diagonal(i))(2, 2) = 1;
}

void Dynamics::multiply_tangents(const BodyState& state, const Vector& y, Vector& k_y, Vector& d_y) const {
  k_y = Vector::Zero(y.size());
  d_y = Vector::Zero(y.size());
  for (const Element& e : body_->elements) {
    const ElementState s = element_state(e, state.x, state.v);
    Vec3 difference = at(y, e.a) - at(y, e.b);
    if (body_->planar) difference.z() = 0;
    const double along = s.direction.dot(difference);
    const double geometric = s.axial * s.inv_length;
    Vec3 k = (s.slope - geometric) * along * s.direction + geometric * difference;
    const Vec3 d = e.damping_n_s_m * along * s.direction;
    at(k_y, e.a) += k;
    at(k_y, e.b) -= k;
    at(d_y, e.a) += d;
    at(d_y, e.b) -= d;
  }
}

Vector Dynamics::multiply_stiffness_exact(const BodyState& state, const Vector& y) const {
  Vector result = Vector::Zero(y.size());
  for (const Element& e : body_->elements) {
    const Mat3 block = ElementKernel::stiffness_exact(e, element_state(e, state.x, state.v));
    const Vec3 k = block * (at(y, e.a) - at(y, e.b));
    at(result, e.a) += k;
    at(result, e.b) -= k;
  }
  return result;
}

double Dynamics::energy(const BodyState& state) const {
  double energy = 0.5 * state.v.dot(masses_.cwiseProduct(state.v));
  for (std::uint32_t i = 0; i < nodes(); ++i)
    energy -= body_->masses_kg[i] * body_->gravity_m_s2.dot(at(state.x, i) - body_->nodes[i]);
  // The laws have no common closed primitive; Simpson's rule on 8 intervals is exact for linear and stiffening springs.
  for (const Element& e : body_->elements) {
    const double elongation = (at(state.x, e.b) - at(state.x, e.a)).norm() - e.rest_length_m;
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

void mask(const std::vector<std::uint8_t>& held, Vector& y) {
  for (std::size_t i = 0; i < held.size(); ++i)
    if (held[i]) y.segment<3>(3 * static_cast<Eigen::Index>(i)).setZero();
}

}  // namespace palpate
