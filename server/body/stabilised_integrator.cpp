#include "server/body/stabilised_integrator.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace palpate {
namespace {

constexpr double kProbeN = 0.1, kStabilisedNearSpacings = 0.3;
constexpr int kFewestStages = 2;

/// The longest step, up to `longest_s`, in which no mode grows; 0: none that would be worth it.
double reach_of(const Chebyshev& method, const Spectrum& spectrum, double longest_s) {
  constexpr double kReach = 0.7, kShorter = 0.95, kLeast = 0.1;
  const double s = static_cast<double>(method.stages.size());
  const double begin_s = std::min(longest_s, kReach * s * s / spectrum.g);
  for (double h = begin_s; h > kLeast * begin_s; h *= kShorter)
    if (method.is_stable(spectrum, h)) return h;
  return 0;
}

}  // namespace

StabilisedIntegrator::StabilisedIntegrator(const Dynamics& dynamics, const Skin& skin, const std::optional<Spectrum>& spectrum)
    : ExplicitStepper(dynamics, skin), spectrum_(spectrum ? *spectrum : spectrum_of(dynamics)) {
  for (int s = kFewestStages; s <= kMostStages; ++s) {
    methods_.emplace_back(s);
    reach_s_.push_back(kShare * reach_of(methods_.back(), spectrum_, kLongestS / kShare));
  }
  for (NodeArrays* y : {&u_, &v_, &a_, &a_0_, &du_, &dv_, &du_before_, &dv_before_}) *y = NodeArrays(dynamics.nodes());
}

StabilisedIntegrator::Plan StabilisedIntegrator::plan(double step_s, ContactKind tools) const {
  const bool finely = tools == ContactKind::touch || hexahedra().size() > 0;
  const double longest_s = std::min(step_s, finely ? kTouchS : kLongestS);
  Plan best;
  for (std::size_t i = 0; i < methods_.size(); ++i) {
    const Plan plan{static_cast<int>(methods_[i].stages.size()), std::min(longest_s, reach_s_[i])};
    if (plan.h > 0 && (best.stages == 0 || plan.stages / plan.h < best.stages / best.h)) best = plan;
  }
  return best;
}

ExplicitStepper::Steps StabilisedIntegrator::steps_for(double whole_s, double step_s, const std::vector<ToolPort>& ports) {
  const bool touch = std::any_of(ports.begin(), ports.end(), [](const ToolPort& p) { return p.kind == ContactKind::touch; });
  const double longest_s = plan(step_s, touch ? ContactKind::touch : ContactKind::attach).h;
  if (!(longest_s > 0)) return {};
  const auto [stiffer, thicker] = growth();
  Spectrum stretched = spectrum_;
  stretched.w2 *= stiffer;
  stretched.g *= thicker;
  stretched.least_s /= stiffer;
  stretched.most_s *= thicker;
  constexpr double kMore = 1.2, kRounding = 1e-6, kFewestSteps = 3;  // of touches: what bring_to_end() has to see
  for (double h = longest_s; h >= kShortestShare * longest_s; h /= kMore) {
    const double count = std::max(std::ceil(whole_s / h - kRounding), touch ? kFewestSteps : 1.0);
    const Steps steps{static_cast<int>(count), whole_s / count};
    const auto enough =
        std::find_if(reach_s_.begin(), reach_s_.end(), [&](double reach_s) { return (1 + kRounding) * reach_s >= steps.h; });
    method_ = &methods_[static_cast<std::size_t>(enough - reach_s_.begin())];
    if (stiffer <= 1 && thicker <= 1) return steps;
    const auto stages = static_cast<std::size_t>(std::ceil(std::sqrt(thicker) * static_cast<double>(method_->stages.size())));
    for (std::size_t k = stages - kFewestStages; k < methods_.size(); ++k) {
      method_ = &methods_[k];
      if (method_->is_stable(stretched, steps.h)) return steps;
    }
  }
  return {};
}

