#include "server/body/integrator.hpp"

#include <algorithm>
#include <cmath>

#include "common/base/limits.hpp"

namespace palpate {
namespace {

constexpr int kNewtonMax = 30;
constexpr double kSolveTolerance = 1e-2;     // of one inexact Newton step
constexpr double kResponseTolerance = 1e-2;  // of A^-1 B
constexpr double kSlidFar = 0.1;             // of the weights of a point: A^-1 B is solved for anew

auto node_at(Vector& v, std::uint32_t i) { return v.segment<3>(3 * static_cast<Eigen::Index>(i)); }
auto node_at(const Vector& v, std::uint32_t i) { return v.segment<3>(3 * static_cast<Eigen::Index>(i)); }

/// Sum of |p_i - q_i|, both sorted by node: 0 for one point, 2 for points with nothing in common.
double distance(const Skin::Weights& p, const Skin::Weights& q) {
  double sum = 0;
  for (auto i = p.begin(), j = q.begin(); i != p.end() || j != q.end();) {
    const bool of_p = j == q.end() || (i != p.end() && i->first <= j->first);
    const bool of_q = i == p.end() || (j != q.end() && j->first <= i->first);
    sum += std::abs((of_p ? i->second : 0.0) - (of_q ? j->second : 0.0));
    if (of_p) ++i;
    if (of_q) ++j;
  }
  return sum;
}

}  // namespace

std::vector<std::uint8_t> held_nodes(const LumpedBody& body, const std::vector<ToolPort>& ports) {
  auto held = body.fixed;
  for (const ToolPort& p : ports)
    if (p.kind == ContactKind::attach) held[p.node] = 1;
  return held;
}

Integrator::Integrator(const Dynamics& dynamics, const Skin& skin, const IntegratorOptions& options)
    : dynamics_(&dynamics),
      skin_(&skin),
      options_(options),
      a_(dynamics.make_matrix()),
      solver_(dynamics.nodes(), options.solver),
      tangents_(dynamics) {
  const auto& elements = dynamics.body().elements;
  for (const Element& e : elements) spacing_m_ += e.rest_length_m / static_cast<double>(elements.size());
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
  double h_try = step_s;
  while (until_s - state.time_s > 1e-9) {
    const double left = until_s - state.time_s;
    const double h = left / std::ceil(left / h_try - 1e-9);
    const BodyState before = state;
    const std::vector<ToolPort> ports_before = ports;
    const bool ok = step(state, ports, h, tools, report);
    const bool event = !std::equal(ports.begin(), ports.end(), ports_before.begin(),
                                   [](const ToolPort& p, const ToolPort& q) { return p.touching == q.touching; });
    if (ok && !(event && h > 1.01 * kEventStepS)) {
      state.time_s = before.time_s + h;
      ++report.steps;
      h_try = std::min(step_s, 2 * h_try);
      continue;
    }
    state = before;
    ports = ports_before;
    trend_.resize(0);
    h_try = ok ? kEventStepS : h / 2;
    matrix_a_ = ok ? matrix_a_ : 0;
    ++report.cut_steps;
    if (h_try < kMinStepS) {
      report.converged = false;
      return report;
    }
  }
  return report;
}

void Integrator::total_forces(const BodyState& state, const std::vector<ToolPort>& ports, Vector& f) const {
  dynamics_->forces(state.x, state.v, f);
  for (const ToolPort& p : ports) {
    if (p.kind != ContactKind::touch || !p.touching) continue;
    scatter(skin_->weights(p.point), p.lambda, f);
  }
}

void Integrator::hold_nodes(const std::vector<ToolPort>& ports, const std::vector<ToolAt>& tools, BodyState& state) const {
  for (std::uint32_t i = 0; i < dynamics_->nodes(); ++i) {
    if (!dynamics_->body().fixed[i]) continue;
    node_at(state.x, i) = dynamics_->body().nodes[i];
    node_at(state.v, i).setZero();
  }
  for (std::size_t k = 0; k < ports.size(); ++k) {
    if (ports[k].kind != ContactKind::attach || dynamics_->body().fixed[ports[k].node]) continue;
    node_at(state.x, ports[k].node) = tools[k].position;
    node_at(state.v, ports[k].node) = tools[k].velocity;
    if (!dynamics_->body().planar) continue;
    state.x[3 * ports[k].node + 2] = dynamics_->body().nodes[ports[k].node].z();
    state.v[3 * ports[k].node + 2] = 0;
  }
}

bool Integrator::step(BodyState& state, std::vector<ToolPort>& ports, double h, const ToolMotion& tools, AdvanceReport& report) {
  static const double gamma = 2 - std::sqrt(2.0);
  static const double c1 = 1 / (gamma * (2 - gamma)), c0 = (1 - gamma) * (1 - gamma) / (gamma * (2 - gamma));
  const double t0 = state.time_s;
  const double a = 0.5 * gamma * h;
  const Vector x0 = state.x, v0 = state.v;

  const auto run = [&](Stage& stage) {
    std::vector<ToolAt> at(ports.size());
    std::vector<Vec3> points(ports.size());
    for (std::size_t k = 0; k < ports.size(); ++k) {
      at[k] = tools(k, stage.end_s);
      points[k] = at[k].position;
    }
    hold_nodes(ports, at, state);
    return solve_stage(stage, points, state, ports, report);
  };

  total_forces(state, ports, f_);
  // Newton starts from velocities that go on changing as they did; what is wrong with that it takes back.
  if (trend_.size() == state.v.size()) state.v += gamma * h * trend_;
  Stage stage;
  stage.a = a;
  stage.end_s = t0 + gamma * h;
  stage.x_hat = x0 + a * v0;
  stage.v_hat = v0 + a * f_.cwiseQuotient(dynamics_->masses());
  if (!run(stage)) return false;
  const Vector v1 = state.v;
  stage.x_hat = c1 * state.x - c0 * x0;
  stage.v_hat = c1 * v1 - c0 * v0;
  stage.end_s = t0 + h;
  state.v += (1 - gamma) / gamma * (v1 - v0);
  if (!run(stage)) return false;
  trend_ = (state.v - v1) / ((1 - gamma) * h);

  state.time_s = t0 + h;
  for (ToolPort& p : ports)
    if (p.kind == ContactKind::attach) p.lambda = -dynamics_->element_force(state, p.node);
  // Springs that stiffen without bound can throw a body so far that rounding passes for convergence.
  return state.x.allFinite() && state.v.allFinite() && state.x.cwiseAbs().maxCoeff() <= kWorldExtentM;
}

bool Integrator::solve_stage(const Stage& stage, const std::vector<Vec3>& tool_points, BodyState& state,
                             std::vector<ToolPort>& ports, AdvanceReport& report) {
  if (!newton(stage, tool_points, state, ports, report)) return false;
  // A tool that ended up inside the surface touched it during this stage: solve again, now with the contact.
  return !begin_contacts(tool_points, state, ports) || newton(stage, tool_points, state, ports, report);
}

bool Integrator::is_lost(const ToolPort& port, const Vec3& tool, const BodyState& state) const {
  const double force_n = port.lambda.norm();
  if (force_n > kMostN) return true;
  if (force_n <= kFarN) return false;
  const Vec3 gap = tool - skin_->position(port.point, skin_->weights(port.point), state.x);
  return gap.norm() > kFarSpacings * spacing_m_;
}

bool Integrator::begin_contacts(const std::vector<Vec3>& tool_points, const BodyState& state,
                                std::vector<ToolPort>& ports) const {
  bool any = false;
  std::vector<double> x;
  for (std::size_t k = 0; k < ports.size(); ++k) {
    if (ports[k].kind != ContactKind::touch || ports[k].touching || skin_->empty()) continue;
    if (x.empty()) skin_->place(state.x, x);
    const NearestPoint nearest = nearest_point(skin_->view(), x, tool_points[k]);
    ports[k].point = nearest.point;
    ports[k].lambda.setZero();
    ports[k].touching = nearest.height_m < 0;
    any |= ports[k].touching;
  }
  return any;
}

void Integrator::forget_responses() {
  for (PortResponse& r : responses_) r.valid = false;
}

bool Integrator::refresh_matrix(const BodyState& state, double a, AdvanceReport& report) {
  // A^-1 B stays while the step does: it only steers.
  if (!(std::abs(responses_a_ - a) < 0.01 * a) || matrix_held_ != held_) forget_responses();
  ++report.factorisations;
  batch_ready_ = false;
  for (const bool clamp : {false, true}) {
    dynamics_->assemble(state, 1, a, a * a, held_, clamp, a_);
    if (!solver_.factorise(a_)) continue;
    matrix_a_ = a;
    matrix_clamp_ = clamp;
    matrix_held_ = held_;
    return true;
  }
  matrix_a_ = 0;
  return false;
}

void Integrator::solve_responses(const BodyState& state, const std::vector<std::size_t>& which, double a, AdvanceReport& report) {
  std::vector<Vector> inputs;
  for (const std::size_t k : which)
    for (int axis = 0; axis < 3; ++axis) {
      inputs.emplace_back(Vector::Zero(dynamics_->masses().size()));
      scatter(responses_[k].b, Vec3::Unit(axis), inputs.back());
      mask(held_, inputs.back());
    }
  std::vector<SolveColumn> columns;
  for (std::size_t c = 0; c < inputs.size(); ++c) columns.push_back({&inputs[c], &responses_[which[c / 3]].w[c % 3]});
  if (solver_.is_direct()) {
    for (const SolveColumn& column : columns) solver_.solve(*column.b, kResponseTolerance, *column.x);
    return;
  }
  if (!batch_ready_) {
    tangents_.take(state);
    batch_.prepare(tangents_, 1, a, a * a, held_, matrix_clamp_);
    batch_ready_ = true;
  }
  bool definite = true;  // what is found until it is not serves as well
  report.solver_iterations += batch_.solve(columns, kResponseTolerance, definite);
}

/// A^-1 B of the touching ports, and answers_.
void Integrator::update_responses(const BodyState& state, const std::vector<ToolPort>& ports,
                                  const std::vector<std::size_t>& touching, double a, AdvanceReport& report) {
  std::vector<std::size_t> stale;
  for (const std::size_t k : touching) {
    PortResponse& r = responses_[k];
    r.b = skin_->weights(ports[k].point);
    if (r.valid && distance(r.b, r.of_w) <= kSlidFar) continue;
    stale.push_back(k);
    r.of_w = r.b;
    r.valid = true;
  }
  if (!stale.empty()) solve_responses(state, stale, a, report);
  responses_a_ = a;
  const auto n = static_cast<Eigen::Index>(touching.size());
  answers_.resize(3 * n, 3 * n);
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < 3 * n; ++j)
      answers_.block<3, 1>(3 * i, j) =
          a * a *
          gather(responses_[touching[static_cast<std::size_t>(i)]].b,
                 responses_[touching[static_cast<std::size_t>(j / 3)]].w[static_cast<std::size_t>(j % 3)]);
  answers_ = 0.5 * (answers_ + answers_.transpose()).eval();
}

