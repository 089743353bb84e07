#include "server/body/dynamics.hpp"

#include <algorithm>
#include <cassert>

namespace palpate {

Dynamics::Dynamics(const LumpedBody& body)
    : body_(&body),
      masses_(3 * static_cast<Eigen::Index>(body.nodes.size())),
      pattern_(static_cast<std::uint32_t>(body.nodes.size()), edges_of(body)),
      springs_(body, pattern_),
      tetrahedra_(body, pattern_),
      hexahedra_(body, pattern_),
      relaxation_(body, tetrahedra_, hexahedra_, pattern_),
      contacts_(body),
      sutures_(body) {
  assert(!body.is_loaded);
  for (std::uint32_t i = 0; i < nodes(); ++i) at_node(masses_, i).setConstant(body.masses_kg[i]);
  if (contacts_.empty()) return;
  BlockMatrix k = make_matrix();
  assemble(rest_state(), 0, 0, relaxation_.left(), std::vector<std::uint8_t>(nodes(), 0), false, k);
  std::vector<double> own_n_m;
  for (std::uint32_t i = 0; i < nodes(); ++i) own_n_m.push_back(k.block(k.diagonal(i)).trace() / 3);
  contacts_.set_stiffness(own_n_m);
}

BodyState Dynamics::rest_state() const {
  BodyState s;
  s.x.resize(masses_.size());
  s.v = Vector::Zero(masses_.size());
  for (std::uint32_t i = 0; i < nodes(); ++i) at_node(s.x, i) = body_->nodes[i];
  s.sutures = sutures_.begun();
  return s;
}

void Dynamics::forces(const Vector& x, const Vector& v, Vector& f) const {
  f.resize(x.size());
  for (std::uint32_t i = 0; i < nodes(); ++i) at_node(f, i) = body_->masses_kg[i] * body_->gravity_m_s2;
  springs_.add_forces(x, v, f);
  tetrahedra_.add_forces(x, v, f);
  hexahedra_.add_forces(x, v, f);
}

Vec3 Dynamics::element_force(const BodyState& state, std::uint32_t node) const {
  return springs_.force_on(state, node) + tetrahedra_.force_on(state, node) + hexahedra_.force_on(state, node) +
         relaxation_.force_on(state, node) + contacts_.force_on(state, node) + sutures_.force_on(state, node);
}

BlockMatrix Dynamics::make_matrix() const { return pattern_; }

void Dynamics::add_contacts(const BodyState& state, double c_d, double c_k, const std::vector<std::uint8_t>& held,
                            BlockMatrix& a) const {
  const std::vector<Contacts::Block> contacts = contacts_.tangents(state);
  const std::vector<Sutures::Block> threads = sutures_.tangents(state);
  std::vector<BlockPattern::Pair> pairs;
  const auto join = [&](const auto& nodes) {
    for (const auto& [i, w_i] : nodes)
      for (const auto& [j, w_j] : nodes)
        if (i < j && !held[i] && !held[j]) pairs.emplace_back(i, j);
  };
  for (const Contacts::Block& contact : contacts) join(contact.nodes);
  for (const Sutures::Block& thread : threads) join(thread.y);
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  if (!pairs.empty()) a.widen(std::move(pairs));
  const auto block = [&](std::uint32_t i, std::uint32_t j) -> decltype(auto) {
    return a.block(i == j ? a.diagonal(i) : a.find(i, j));
  };
  for (const Contacts::Block& contact : contacts) {
    const Mat3 sum = c_k * contact.stiffness + c_d * contact.damping;
    for (const auto& [i, w_i] : contact.nodes)
      for (const auto& [j, w_j] : contact.nodes)
        if (!held[i] && !held[j]) block(i, j) += w_i * w_j * sum;
  }
  for (const Sutures::Block& thread : threads)
    for (const auto& [i, y_i] : thread.y)
      for (const auto& [j, y_j] : thread.y)
        if (!held[i] && !held[j]) block(i, j) += c_k * thread.stiffness_n_m * y_i * y_j.transpose();
}

void Dynamics::assemble(const BodyState& state, double c_m, double c_d, double c_k, const std::vector<std::uint8_t>& held,
                        bool clamp, BlockMatrix& a) const {
  if (!a.widened_by().empty()) a = pattern_;
  a.set_zero();
  for (std::uint32_t i = 0; i < nodes(); ++i)
    a.block(a.diagonal(i)).diagonal().setConstant(held[i] ? 1.0 : c_m * body_->masses_kg[i]);
  springs_.add_tangents(state, c_d, c_k, held, clamp, a);
  tetrahedra_.add_tangents(state, c_d, c_k, held, clamp, a);
  hexahedra_.add_tangents(state, c_d, c_k, held, clamp, a);
  relaxation_.add_tangents(state, c_k, held, clamp, a);
  if (!contacts_.empty() || !sutures_.empty()) add_contacts(state, c_d, c_k, held, a);
  if (!body_->planar) return;
  // The nodes of a planar body are not coupled across its plane; with c_m = 0 those rows would be empty.
  for (std::uint32_t i = 0; i < nodes(); ++i)
    if (!(a.block(a.diagonal(i))(2, 2) > 0)) a.block(a.diagonal(i))(2, 2) = 1;
}

void Dynamics::multiply_tangents(const BodyState& state, const Vector& y, Vector& k_y, Vector& d_y) const {
  k_y = Vector::Zero(y.size());
  d_y = Vector::Zero(y.size());
  std::vector<NodeLanes> in(nodes()), k(nodes()), d(nodes());
  pack_columns(y, 0, in);
  pack_columns(k_y, 0, k);
  pack_columns(d_y, 0, d);
  const auto add = [&](const auto& elements, auto tangents) {
    elements.find_tangents(state, tangents);
    elements.add_products(tangents, in, 1, 1, k, d);
  };
  add(springs_, std::vector<ElementTangent<TrussShape>>());
  add(tetrahedra_, std::vector<ElementTangent<TetraShape>>());
  add(hexahedra_, std::vector<ElementTangent<HexaShape>>());
  relaxation_.add_products(state.history.get(), in, 1, k);
  unpack_columns(k, 0, k_y);
  unpack_columns(d, 0, d_y);
  for (const Contacts::Block& contact : contacts_.tangents(state)) {
    Vec3 moved = Vec3::Zero();
    for (const auto& [node, weight] : contact.nodes) moved += weight * at_node(y, node);
    for (const auto& [node, weight] : contact.nodes) {
      at_node(k_y, node) += weight * (contact.stiffness * moved);
      at_node(d_y, node) += weight * (contact.damping * moved);
    }
  }
  for (const Sutures::Block& thread : sutures_.tangents(state)) {
    double moved = 0;
    for (const auto& [node, y_node] : thread.y) moved += y_node.dot(at_node(y, node));
    for (const auto& [node, y_node] : thread.y) at_node(k_y, node) += thread.stiffness_n_m * moved * y_node;
  }
}

double Dynamics::energy(const BodyState& state) const {
  double energy = 0.5 * state.v.dot(masses_.cwiseProduct(state.v)) + springs_.energy(state.x) + tetrahedra_.energy(state.x) +
                  hexahedra_.energy(state.x) + relaxation_.energy(state) + contacts_.energy(state) + sutures_.energy(state);
  for (std::uint32_t i = 0; i < nodes(); ++i)
    energy -= body_->masses_kg[i] * body_->gravity_m_s2.dot(at_node(state.x, i) - body_->nodes[i]);
  return energy;
}

void mask(const std::vector<std::uint8_t>& held, Vector& y) {
  for (std::size_t i = 0; i < held.size(); ++i)
    if (held[i]) at_node(y, static_cast<std::uint32_t>(i)).setZero();
}

}  // namespace palpate