void StabilisedIntegrator::go(const Steps& steps, std::vector<ToolPort>& ports, double begin_s, const ToolMotion& tools) {
  for (NodeArrays* y : {&du_, &dv_, &du_before_, &dv_before_}) *y = NodeArrays(body_.body().nodes.size());
  responses_ = std::vector<Response>(ports.size());
  trends_.assign(ports.size(), {});
  if (body_.may_rest()) {
    const std::vector<std::uint32_t> busy = busy_nodes(ports);  // and their contacts as they are
    touching_.clear();
    for (std::size_t k = 0; k < ports.size(); ++k)
      if (ports[k].kind == ContactKind::touch && ports[k].touching) touching_.push_back(k);
    accelerate(body_.u, body_.v, ports, a_0_);
    u_ = body_.u;
    body_.let_rest(a_0_, busy, steps.count * steps.h, std::array{&a_0_, &a_, &v_});
  }
  for (int k = 0; k < steps.count; ++k) step(ports, begin_s + k * steps.h, steps.h, tools);
  for (const std::size_t k : touching_) bring_to_end(k, ports[k]);
}

/// lambda is a step's mean, half a step old at its end: half of what it last changed by is added, as far as friction bears it.
void StabilisedIntegrator::bring_to_end(std::size_t k, ToolPort& port) const {
  constexpr int kSeen = 3;  // the mean of the step in which a contact began is less than that of its force
  if (!port.touching || trends_[k].steps < kSeen) return;
  const Vec3 at_end = port.lambda + 0.5 * trends_[k].change;
  const ContactClosure closure =
      close_contact(-at_end, Mat3::Identity(), contacts_[k].normal, Vec3::Zero(), {0, port.parameters.friction});
  if (closure.touching) port.lambda = closure.lambda;
}

void StabilisedIntegrator::step(std::vector<ToolPort>& ports, double begin_s, double h, const ToolMotion& tools) {
  contacts_.look(body_, ports, begin_s, tools);
  touching_ = contacts_.meet(body_, ports, begin_s + h, 0, tools);
  for (const std::size_t k : touching_) body_.wake(contacts_[k].b);
  start_held(ports, begin_s + h, h, tools);
  respond(ports, begin_s, h, tools);
  std::swap(body_.u, u_);
  std::swap(body_.v, v_);
  close_contacts(ports, begin_s + h);
  body_.wake_disturbed(a_0_, static_cast<int>(method_->stages.size()));
  watch(h);
}

void StabilisedIntegrator::start_held(const std::vector<ToolPort>& ports, double end_s, double h, const ToolMotion& tools) {
  held_v_.assign(ports.size(), Vec3::Zero());
  for (std::size_t k = 0; k < ports.size(); ++k) {
    if (!body_.is_held(ports[k])) continue;
    const std::uint32_t node = ports[k].node;
    held_v_[k] = (body_.displacement(node, tools(k, end_s).position) - body_.u.at(node)) / h;
    body_.v.set(node, held_v_[k]);
  }
}

/// One step from body_.u and body_.v to u_ and v_, with every lambda as it is.
void StabilisedIntegrator::evolve(const std::vector<ToolPort>& ports, double begin_s, double h, const ToolMotion& tools) {
  for (std::size_t j = 0; j < method_->stages.size(); ++j) {
    const Chebyshev::Stage& stage = method_->stages[j];
    const NodeArrays& v = j == 0 ? body_.v : v_;
    NodeArrays& a = j == 0 ? a_0_ : a_;
    accelerate(j == 0 ? body_.u : u_, v, ports, a);
    // d_0 = 0 is not stored: where it would be read its factor is.
    const node_loops::Recurrence c{static_cast<float>(stage.mu), j > 1 ? static_cast<float>(stage.nu) : 0.0F,
                                   static_cast<float>(h * stage.mu_t), static_cast<float>(h * stage.gamma_t)};
    body_.on_each_axis([&](auto axis, node_loops::Nodes nodes) {
      node_loops::recur(nodes, c, v.*axis, body_.v.*axis, body_.u.*axis, du_.*axis, du_before_.*axis, u_.*axis);
      node_loops::recur(nodes, c, a.*axis, a_0_.*axis, body_.v.*axis, dv_.*axis, dv_before_.*axis, v_.*axis);
    });
    std::swap(du_, du_before_);
    std::swap(dv_, dv_before_);
    hold(ports, begin_s + stage.c * h, tools);
  }
}

void StabilisedIntegrator::accelerate(const NodeArrays& u, const NodeArrays& v, const std::vector<ToolPort>& ports,
                                      NodeArrays& a) {
  body_.add_forces(u, v);
  for (const std::size_t k : touching_)
    for (const auto& [node, weight] : contacts_[k].b) body_.f.set(node, body_.f.at(node) + weight * ports[k].lambda);
  body_.accelerate(a);
}