/// dv is the answer to the forces of before. Ports answer one after the other, each seeing the newest forces of the others.
void Integrator::close_ports(const Stage& stage, const std::vector<Vec3>& tool_points, const std::vector<Vec3>& normals,
                             const std::vector<std::size_t>& touching, const BodyState& state, std::vector<ToolPort>& ports,
                             Vector& dv, std::vector<Vec3>& slips) {
  constexpr int kSweepsMax = 40;
  constexpr double kSettled = 1e-4;  // of the largest force: what a sweep changes it by
  const auto n = static_cast<Eigen::Index>(touching.size());
  Vector p_end(3 * n), change = Vector::Zero(3 * n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const std::size_t k = touching[static_cast<std::size_t>(i)];
    const Skin::Weights& b = responses_[k].b;
    p_end.segment<3>(3 * i) = skin_->position(ports[k].point, b, state.x) + stage.a * gather(b, dv);
  }
  for (int sweep = 0; sweep < kSweepsMax; ++sweep) {
    double largest_n = 0, changed_n = 0;
    for (Eigen::Index i = 0; i < n; ++i) {
      const std::size_t k = touching[static_cast<std::size_t>(i)];
      ToolPort& port = ports[k];
      const Mat3 compliance = answers_.block<3, 3>(3 * i, 3 * i);
      const Vec3 p = p_end.segment<3>(3 * i) + answers_.middleRows<3>(3 * i) * change;
      const ContactClosure closure =
          close_contact(p - compliance * port.lambda, compliance, normals[k], tool_points[k], port.parameters);
      const Vec3 step = closure.lambda - port.lambda;
      change.segment<3>(3 * i) += step;
      port.lambda = closure.lambda;
      slips[k] = closure.slip;
      largest_n = std::max(largest_n, port.lambda.norm());
      changed_n = std::max(changed_n, step.norm());
    }
    if (n == 1 || changed_n <= kSettled * largest_n) break;
  }
  for (Eigen::Index j = 0; j < 3 * n; ++j)
    dv += stage.a * change[j] * responses_[touching[static_cast<std::size_t>(j / 3)]].w[static_cast<std::size_t>(j % 3)];
}

