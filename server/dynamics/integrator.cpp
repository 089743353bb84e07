#include "server/dynamics/integrator.hpp"

#include <algorithm>
#include <cmath>

#include "common/base/limits.hpp"
#include "server/dynamics/needle_ports.hpp"

namespace palpate {
namespace {

bool is_alone(const std::vector<ToolPort>& ports) {
  return std::none_of(ports.begin(), ports.end(), [](const ToolPort& p) { return p.kind == ContactKind::attach || p.touching; });
}

/// Of a tool with a body it counts whether it touches at all: its spheres come and go with every turn.
bool same_contacts(const std::vector<ToolPort>& before, const std::vector<ToolPort>& after) {
  const auto touches = [](const std::vector<ToolPort>& ports, std::uint32_t tool) {
    return std::ranges::any_of(ports, [&](const ToolPort& port) { return port.tool == tool && port.touching; });
  };
  return std::equal(after.begin(), after.end(), before.begin(), [&](const ToolPort& p, const ToolPort& q) {
    const NeedleTip &a = p.needle.tip, &b = q.needle.tip;
    if (p.needle.part == NeedlePart::shaft) return true;
    const bool same = p.body ? touches(after, p.tool) == touches(before, p.tool) : p.touching == q.touching;
    return same && a.inside == b.inside && a.layer == b.layer;
  });
}

bool touches(const std::vector<ToolPort>& ports) {
  return std::any_of(ports.begin(), ports.end(), [](const ToolPort& p) { return p.in_contact(); });
}

/// Conjugate gradients where it does not pay to factorise.
IntegratorOptions with_solver(const Dynamics& dynamics, IntegratorOptions options) {
  if (options.solver == LinearSolver::Method::automatic && !LinearSolver::factorises(dynamics.nodes(), dynamics.body().planar))
    options.solver = LinearSolver::Method::conjugate_gradients;
  return options;
}

/// Springs that stiffen without bound can throw a body so far that rounding passes for convergence.
bool is_sound(const BodyState& state) {
  return state.x.allFinite() && state.v.allFinite() && state.x.cwiseAbs().maxCoeff() <= kWorldExtentM;
}

}  // namespace

Integrator::Integrator(const Dynamics& dynamics, const Skin& skin, const IntegratorOptions& options)
    : dynamics_(&dynamics), skin_(&skin), options_(with_solver(dynamics, options)), solver_(dynamics.nodes(), options_.solver) {
  spacing_m_ = mean_edge_m(dynamics.body());
}

AdvanceReport Integrator::advance(BodyState& state, std::vector<ToolPort>& ports, double until_s, double step_s,
                                  const ToolMotion& tools) {
  AdvanceReport report;
  held_ = held_nodes(dynamics_->body(), ports);
  if (held_ != matrix_held_) {
    matrix_a_ = 0;
    trend_.resize(0);
  }
  responses_.resize(ports.size());
  const double shortest_s = std::max(kMinStepS, step_s / kMostCut);
  // A frame that is late has longer steps, each of which takes more iterations: its bounds are those of the steps it would have
  // on time. What is left of a frame is then one damped step: a frame has to end.
  const double steps_uncut = std::max(kFewestSteps, std::ceil((until_s - state.time_s) / std::min(step_s, options_.step_s)));
  const double bound = kNewtonAStep * steps_uncut;
  double h_try = step_s;
  std::optional<double> most_j;  // what a body has that is left alone
  while (until_s - state.time_s > 1e-9) {
    const bool touched = touches(ports);
    const bool too_dear = touched && (report.touched_iterations > most_touched_ || report.newton_iterations > bound);
    if (too_dear || report.newton_iterations > options_.most_iterations) {
      report.converged = false;
      return report;
    }
    const double left = until_s - state.time_s;
    const BodyState before = state;
    if (report.newton_iterations > bound && !touched) {
      if (!damped_step(state, ports, left, tools, report)) {
        state = before;
        report.converged = false;
        return report;
      }
      dynamics_->relaxation().relax(left, state);
      dynamics_->follow(state);
      find_holding_forces(*dynamics_, state, ports);
      ++report.steps;
      return report;
    }
    const double h = left / std::ceil(left / h_try - 1e-9);
    const std::vector<ToolPort> ports_before = ports;
    const Relaxation& relaxation = dynamics_->relaxation();
    relaxation.relax(h / 2, state);
    if (!is_alone(ports) || !relaxation.empty() || state.traction) most_j.reset();
    if (is_alone(ports) && !most_j) most_j = dynamics_->energy(state);
    touched_ = false;
    const int iterations_before = report.newton_iterations;
    StepEnd end = step(state, ports, h, tools, report);
    if (end == StepEnd::done && most_j && !touched_ && gains_energy(before, state, *most_j)) end = StepEnd::failed;
    if (touched || touched_) report.touched_iterations += report.newton_iterations - iterations_before;
    if (end == StepEnd::done) {
      relaxation.relax(h / 2, state);
      dynamics_->follow(state);
      find_holding_forces(*dynamics_, state, ports);
      ++report.steps;
      h_try = std::min(step_s, 2 * h_try);
      if (touched_) most_j.reset();
      continue;
    }
    state = before;
    ports = ports_before;
    trend_.resize(0);
    const bool failed = end == StepEnd::failed;
    if (failed) std::fill(responses_.begin(), responses_.end(), PortResponse{});  // they may be of a shape that flew apart
    h_try = failed ? h / 2 : options_.event_step_s;
    if (failed) matrix_a_ = 0;
    ++report.cut_steps;
    if (h_try >= shortest_s) continue;
    if (touched_ || touches(ports) || !damped_step(state, ports, h, tools, report)) {
      state = before;
      report.converged = false;
      return report;
    }
    relaxation.relax(h, state);
    dynamics_->follow(state);
    ++report.steps;
    h_try = h;
    most_j.reset();
  }
  return report;
}

bool Integrator::gains_energy(const BodyState& before, const BodyState& after, double most_j) const {
  constexpr double kGain = 2e-5;         // of the energy that is in motion: what the order of the method leaves
  constexpr double kMovesNothing = 1e3;  // tolerances: a body that hardly moves has only their noise
  if ((after.x - before.x).cwiseAbs().maxCoeff() < kMovesNothing * options_.tolerance_m) return false;
  const auto kinetic = [&](const BodyState& s) { return 0.5 * s.v.dot(dynamics_->masses().cwiseProduct(s.v)); };
  const double energy_j = dynamics_->energy(after), kinetic_j = kinetic(after);
  const double in_motion_j = std::max(kinetic(before), kinetic_j + std::abs(energy_j - kinetic_j));
  return !(energy_j <= most_j + kGain * in_motion_j);
}

/// The trapezoid asks for an opposite force at its end. Where the force is far from balance for so long a stage, the shape that
/// has it may lie beyond a fold: the body would be thrown over instead of coming back.
bool Integrator::throws_over(const Vector& forces, double a) const {
  for (std::uint32_t i = 0; i < dynamics_->nodes(); ++i)
    if (!held_[i] && a * a * at_node(forces, i).norm() > dynamics_->body().masses_kg[i] * spacing_m_) return true;
  return false;
}

bool Integrator::damped_step(BodyState& state, std::vector<ToolPort>& ports, double h, const ToolMotion& tools,
                             AdvanceReport& report) {
  Stage stage;
  stage.a = h;
  stage.end_s = state.time_s + h;
  stage.x_hat = state.x;
  stage.v_hat = state.v;
  stage.iterations_max = kNewtonMost;
  std::vector<Vec3> points(ports.size());
  for (std::size_t k = 0; k < ports.size(); ++k) points[k] = tools(k, stage.end_s).position;
  state.v.setZero();
  hold_nodes(stage, ports, points, state);
  hold_threads(ports, points, state);
  newton(stage, points, state, ports, report);
  pull_hands(state, ports);
  matrix_a_ = 0;
  state.time_s = stage.end_s;
  return is_sound(state);
}

void Integrator::total_forces(const BodyState& state, const std::vector<ToolPort>& ports, Vector& f) const {
  dynamics_->forces(state, f);
  for (const ToolPort& p : ports) {
    if (!p.in_contact()) continue;
    scatter(weights_of(*skin_, p), p.lambda, f);
  }
}

/// Puts the ends of threads where the hands are.
void Integrator::hold_threads(const std::vector<ToolPort>& ports, const std::vector<Vec3>& tool_points, BodyState& state) const {
  for (std::size_t k = 0; k < ports.size(); ++k)
    if (ports[k].suture) dynamics_->sutures().hold(state, *ports[k].suture, tool_points[k]);
}

/// Sets what the threads that hands hold pull with.
void Integrator::pull_hands(const BodyState& state, std::vector<ToolPort>& ports) const {
  for (ToolPort& port : ports) {
    if (!port.suture) continue;
    port.lambda = dynamics_->sutures().pull_to_hand(state, *port.suture);
    if (const auto bite = last_bite(state, *port.suture)) port.bite = bite;
  }
}

void Integrator::start_held(const std::vector<ToolPort>& ports, const ToolMotion& tools, double end_s, BodyState& state) const {
  for (std::size_t k = 0; k < ports.size(); ++k) {
    if (ports[k].kind != ContactKind::attach || dynamics_->body().fixed[ports[k].node]) continue;
    const Vec3 way = tools(k, end_s).position - at_node(state.x, ports[k].node);
    at_node(state.v, ports[k].node) = way / (end_s - state.time_s);
    if (dynamics_->body().planar) state.v[3 * ports[k].node + 2] = 0;
  }
}

void Integrator::hold_nodes(const Stage& stage, const std::vector<ToolPort>& ports, const std::vector<Vec3>& tool_points,
                            BodyState& state) const {
  for (std::uint32_t i = 0; i < dynamics_->nodes(); ++i) {
    if (!dynamics_->body().fixed[i]) continue;
    at_node(state.x, i) = dynamics_->body().nodes[i];
    at_node(state.v, i).setZero();
  }
  for (std::size_t k = 0; k < ports.size(); ++k) {
    if (ports[k].kind != ContactKind::attach || dynamics_->body().fixed[ports[k].node]) continue;
    at_node(state.x, ports[k].node) = tool_points[k];
    at_node(state.v, ports[k].node) = (tool_points[k] - at_node(stage.x_hat, ports[k].node)) / stage.a;
    if (!dynamics_->body().planar) continue;
    state.x[3 * ports[k].node + 2] = dynamics_->body().nodes[ports[k].node].z();
    state.v[3 * ports[k].node + 2] = 0;
  }
}

Integrator::StepEnd Integrator::step(BodyState& state, std::vector<ToolPort>& ports, double h, const ToolMotion& tools,
                                     AdvanceReport& report) {
  static const double gamma = 2 - std::sqrt(2.0);
  static const double c1 = 1 / (gamma * (2 - gamma)), c0 = (1 - gamma) * (1 - gamma) / (gamma * (2 - gamma));
  const double t0 = state.time_s;
  const double a = 0.5 * gamma * h;
  start_held(ports, tools, t0 + gamma * h, state);
  const Vector x0 = state.x, v0 = state.v;

  const std::vector<ToolPort> ports_before = ports;
  const bool ends_at_events = h > 1.01 * options_.event_step_s;
  const auto run = [&](Stage& stage) {
    std::vector<Vec3> points(ports.size());
    for (std::size_t k = 0; k < ports.size(); ++k) {
      const ToolAt tool = tools(k, stage.end_s);
      points[k] = tool.position;
      ports[k].needle.axis = tool.axis;
      ports[k].needle.edge = tool.edge;
    }
    hold_nodes(stage, ports, points, state);
    hold_threads(ports, points, state);
    if (!newton(stage, points, state, ports, report)) return StepEnd::failed;
    // A tool that ended up inside the surface touched it during this stage: solve again, now with the contact.
    const bool begins = begin_contacts(points, state, ports);
    touched_ |= begins;
    if (ends_at_events && !same_contacts(ports_before, ports)) return StepEnd::contact_event;
    return !begins || newton(stage, points, state, ports, report) ? StepEnd::done : StepEnd::failed;
  };

  total_forces(state, ports, f_);
  const bool pulled = std::ranges::any_of(ports, [](const ToolPort& p) { return p.suture.has_value(); });
  if (!pulled && throws_over(f_, a) && !touches(ports)) {
    trend_.resize(0);
    ++report.cut_steps;
    return damped_step(state, ports, h, tools, report) ? StepEnd::done : StepEnd::failed;
  }
  // Newton starts from velocities that go on changing as they did; what is wrong with that it takes back.
  if (trend_.size() == state.v.size()) state.v += gamma * h * trend_;
  Stage stage;
  stage.a = a;
  stage.end_s = t0 + gamma * h;
  stage.x_hat = x0 + a * v0;
  stage.v_hat = v0 + a * f_.cwiseQuotient(dynamics_->masses());
  if (const StepEnd end = run(stage); end != StepEnd::done) return end;
  const Vector v1 = state.v;
  stage.x_hat = c1 * state.x - c0 * x0;
  stage.v_hat = c1 * v1 - c0 * v0;
  stage.end_s = t0 + h;
  state.v += (1 - gamma) / gamma * (v1 - v0);
  if (const StepEnd end = run(stage); end != StepEnd::done) return end;
  trend_ = (state.v - v1) / ((1 - gamma) * h);
  pull_hands(state, ports);

  state.time_s = t0 + h;
  return is_sound(state) ? StepEnd::done : StepEnd::failed;
}

}  // namespace palpate
