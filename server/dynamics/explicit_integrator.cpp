#include "server/dynamics/explicit_integrator.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "server/dynamics/contact_sweeps.hpp"

namespace palpate {
namespace {

constexpr double kProbeN = 0.1, kResponseNearSpacings = 0.3;
constexpr double kShortestShare = 0.2;  // of the step at rest: below that TR-BDF2 is cheaper
constexpr double kWatchedEveryS = 0.004;

bool any_touch(const std::vector<ToolPort>& ports) {
  return std::any_of(ports.begin(), ports.end(), [](const ToolPort& p) { return p.kind == ContactKind::touch; });
}

}  // namespace

ExplicitIntegrator::ExplicitIntegrator(const Dynamics& dynamics, const Skin& skin, Stages stages, ExplicitLimits limits)
    : dynamics_(&dynamics), body_(dynamics), contacts_(skin), limits_(std::move(limits)), fallback_(dynamics, skin, {}) {
  for (int s = ExplicitLimits::kFewestStages; stages == Stages::more && s <= ExplicitLimits::kMostStages; ++s)
    methods_.emplace_back(s);
  for (NodeArrays* y : {&u_, &v_, &a_, &a_0_}) *y = NodeArrays(dynamics.nodes());
}

bool ExplicitIntegrator::may_resonate() const {
  constexpr double kHardlyDamped = 0.1;  // w t / 2 of the fastest modes
  return hexahedra().size() > 0 && limits_.spectrum.least_s < kHardlyDamped * limits_.leapfrog_s;
}

ExplicitIntegrator::Plan ExplicitIntegrator::plan(double step_s, ContactKind tools) const {
  if (is_leapfrog()) return {1, std::min(step_s, limits_.leapfrog_s)};
  const bool finely = tools == ContactKind::touch || hexahedra().size() > 0;
  const double longest_s = std::min(step_s, finely ? kTouchS : ExplicitLimits::kLongestS);
  Plan best;
  for (std::size_t i = 0; i < methods_.size(); ++i) {
    const Plan plan{static_cast<int>(methods_[i].stages.size()), std::min(longest_s, limits_.chebyshev_s[i])};
    if (plan.h > 0 && (best.stages == 0 || plan.stages / plan.h < best.stages / best.h)) best = plan;
  }
  return best;
}

int ExplicitIntegrator::steps_for(double whole_s, double step_s, const std::vector<ToolPort>& ports) {
  constexpr double kRounding = 1e-6;
  const auto [stiffer, thicker] = expected_;
  const bool grown = stiffer > 1 || thicker > 1;
  const bool touch = any_touch(ports);
  const double longest_s = plan(step_s, touch ? ContactKind::touch : ContactKind::attach).h;
  if (!(longest_s > 0)) return 0;
  if (is_leapfrog()) {
    const double share = may_resonate() ? kResonantShare : ExplicitLimits::kShare;
    const double stable_s =
        grown ? share * leapfrog_step_s(limits_.spectrum.w2 * stiffer, limits_.spectrum.g * thicker) : limits_.leapfrog_s;
    const double h = std::min(longest_s, stable_s);
    return h >= kShortestShare * longest_s ? static_cast<int>(std::ceil(whole_s / h - kRounding)) : 0;
  }
  Spectrum stretched = limits_.spectrum;
  stretched.w2 *= stiffer;
  stretched.g *= thicker;
  stretched.least_s /= stiffer;
  stretched.most_s *= thicker;
  constexpr double kMore = 1.2, kFewestSteps = 3;  // of touches: what bring_to_end() has to see
  for (double h = longest_s; h >= kShortestShare * longest_s; h /= kMore) {
    const double count = std::max(std::ceil(whole_s / h - kRounding), touch ? kFewestSteps : 1.0);
    const auto enough = std::find_if(limits_.chebyshev_s.begin(), limits_.chebyshev_s.end(),
                                     [&](double reach_s) { return (1 + kRounding) * reach_s >= whole_s / count; });
    method_ = &methods_[static_cast<std::size_t>(enough - limits_.chebyshev_s.begin())];
    if (!grown) return static_cast<int>(count);
    const auto stages = static_cast<std::size_t>(std::ceil(std::sqrt(thicker) * static_cast<double>(method_->stages.size())));
    for (std::size_t k = stages - ExplicitLimits::kFewestStages; k < methods_.size(); ++k) {
      method_ = &methods_[k];
      if (method_->is_stable(stretched, whole_s / count)) return static_cast<int>(count);
    }
  }
  return 0;
}

AdvanceReport ExplicitIntegrator::advance(BodyState& state, std::vector<ToolPort>& ports, double until_s, double step_s,
                                          const ToolMotion& tools) {
  constexpr int kTries = 3;
  const double begin_s = state.time_s, whole_s = until_s - begin_s;
  if (!(whole_s > 1e-9)) return {};
  const std::vector<ToolPort> ports_before = ports;
  expected_ = {};
  int spent = 0;
  for (int tries = 0; tries < kTries; ++tries) {
    body_.take(state, ports);
    contacts_.take(state, ports);
    const Growth now = body_.growth();
    expected_ = most_ = {std::max(expected_.stiffness, now.stiffness), std::max(expected_.damping, now.damping)};
    const int steps = steps_for(whole_s, step_s, ports);
    if (steps == 0) break;
    go(steps, whole_s / steps, ports, begin_s, tools);
    spent += steps;
    const bool sound = body_.is_sound(whole_s / steps);
    if (sound && !outgrown()) {
      body_.give(state, ports, tools, until_s);
      find_holding_forces(*dynamics_, state, ports);
      return {.steps = steps, .needed_share = body_.needed_share()};
    }
    ports = ports_before;
    if (body_.hexahedra().size() == 0) break;
    constexpr double kMuch = 2;
    expected_ = sound ? most_ : Growth{kMuch * expected_.stiffness, kMuch * expected_.damping};
  }
  AdvanceReport report = fallback_.advance(state, ports, until_s, step_s, tools);
  report.cut_steps += std::max(spent, 1);
  return report;
}

/// Returns true if the body stiffened so much that the steps chosen at the begin may have been too long.
bool ExplicitIntegrator::outgrown() {
  // Limits for a single cell. Steps stay stable if all of a body stiffens by 1.23 and its damping grows by 1.11 (kShare), and the
  // modes of one cell are slower; solids pressed, torn and released at random stay sound.
  constexpr double kStiffer = 1.4, kThicker = 1.25;
  watch(kWatchedEveryS);
  return most_.stiffness > kStiffer * expected_.stiffness || most_.damping > kThicker * expected_.damping;
}

/// Must be called at the end of each step of `h` [s].
void ExplicitIntegrator::watch(double h) {
  unwatched_s_ += h;
  if (body_.hexahedra().size() == 0 || unwatched_s_ < kWatchedEveryS) return;
  unwatched_s_ = 0;
  const Growth now = body_.growth();
  most_ = {std::max(most_.stiffness, now.stiffness), std::max(most_.damping, now.damping)};
}

/// Prepares contacts as they are, and lets blocks rest; a_0_ becomes the acceleration at the begin of the frame.
void ExplicitIntegrator::begin_frame(double whole_s, std::vector<ToolPort>& ports) {
  unwatched_s_ = 0;
  responses_ = std::vector<Response>(ports.size());
  touching_.clear();
  std::vector<std::uint32_t> busy;  // nodes that ports push or hold
  for (std::size_t k = 0; k < ports.size(); ++k) {
    responses_[k].before = ports[k].lambda;
    if (ports[k].kind == ContactKind::attach) busy.push_back(ports[k].node);
    if (ports[k].kind != ContactKind::touch || !ports[k].touching) continue;
    touching_.push_back(k);
    for (const auto& [node, weight] : contacts_.refreshed(k, ports[k].point).b) busy.push_back(node);
  }
  if (!is_leapfrog() && !body_.may_rest()) return;
  accelerate(body_.u, body_.v, ports, a_0_);
  u_ = body_.u;
  if (body_.may_rest()) body_.let_rest(a_0_, busy, whole_s, std::array{&a_0_, &a_, &v_});
}

void ExplicitIntegrator::go(int steps, double h, std::vector<ToolPort>& ports, double begin_s, const ToolMotion& tools) {
  begin_frame(steps * h, ports);
  if (is_leapfrog())
    kick(-h / 2, a_0_, body_.v);
  else
    for (NodeArrays* y : {&du_, &dv_, &du_before_, &dv_before_}) *y = NodeArrays(dynamics_->nodes());
  for (int k = 0; k < steps; ++k) step(ports, begin_s + k * h, h, tools);
  if (is_leapfrog())
    kick(h / 2, a_0_, body_.v);
  else
    for (const std::size_t k : touching_) bring_to_end(k, ports[k]);
}

/// Of leapfrog a_0_ is on entry the acceleration at the step's begin with the previous contact forces, on return that at its end.
void ExplicitIntegrator::step(std::vector<ToolPort>& ports, double begin_s, double h, const ToolMotion& tools) {
  contacts_.look(body_, ports, begin_s, tools);
  touching_ = contacts_.meet(ports, begin_s + h, tools);
  for (const std::size_t k : touching_) body_.wake(contacts_[k].b);
  start_held(ports, begin_s + h, h, tools);
  if (is_leapfrog()) {
    leap(ports, h);
  } else {
    respond(ports, begin_s, h, tools);
    std::swap(body_.u, u_);
    std::swap(body_.v, v_);
  }
  close_contacts(ports, begin_s + h, h);
  body_.follow_contacts();
  if (is_leapfrog()) accelerate(body_.u, v_, ports, a_0_);
  body_.wake_disturbed(a_0_, is_leapfrog() ? 1 : static_cast<int>(method_->stages.size()));
  watch(h);
}

void ExplicitIntegrator::accelerate(const NodeArrays& u, const NodeArrays& v, const std::vector<ToolPort>& ports, NodeArrays& a) {
  body_.add_forces(u, v);
  for (const std::size_t k : touching_)
    for (const auto& [node, weight] : contacts_[k].b) body_.f.set(node, body_.f.at(node) + weight * ports[k].lambda);
  body_.accelerate(a);
}

void ExplicitIntegrator::start_held(const std::vector<ToolPort>& ports, double end_s, double h, const ToolMotion& tools) {
  held_v_.assign(ports.size(), Vec3::Zero());
  for (std::size_t k = 0; k < ports.size(); ++k) {
    if (!body_.is_held(ports[k])) continue;
    const std::uint32_t node = ports[k].node;
    held_v_[k] = (body_.displacement(node, tools(k, end_s).position) - body_.u.at(node)) / h;
    if (is_leapfrog())
      a_0_.set(node, (held_v_[k] - body_.v.at(node)) / h);
    else
      body_.v.set(node, held_v_[k]);
  }
}

/// One step of leapfrog, with lambda_n for lambda_(n+1).
void ExplicitIntegrator::leap(const std::vector<ToolPort>& ports, double h) {
  for (const std::size_t k : touching_) {
    const Vec3 now = ports[k].lambda;
    const double stiffness = ports[k].parameters.contact_stiffness_n_m * h * h * contacts_[k].softness_1_kg(contacts_[k], body_);
    const double c = ports[k].parameters.contact_stiffness_n_m > 0 ? std::min(1.0, 1.0 / stiffness) : 0.0;
    responses_[k].share = 1 - 0.75 * c;
    if (now.squaredNorm() > 0) push(k, c / 4 * (responses_[k].before - now), a_0_);  // else the contact begins
    responses_[k].before = now;
  }
  body_.on_each_axis([&](auto axis, node_loops::Nodes nodes) {
    node_loops::kick_and_drift(nodes, static_cast<float>(h), a_0_.*axis, body_.v.*axis, body_.u.*axis, v_.*axis);
  });
}

/// One step from body_.u and body_.v to u_ and v_, with every lambda as it is.
void ExplicitIntegrator::evolve(const std::vector<ToolPort>& ports, double begin_s, double h, const ToolMotion& tools) {
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

void ExplicitIntegrator::hold(const std::vector<ToolPort>& ports, double at_s, const ToolMotion& tools) {
  for (std::size_t k = 0; k < ports.size(); ++k) {
    if (!body_.is_held(ports[k])) continue;
    u_.set(ports[k].node, body_.displacement(ports[k].node, tools(k, at_s).position));
    v_.set(ports[k].node, held_v_[k]);
  }
}

/// The step, with the responses of those that have moved on.
void ExplicitIntegrator::respond(std::vector<ToolPort>& ports, double begin_s, double h, const ToolMotion& tools) {
  std::vector<std::size_t> stale;
  for (const std::size_t k : touching_) {
    const Response& r = responses_[k];
    if (!r.valid || (r.at_rest - contacts_[k].at_rest).norm() > kResponseNearSpacings * body_.spacing_m()) stale.push_back(k);
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
    for (std::size_t column = 0; column < 3; ++column) {
      kick(-1, du_, responses_[k].u[column]);
      kick(-1, dv_, responses_[k].v[column]);
    }
}

void ExplicitIntegrator::close_contacts(std::vector<ToolPort>& ports, double end_s, double h) {
  if (touching_.empty()) return;
  std::vector<Vec3> before;
  for (const std::size_t k : touching_) {
    contacts_.look_again(body_, k);
    before.push_back(ports[k].lambda);
  }
  std::vector<SweptContact> swept;
  for (int slides = 0;; ++slides) {
    couple(h);
    swept.clear();
    for (std::size_t i = 0; i < touching_.size(); ++i) {
      const ExplicitContact& contact = contacts_[touching_[i]];
      swept.push_back({touching_[i], contact.at_rest + contact.gather(body_.u), contact.normal,
                       ports[touching_[i]].lowest(contact.tool, contact.normal)});
      ports[touching_[i]].lambda = before[i];
    }
    sweep_contacts(coupling_, swept, ports);
    bool slid = false;
    if (slides < kSlidesMax)
      for (const SweptContact& contact : swept)
        slid |= contacts_.slide_on(body_, contact.port, contact.slip, ports[contact.port]);
    if (!slid) break;
  }
  for (const SweptContact& contact : swept) {
    ToolPort& port = ports[contact.port];
    Response& response = responses_[contact.port];
    Vec3 change = contact.change;
    if (is_lost(port, (contact.tool - contact.end).norm(), body_.spacing_m())) {
      change -= port.lambda;
      port.lambda.setZero();
    }
    move_on(contact.port, change, h);
    ++response.steps;
    response.change = change;
    contacts_.finish(contact.port, contact.slip, contact.end, end_s, port);
    if (!port.touching) response.steps = 0;
  }
}

/// W_jk, for j = k its symmetric part.
void ExplicitIntegrator::couple(double h) {
  coupling_.assign(touching_.size(), std::vector<Mat3>(touching_.size()));
  for (std::size_t j = 0; j < touching_.size(); ++j) {
    const ExplicitContact& at = contacts_[touching_[j]];
    for (std::size_t k = 0; k < touching_.size(); ++k) {
      const Response& response = responses_[touching_[k]];
      Mat3& w = coupling_[j][k];
      if (is_leapfrog()) {
        w = response.share * h * h * at.softness_1_kg(contacts_[touching_[k]], body_) * Mat3::Identity();
        continue;
      }
      for (std::size_t axis = 0; axis < 3; ++axis) w.col(static_cast<Eigen::Index>(axis)) = at.gather(response.u[axis]) / kProbeN;
    }
    coupling_[j][j] = 0.5 * (coupling_[j][j] + coupling_[j][j].transpose()).eval();
  }
}

/// What the change of a lambda changes at the step's end.
void ExplicitIntegrator::move_on(std::size_t k, const Vec3& change, double h) {
  const Response& response = responses_[k];
  if (is_leapfrog()) {
    body_.wake(contacts_[k].b);
    push(k, response.share * h * h * change, body_.u);
    push(k, response.share * h * change, body_.v);
    push(k, response.share * 1.5 * h * change, v_);
    return;
  }
  for (std::size_t column = 0; column < 3; ++column) {
    const double by = change[static_cast<Eigen::Index>(column)] / kProbeN;
    kick(by, response.u[column], body_.u);
    kick(by, response.v[column], body_.v);
  }
}

/// y += M^-1 B lambda
void ExplicitIntegrator::push(std::size_t k, const Vec3& lambda, NodeArrays& y) const {
  for (const auto& [node, weight] : contacts_[k].b) y.set(node, y.at(node) + weight * body_.inverse_mass(node) * lambda);
}

/// v += by a
void ExplicitIntegrator::kick(double by, const NodeArrays& a, NodeArrays& v) const {
  body_.on_each_axis(
      [&](auto axis, node_loops::Nodes nodes) { node_loops::kick(nodes, static_cast<float>(by), a.*axis, v.*axis); });
}

/// lambda is a step's mean, half a step old at its end: half of what it last changed by is added, as far as friction bears it.
void ExplicitIntegrator::bring_to_end(std::size_t k, ToolPort& port) const {
  constexpr int kSeen = 3;  // the mean of the step in which a contact began is less than that of its force
  if (!port.touching || responses_[k].steps < kSeen) return;
  const Vec3 at_end = port.lambda + 0.5 * responses_[k].change;
  const ContactClosure closure =
      close_contact(-at_end, Mat3::Identity(), contacts_[k].normal, Vec3::Zero(), {0, port.parameters.friction});
  if (closure.touching) port.lambda = closure.lambda;
}

}  // namespace palpate