bool Integrator::newton(const Stage& stage, const std::vector<Vec3>& tool_points, BodyState& state, std::vector<ToolPort>& ports,
                        AdvanceReport& report) {
  const double a = stage.a;
  const auto place = [&] {
    for (std::uint32_t i = 0; i < dynamics_->nodes(); ++i)
      if (!held_[i]) node_at(state.x, i) = node_at(stage.x_hat, i) + a * node_at(state.v, i);
  };
  place();
  std::vector<Vec3> normals(ports.size(), Vec3::UnitZ()), slips(ports.size(), Vec3::Zero());
  std::vector<std::size_t> touching;
  for (std::size_t k = 0; k < ports.size(); ++k)
    if (ports[k].kind == ContactKind::touch && ports[k].touching) {
      if (touching.empty()) skin_->place(state.x, skin_positions_);
      normals[k] = normal_at(skin_->view(), skin_positions_, ports[k].point);
      touching.push_back(k);
    }

  bool fresh = false;
  if (!(std::abs(matrix_a_ - a) < 0.01 * a)) {
    if (!refresh_matrix(state, a, report)) return false;
    fresh = true;
  }
  double last_move = 0;
  Vector dv;
  for (int iteration = 0; iteration < kNewtonMax; ++iteration) {
    ++report.newton_iterations;
    if (!touching.empty() && (iteration == 0 || !responses_[touching.front()].valid))
      update_responses(state, ports, touching, a, report);
    dynamics_->forces(state.x, state.v, f_);
    for (const std::size_t k : touching) scatter(responses_[k].b, ports[k].lambda, f_);
    r_ = dynamics_->masses().cwiseProduct(stage.v_hat - state.v) + a * f_;
    mask(held_, r_);
    dv = Vector::Zero(r_.size());
    const SolveStats solved = solver_.solve(r_, kSolveTolerance, dv);
    report.solver_iterations += solved.iterations;
    if (!solved.positive_definite) {
      if (fresh || !refresh_matrix(state, a, report)) return false;
      fresh = true;
      continue;
    }
    if (!touching.empty()) close_ports(stage, tool_points, normals, touching, state, ports, dv, slips);
    state.v += dv;
    place();
    const double move = a * dv.cwiseAbs().maxCoeff();
    if (!std::isfinite(move)) return false;
    // What is still to come when moves shrink by the factor seen last: the sum of a geometric series.
    const double ratio = iteration > 0 ? move / last_move : 1;
    const double left = ratio < 0.5 ? move * ratio / (1 - ratio) : move;
    if (left < options_.tolerance_m) {
      for (std::size_t k = 0; k < ports.size(); ++k) {
        ToolPort& port = ports[k];
        if (port.kind != ContactKind::touch || !port.touching) continue;
        if (is_lost(port, tool_points[k], state)) port.lambda.setZero();
        port.touching = port.lambda.squaredNorm() > 0;
        if (slips[k].squaredNorm() > 0) port.point = slide(skin_->view(), skin_positions_, port.point, slips[k]);
      }
      return true;
    }
    // An old matrix that no longer contracts well is replaced; a fresh one that does not contract means too long a step.
    if (iteration > 0 && move > 0.25 * last_move) {
      if (fresh && iteration > 8 && move > 0.9 * last_move) return false;
      if (!fresh || iteration % 4 == 0) {
        if (fresh) forget_responses();
        if (!refresh_matrix(state, a, report)) return false;
        fresh = true;
      }
    }
    last_move = move;
  }
  return false;
}

}  // namespace palpate
