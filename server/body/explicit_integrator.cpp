#include "server/body/explicit_integrator.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>

namespace palpate {
namespace {

/// Returns the magnitude of the largest eigenvalue of one step on (x, h v, h^2 a).
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

ExplicitIntegrator::ExplicitIntegrator(const Dynamics& dynamics, const Skin& skin, const std::optional<Spectrum>& spectrum)
    : ExplicitStepper(dynamics, skin),
      spectrum_(spectrum ? *spectrum : spectrum_of(dynamics)),
      step_s_(kShare * leapfrog_step_s(spectrum_.w2, spectrum_.g)),
      a_(dynamics.nodes()),
      predicted_(dynamics.nodes()) {}

ExplicitStepper::Steps ExplicitIntegrator::steps_for(double whole_s, double step_s, const std::vector<ToolPort>&) {
  const auto [stiffer, thicker] = growth();
  const bool grown = stiffer > 1 || thicker > 1;
  const double share = grown && may_resonate() ? kResonantShare : kShare;
  const double h = std::min(step_s, grown ? share * leapfrog_step_s(spectrum_.w2 * stiffer, spectrum_.g * thicker) : step_s_);
  if (!(h >= kShortestShare * std::min(step_s, step_s_))) return {};
  const int count = static_cast<int>(std::ceil(whole_s / h - 1e-9));
  return {count, whole_s / count};
}

void ExplicitIntegrator::go(const Steps& steps, std::vector<ToolPort>& ports, double begin_s, const ToolMotion& tools) {
  before_.clear();
  for (const ToolPort& port : ports) before_.push_back(port.lambda);
  accelerate(body_.v, ports);
  if (body_.may_rest()) body_.let_rest(a_, busy_nodes(ports), steps.count * steps.h, std::array{&a_, &predicted_});
  kick(-steps.h / 2);
  for (int k = 0; k < steps.count; ++k) step(ports, begin_s + k * steps.h, steps.h, tools);
  kick(steps.h / 2);
}

/// Computes a_ from springs, gravity, and the present contact forces.
void ExplicitIntegrator::accelerate(const NodeArrays& velocity, const std::vector<ToolPort>& ports) {
  body_.add_forces(body_.u, velocity);
  body_.accelerate(a_);
  for (std::size_t k = 0; k < ports.size(); ++k)
    if (ports[k].kind == ContactKind::touch && ports[k].touching)
      push(contacts_.refreshed(body_, k, ports[k].point).b, ports[k].lambda);
}

/// v += over_s a.
void ExplicitIntegrator::kick(double over_s) {
  body_.on_each_axis(
      [&](auto axis, node_loops::Nodes nodes) { node_loops::kick(nodes, static_cast<float>(over_s), a_.*axis, body_.v.*axis); });
}

/// On entry a_ is the acceleration at the step's begin with the previous contact forces, on return that at its end.
void ExplicitIntegrator::step(std::vector<ToolPort>& ports, double begin_s, double h, const ToolMotion& tools) {
  contacts_.look(body_, ports, begin_s, tools);
  close_contacts(ports, begin_s + h, h, tools);
  for (std::size_t k = 0; k < ports.size(); ++k) {
    if (!body_.is_held(ports[k])) continue;
    const std::uint32_t node = ports[k].node;
    const Vec3 velocity = (body_.displacement(node, tools(k, begin_s + h).position) - body_.u.at(node)) / h;
    a_.set(node, (velocity - body_.v.at(node)) / h);
  }
  body_.on_each_axis([&](auto axis, node_loops::Nodes nodes) {
    node_loops::kick_and_drift(nodes, static_cast<float>(h), a_.*axis, body_.v.*axis, body_.u.*axis, predicted_.*axis);
  });
  accelerate(predicted_, ports);
  body_.wake_disturbed(a_, 1);
  watch(h);
}

/// Solves the contacts one after the other, each with the newest forces of the others; a_ includes lambda_n on entry. Only
/// contacts that share nodes interact.
void ExplicitIntegrator::close_contacts(std::vector<ToolPort>& ports, double end_s, double h, const ToolMotion& tools) {
  const std::vector<std::size_t>& touching = contacts_.meet(body_, ports, end_s, h, tools);
  for (const std::size_t k : touching) body_.wake(contacts_[k].b);
  constexpr int kSweeps = 4;
  const int sweeps = share_nodes(touching) ? kSweeps : 1;
  std::vector<double> shares;  // weights of lambda_(n+1)
  for (const std::size_t k : touching) {
    const Vec3 now = ports[k].lambda;
    const double stiffness = ports[k].parameters.contact_stiffness_n_m * h * h * contacts_[k].softness_1_kg;
    const double s = ports[k].parameters.contact_stiffness_n_m > 0 ? std::min(1.0, 1.0 / stiffness) : 0.0;
    shares.push_back(1 - 0.75 * s);
    if (now.squaredNorm() > 0) push(contacts_[k].b, s / 4 * (before_[k] - now));  // else the contact begins
    before_[k] = now;
  }
  for (int sweep = 0; sweep < sweeps; ++sweep)
    for (std::size_t i = 0; i < touching.size(); ++i) {
      const std::size_t k = touching[i];
      ToolPort& port = ports[k];
      const ExplicitContact& contact = contacts_[k];
      push(contact.b, -shares[i] * port.lambda);
      Vec3 p_free;
      ContactClosure closure;
      for (int slides = 0;; ++slides) {
        p_free = contact.at_rest + contact.gather(body_.u) + h * contact.gather(body_.v) + h * h * contact.gather(a_);
        closure = close_contact(p_free, shares[i] * h * h * contact.softness_1_kg * Mat3::Identity(), contact.normal,
                                contact.tool, port.parameters);
        if (slides == kSlidesMax || !contacts_.slide_on(body_, k, closure.slip, h, port)) break;
        body_.wake(contact.b);
      }
      port.lambda = closure.lambda;
      if (is_lost(port, (contact.tool - p_free).norm(), body_.spacing_m())) port.lambda.setZero();
      push(contact.b, shares[i] * port.lambda);
      if (sweep + 1 == sweeps) contacts_.finish(k, closure.slip, p_free, end_s, port);
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

void ExplicitIntegrator::push(const Skin::Weights& b, const Vec3& lambda) {
  for (const auto& [node, weight] : b) a_.set(node, a_.at(node) + weight * body_.inverse_mass(node) * lambda);
}

}  // namespace palpate