void StabilisedIntegrator::hold(const std::vector<ToolPort>& ports, double at_s, const ToolMotion& tools) {
  for (std::size_t k = 0; k < ports.size(); ++k) {
    if (!body_.is_held(ports[k])) continue;
    u_.set(ports[k].node, body_.displacement(ports[k].node, tools(k, at_s).position));
    v_.set(ports[k].node, held_v_[k]);
  }
}

/// The step, with the responses of those that have moved on.
void StabilisedIntegrator::respond(std::vector<ToolPort>& ports, double begin_s, double h, const ToolMotion& tools) {
  std::vector<std::size_t> stale;
  for (const std::size_t k : touching_) {
    const Response& r = responses_[k];
    if (!r.valid || (r.at_rest - contacts_[k].at_rest).norm() > kStabilisedNearSpacings * body_.spacing_m()) stale.push_back(k);
  }
  for (const std::size_t k : stale) {
    responses_[k].valid = true;
    responses_[k].at_rest = contacts_[k].at_rest;
    const Vec3 lambda = ports[k].lambda;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      ports[k].lambda = lambda + kProbeN * Vec3::Unit(static_cast<Eigen::Index>(axis));
      evolve(ports, begin_s, h, tools);
      responses_[k].u[axis] = du_;
      responses_[k].v[axis] = dv_;
    }
    ports[k].lambda = lambda;
  }
  evolve(ports, begin_s, h, tools);
  for (const std::size_t k : stale)
    for (std::size_t column = 0; column < 3; ++column)
      body_.on_each_axis([&](auto axis, node_loops::Nodes nodes) {
        node_loops::kick(nodes, -1, du_.*axis, responses_[k].u[column].*axis);
        node_loops::kick(nodes, -1, dv_.*axis, responses_[k].v[column].*axis);
      });
}

void StabilisedIntegrator::close_contacts(std::vector<ToolPort>& ports, double end_s) {
  if (touching_.empty()) return;
  std::vector<Vec3> before;
  for (const std::size_t k : touching_) {
    contacts_.look_again(body_, k, 0);
    before.push_back(ports[k].lambda);
  }
  std::vector<SweptContact> swept;
  for (int slides = 0;; ++slides) {
    couple();
    swept.clear();
    for (std::size_t i = 0; i < touching_.size(); ++i) {
      const ExplicitContact& contact = contacts_[touching_[i]];
      swept.push_back({touching_[i], contact.at_rest + contact.gather(body_.u), contact.normal, contact.tool});
      ports[touching_[i]].lambda = before[i];
    }
    sweep_contacts(coupling_, swept, ports);
    bool slid = false;
    if (slides < kSlidesMax)
      for (const SweptContact& contact : swept)
        slid |= contacts_.slide_on(body_, contact.port, contact.slip, 0, ports[contact.port]);
    if (!slid) break;
  }
  for (const SweptContact& contact : swept) {
    ToolPort& port = ports[contact.port];
    Vec3 change = contact.change;
    if (is_lost(port, (contact.tool - contact.end).norm(), body_.spacing_m())) {
      change -= port.lambda;
      port.lambda.setZero();
    }
    move_on(responses_[contact.port], change);
    trends_[contact.port] = {trends_[contact.port].steps + 1, change};
    contacts_.finish(contact.port, contact.slip, contact.end, end_s, port);
    if (!port.touching) trends_[contact.port] = {};
  }
}

void StabilisedIntegrator::couple() {
  coupling_.assign(touching_.size(), std::vector<Mat3>(touching_.size()));
  for (std::size_t j = 0; j < touching_.size(); ++j) {
    for (std::size_t k = 0; k < touching_.size(); ++k)
      for (std::size_t axis = 0; axis < 3; ++axis)
        coupling_[j][k].col(static_cast<Eigen::Index>(axis)) =
            contacts_[touching_[j]].gather(responses_[touching_[k]].u[axis]) / kProbeN;
    coupling_[j][j] = 0.5 * (coupling_[j][j] + coupling_[j][j].transpose()).eval();
  }
}

void StabilisedIntegrator::move_on(const Response& response, const Vec3& change) {
  for (std::size_t column = 0; column < 3; ++column) {
    const auto by = static_cast<float>(change[static_cast<Eigen::Index>(column)] / kProbeN);
    body_.on_each_axis([&](auto axis, node_loops::Nodes nodes) {
      node_loops::kick(nodes, by, response.u[column].*axis, body_.u.*axis);
      node_loops::kick(nodes, by, response.v[column].*axis, body_.v.*axis);
    });
  }
}

}  // namespace palpate
