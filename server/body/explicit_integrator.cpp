#include "server/body/explicit_integrator.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "common/base/limits.hpp"

namespace palpate {
namespace {

constexpr double kHeldOverS = 0.006;
constexpr double kShortestShare = 0.2;  // of the step at rest: below that TR-BDF2 is cheaper

/// Largest eigenvalue of M^-1 K (or D): power iteration, from a start that has some of everything.
double largest(const Dynamics& dynamics, const BodyState& rest, bool of_damping) {
  constexpr int kIterations = 60;
  constexpr double kFromBelow = 1.03;  // what is still missing after those
  Vector y(rest.x.size()), k_y, d_y;
  for (Eigen::Index i = 0; i < y.size(); ++i) y[i] = i % 2 == 0 ? 1.0 : -0.7 + 0.01 * static_cast<double>(i % 13);
  double value = 0;
  for (int k = 0; k < kIterations; ++k) {
    mask(dynamics.body().fixed, y);
    y /= std::sqrt(std::max(y.dot(dynamics.masses().cwiseProduct(y)), 1e-300));
    dynamics.multiply_tangents(rest, y, k_y, d_y);
    const Vector& image = of_damping ? d_y : k_y;
    value = y.dot(image);
    if (!(value > 0)) return 0;
    y = image.cwiseQuotient(dynamics.masses());
  }
  return kFromBelow * value;
}

/// Largest eigenvalue of one step on (x, h v, h^2 a).
double growth(double w2, double g, double h) {
  const double w = h * h * w2, z = h * g;
  Mat3 step;
  step.row(2) << -w, -z, -z / 2;
  step.row(1) = Eigen::RowVector3d(0, 1, 0) + step.row(2);
  step.row(0) = Eigen::RowVector3d(1, 0, 0) + step.row(1);
  return step.eigenvalues().cwiseAbs().maxCoeff();
}

}  // namespace

double leapfrog_step_s(double w2, double g) {
  constexpr double kRounding = 1e-9, kLongest = 1;
  double stable = 0, unstable = kLongest;
  if (growth(w2, g, unstable) <= 1 + kRounding) return kLongest;
  for (int k = 0; k < 60; ++k) {
    const double h = 0.5 * (stable + unstable);
    (growth(w2, g, h) <= 1 + kRounding ? stable : unstable) = h;
  }
  return stable;
}

ExplicitIntegrator::ExplicitIntegrator(const Dynamics& dynamics, const Skin& skin)
    : dynamics_(&dynamics), skin_(&skin), springs_(dynamics.body()), fallback_(dynamics, skin, {}) {
  const BodyState rest = dynamics.rest_state();
  w2_ = kStiffer * largest(dynamics, rest, false);
  g_ = kThicker * largest(dynamics, rest, true);
  step_s_ = kShare * leapfrog_step_s(w2_, g_);
  spacing_m_ = mean_edge_m(dynamics.body());
  for (NodeArrays* y : {&u_, &v_, &a_, &predicted_, &f_}) *y = NodeArrays(dynamics.nodes());
  nowhere_.assign(u_.x.size(), 0.0F);
}

void ExplicitIntegrator::employ(Crew& crew) { crew_ = crew.size() > 1 && springs() >= kWorthSharing ? &crew : nullptr; }

template <typename Work>
void ExplicitIntegrator::share(std::size_t parts, const Work& work) const {
  if (crew_)
    crew_->run(parts, std::ref(work));
  else
    for (std::size_t part = 0; part < parts; ++part) work(part);
}

leapfrog::Nodes ExplicitIntegrator::nodes_of(std::size_t part) const {
  const std::size_t blocks = u_.x.size() / NodeArrays::kBlock, parts = node_parts();
  return {NodeArrays::kBlock * (part * blocks / parts), NodeArrays::kBlock * ((part + 1) * blocks / parts)};
}

AdvanceReport ExplicitIntegrator::advance(BodyState& state, std::vector<ToolPort>& ports, double until_s, double step_s,
                                          const ToolMotion& tools) {
  const double begin_s = state.time_s, whole_s = until_s - begin_s;
  if (!(whole_s > 1e-9)) return {};
  const std::vector<ToolPort> ports_before = ports;
  take(state, ports);
  AdvanceReport report;
  double h = longest_step_s(step_s);
  if (h >= kShortestShare * std::min(step_s, step_s_)) {
    report.steps = static_cast<int>(std::ceil(whole_s / h - 1e-9));
    h = whole_s / report.steps;
    accelerate(v_, ports);
    kick(-h / 2);
    for (int k = 0; k < report.steps; ++k) step(ports, begin_s + k * h, h, tools);
    kick(h / 2);
    if (is_sound(h)) {
      give(state, ports, tools, until_s);
      find_holding_forces(*dynamics_, state, ports);
      return report;
    }
  }
  const int cut = report.steps;
  ports = ports_before;
  report = fallback_.advance(state, ports, until_s, step_s, tools);
  report.cut_steps += std::max(cut, 1);
  return report;
}

double ExplicitIntegrator::longest_step_s(double step_s) const {
  const double stiffest = springs_.stiffest(u_);
  return std::min(step_s, stiffest > 1 ? kShare * leapfrog_step_s(w2_ * stiffest, g_) : step_s_);
}

void ExplicitIntegrator::take(const BodyState& state, const std::vector<ToolPort>& ports) {
  const LumpedBody& body = dynamics_->body();
  held_ = held_nodes(body, ports);
  inverse_mass_.assign(NodeArrays::padded(dynamics_->nodes()), 0.0F);
  for (std::uint32_t i = 0; i < dynamics_->nodes(); ++i) {
    inverse_mass_[i] = held_[i] ? 0.0F : static_cast<float>(1 / body.masses_kg[i]);
    u_.set(i, at_node(state.x, i) - body.nodes[i]);
    v_.set(i, at_node(state.v, i));
  }
  contacts_.assign(ports.size(), {});
  looked_for_s_.assign(ports.size(), state.time_s);
  const bool any_touch = std::any_of(ports.begin(), ports.end(), [](const ToolPort& p) { return p.kind == ContactKind::touch; });
  if (any_touch && !skin_->empty()) skin_->place(state.x, skin_positions_);
}

/// The velocity of a held node is that of its way over the last kHeldOverS: one reading of a device may jump.
void ExplicitIntegrator::give(BodyState& state, const std::vector<ToolPort>& ports, const ToolMotion& tools,
                              double until_s) const {
  const LumpedBody& body = dynamics_->body();
  const double over_s = std::min(kHeldOverS, until_s - state.time_s);
  for (std::uint32_t i = 0; i < dynamics_->nodes(); ++i) {
    if (body.fixed[i]) continue;
    at_node(state.x, i) = body.nodes[i] + u_.at(i);
    at_node(state.v, i) = v_.at(i);
  }
  for (std::size_t k = 0; k < ports.size(); ++k) {
    const std::uint32_t node = ports[k].node;
    if (ports[k].kind != ContactKind::attach || body.fixed[node]) continue;
    Vec3 to = tools(k, until_s).position, velocity = (to - tools(k, until_s - over_s).position) / over_s;
    if (body.planar) to.z() = body.nodes[node].z(), velocity.z() = 0;
    at_node(state.x, node) = to;
    at_node(state.v, node) = velocity;
  }
  state.time_s = until_s;
}

/// Of the springs, gravity, and the contact forces as they are. f_ is zero on entry and on return.
void ExplicitIntegrator::accelerate(const NodeArrays& velocity, const std::vector<ToolPort>& ports) {
  const LumpedBody& body = dynamics_->body();
  for (const auto* slabs : {&springs_.even_slabs(), &springs_.odd_slabs()})
    share(slabs->size(), [&](std::size_t k) { springs_.add_forces((*slabs)[k], u_, velocity, f_); });
  share(node_parts(), [&](std::size_t part) {
    const leapfrog::Nodes nodes = nodes_of(part);
    leapfrog::accelerate(nodes, inverse_mass_, f_.x, static_cast<float>(body.gravity_m_s2.x()), a_.x);
    leapfrog::accelerate(nodes, inverse_mass_, f_.y, static_cast<float>(body.gravity_m_s2.y()), a_.y);
    leapfrog::accelerate(nodes, body.planar ? nowhere_ : inverse_mass_, f_.z, static_cast<float>(body.gravity_m_s2.z()), a_.z);
  });
  for (std::size_t k = 0; k < ports.size(); ++k) {
    if (ports[k].kind != ContactKind::touch || !ports[k].touching) continue;
    refresh(contacts_[k], ports[k].point);
    push(contacts_[k], ports[k].lambda);
  }
}

/// v += over_s a.
void ExplicitIntegrator::kick(double over_s) {
  for (auto axis : {&NodeArrays::x, &NodeArrays::y, &NodeArrays::z})
    leapfrog::kick({0, v_.x.size()}, static_cast<float>(over_s), a_.*axis, v_.*axis);
}

/// a_ is that at the step's begin on entry, with the contact forces of before, and that at its end on return.
void ExplicitIntegrator::step(std::vector<ToolPort>& ports, double begin_s, double h, const ToolMotion& tools) {
  look(ports, begin_s, tools);
  close_contacts(ports, begin_s + h, h, tools);
  for (const ToolPort& p : ports) {
    if (p.kind != ContactKind::attach || dynamics_->body().fixed[p.node]) continue;
    const auto k = static_cast<std::size_t>(&p - ports.data());
    Vec3 to = tools(k, begin_s + h).position - dynamics_->body().nodes[p.node];
    if (dynamics_->body().planar) to.z() = 0;
    const Vec3 velocity = (to - u_.at(p.node)) / h;
    a_.set(p.node, (velocity - v_.at(p.node)) / h);
  }
  share(node_parts(), [&](std::size_t part) {
    for (auto axis : {&NodeArrays::x, &NodeArrays::y, &NodeArrays::z})
      leapfrog::kick_and_drift(nodes_of(part), static_cast<float>(h), a_.*axis, v_.*axis, u_.*axis, predicted_.*axis);
  });
  accelerate(predicted_, ports);
}

/// Ports answer one after the other, each seeing the newest forces of the others: those of before are in a_ on entry. Only those
/// that share nodes have anything to say to each other.
void ExplicitIntegrator::close_contacts(std::vector<ToolPort>& ports, double end_s, double h, const ToolMotion& tools) {
  closing_.clear();
  for (std::size_t k = 0; k < ports.size(); ++k) {
    ToolPort& port = ports[k];
    if (port.kind != ContactKind::touch || !port.touching) continue;
    Contact& contact = contacts_[k];
    refresh(contact, port.point);
    place(contact.around);
    contact.tool = tools(k, end_s).position;
    contact.normal = normal_at(skin_->view(), skin_positions_, port.point);
    contact.p_unpushed = contact.at_rest + moved(contact, u_) + h * moved(contact, v_);
    closing_.push_back(k);
  }
  constexpr int kSweeps = 4;
  const int sweeps = share_nodes(closing_) ? kSweeps : 1;
  for (int sweep = 0; sweep < sweeps; ++sweep)
    for (const std::size_t k : closing_) {
      ToolPort& port = ports[k];
      const Contact& contact = contacts_[k];
      push(contact, -port.lambda);
      const Vec3 p_free = contact.p_unpushed + h * h * moved(contact, a_);
      const ContactClosure closure =
          close_contact(p_free, h * h * contact.softness_1_kg * Mat3::Identity(), contact.normal, contact.tool, port.parameters);
      port.lambda = closure.lambda;
      if (is_lost(port, (contact.tool - p_free).norm(), spacing_m_)) port.lambda.setZero();
      push(contact, port.lambda);
      if (sweep + 1 < sweeps) continue;
      port.touching = port.lambda.squaredNorm() > 0;
      looked_for_s_[k] = end_s + kLookS;
      if (closure.slip.squaredNorm() > 0) port.point = slide(skin_->view(), skin_positions_, port.point, closure.slip);
    }
}

bool ExplicitIntegrator::share_nodes(const std::vector<std::size_t>& ports) const {
  for (std::size_t i = 0; i < ports.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      for (const auto& [one, w] : contacts_[ports[i]].b)
        for (const auto& [other, v] : contacts_[ports[j]].b)
          if (one == other) return true;
  return false;
}

void ExplicitIntegrator::look(std::vector<ToolPort>& ports, double at_s, const ToolMotion& tools) {
  constexpr double kFastestMS = 1;  // of tool and surface towards each other
  bool placed = false;
  for (std::size_t k = 0; k < ports.size(); ++k) {
    ToolPort& port = ports[k];
    if (port.kind != ContactKind::touch || port.touching || skin_->empty() || at_s < looked_for_s_[k]) continue;
    if (!placed) {
      Vector x(3 * static_cast<Eigen::Index>(dynamics_->nodes()));
      for (std::uint32_t i = 0; i < dynamics_->nodes(); ++i) at_node(x, i) = dynamics_->body().nodes[i] + u_.at(i);
      skin_->place(x, skin_positions_);
      placed = true;
    }
    const NearestPoint nearest = nearest_point(skin_->view(), skin_positions_, tools(k, at_s).position);
    port.point = nearest.point;
    port.lambda.setZero();
    port.touching = nearest.height_m < 0;
    looked_for_s_[k] = at_s + std::max(kLookS, nearest.height_m / kFastestMS);
  }
}

void ExplicitIntegrator::refresh(Contact& contact, const SurfacePoint& point) {
  if (contact.valid && contact.point.triangle == point.triangle && contact.point.weight == point.weight) return;
  if (!contact.valid || contact.point.triangle != point.triangle) contact.around = vertices_around(point.triangle);
  contact.valid = true;
  contact.point = point;
  contact.b = skin_->weights(point);
  contact.at_rest = position_at(skin_->view(), skin_->rest(), point);
  contact.softness_1_kg = 0;
  for (const auto& [node, weight] : contact.b)
    contact.softness_1_kg += weight * weight * static_cast<double>(inverse_mass_[node]);
}

/// The vertices that the normal at a point of the triangle depends on, and where it slides to next.
std::vector<std::uint32_t> ExplicitIntegrator::vertices_around(std::uint32_t triangle) const {
  const SurfaceView surface = skin_->view();
  std::vector<std::uint32_t> vertices;
  for (const std::uint32_t corner : surface.triangles[triangle])
    for (std::uint32_t e = surface.first[corner]; e < surface.first[corner + 1]; ++e)
      for (const std::uint32_t i : surface.triangles[surface.incident[e]]) vertices.push_back(i);
  std::sort(vertices.begin(), vertices.end());
  vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
  return vertices;
}

void ExplicitIntegrator::place(const std::vector<std::uint32_t>& vertices) {
  for (const std::uint32_t i : vertices) {
    Vec3 at = dynamics_->body().nodes[i];
    for (const auto& [j, weight] : skin_->vertex_weights(i)) at += weight * u_.at(j);
    Eigen::Map<Vec3>(skin_positions_.data() + 3 * std::size_t{i}) = at;
  }
}

void ExplicitIntegrator::push(const Contact& contact, const Vec3& lambda) {
  for (const auto& [node, weight] : contact.b)
    a_.set(node, a_.at(node) + weight * static_cast<double>(inverse_mass_[node]) * lambda);
}

/// B^T y.
Vec3 ExplicitIntegrator::moved(const Contact& contact, const NodeArrays& y) const {
  Vec3 sum = Vec3::Zero();
  for (const auto& [node, weight] : contact.b) sum += weight * y.at(node);
  return sum;
}

/// No node is far out or went further than an element in one step; not a number fails both.
bool ExplicitIntegrator::is_sound(double h) const {
  for (std::uint32_t i = 0; i < dynamics_->nodes(); ++i)
    if (!(u_.at(i).norm() <= kWorldExtentM && h * v_.at(i).norm() <= spacing_m_)) return false;
  return true;
}

}  // namespace palpate
