#include "server/body/integrator.hpp"

#include <algorithm>
#include <cmath>

#include "common/base/limits.hpp"

namespace palpate {
namespace {

constexpr int kNewtonMax = 30;
constexpr double kSolveTolerance = 1e-2;     // of one inexact Newton step
constexpr double kResponseTolerance = 1e-2;  // of A^-1 B: it steers the iteration, it does not set the answer
constexpr double kNearSpacings = 0.3;        // from where A^-1 B was computed to where it still steers

}  // namespace

Integrator::Integrator(const Dynamics& dynamics, const Skin& skin, const IntegratorOptions& options)
    : dynamics_(&dynamics),
      skin_(&skin),
      options_(options),
      a_(dynamics.make_matrix()),
      solver_(dynamics.nodes(), options.solver) {
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

bool Integrator::step(BodyState& state, std::vector<ToolPort>& ports, double h, const ToolMotion& tools, AdvanceReport& report) {
  static const double gamma = 2 - std::sqrt(2.0);
  static const double c1 = 1 / (gamma * (2 - gamma)), c0 = (1 - gamma) * (1 - gamma) / (gamma * (2 - gamma));
  const double t0 = state.time_s;
  const double a = 0.5 * gamma * h;
  const Vector x0 = state.x, v0 = state.v;

  const auto run = [&](Stage& stage) {
    std::vector<Vec3> points(ports.size());
    for (std::size_t k = 0; k < ports.size(); ++k) points[k] = tools(k, stage.end_s).position;
    hold_nodes(dynamics_->body(), ports, stage.end_s, tools, state);
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
  find_holding_forces(*dynamics_, state, ports);
  // Springs that stiffen without bound can throw a body so far that rounding passes for convergence.
  return state.x.allFinite() && state.v.allFinite() && state.x.cwiseAbs().maxCoeff() <= kWorldExtentM;
}

bool Integrator::solve_stage(const Stage& stage, const std::vector<Vec3>& tool_points, BodyState& state,
                             std::vector<ToolPort>& ports, AdvanceReport& report) {
  if (!newton(stage, tool_points, state, ports, report)) return false;
  // A tool that ended up inside the surface touched it during this stage: solve again, now with the contact.
  return !begin_contacts(tool_points, state, ports) || newton(stage, tool_points, state, ports, report);
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

bool Integrator::refresh_matrix(const BodyState& state, double a, AdvanceReport& report) {
  for (PortResponse& r : responses_) r.valid = false;
  ++report.factorisations;
  for (const bool clamp : {false, true}) {
    dynamics_->assemble(state, 1, a, a * a, held_, clamp, a_);
    if (!solver_.factorise(a_)) continue;
    matrix_a_ = a;
    matrix_held_ = held_;
    return true;
  }
  matrix_a_ = 0;
  return false;
}

void Integrator::update_responses(const std::vector<ToolPort>& ports, const std::vector<std::size_t>& touching, const Vector& x,
                                  AdvanceReport& report) {
  std::vector<std::size_t> stale;
  for (const std::size_t k : touching) {
    PortResponse& r = responses_[k];
    r.b = skin_->weights(ports[k].point);
    const auto way_m = [&] {
      return (skin_->position(ports[k].point, r.b, x) - skin_->position(r.point, skin_->weights(r.point), x)).norm();
    };
    if (!r.valid || way_m() > kNearSpacings * spacing_m_) stale.push_back(k);
  }
  std::vector<Vector> b(3 * stale.size(), Vector::Zero(x.size()));
  std::vector<SolveColumn> columns;
  for (std::size_t i = 0; i < stale.size(); ++i)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      scatter(responses_[stale[i]].b, Vec3::Unit(static_cast<Eigen::Index>(axis)), b[3 * i + axis]);
      mask(held_, b[3 * i + axis]);
      columns.push_back({&b[3 * i + axis], &responses_[stale[i]].w[axis]});
    }
  if (!columns.empty()) report.solver_iterations += solver_.solve(columns, kResponseTolerance, held_).iterations;
  for (const std::size_t k : stale) {
    responses_[k].point = ports[k].point;
    responses_[k].valid = true;
  }
}

void Integrator::couple(const std::vector<std::size_t>& touching, double a) {
  coupling_.resize(touching.size(), std::vector<Mat3>(touching.size()));
  for (std::size_t j = 0; j < touching.size(); ++j) {
    coupling_[j].resize(touching.size());
    for (std::size_t k = 0; k < touching.size(); ++k)
      for (std::size_t axis = 0; axis < 3; ++axis)
        coupling_[j][k].col(static_cast<Eigen::Index>(axis)) =
            a * a * gather(responses_[touching[j]].b, responses_[touching[k]].w[axis]);
    coupling_[j][j] = 0.5 * (coupling_[j][j] + coupling_[j][j].transpose()).eval();
  }
}

void Integrator::close_ports(const Stage& stage, const std::vector<Vec3>& tool_points, const std::vector<Vec3>& normals,
                             const BodyState& state, std::vector<ToolPort>& ports, Vector& dv, std::vector<Vec3>& slips,
                             AdvanceReport& report) {
  // dv is the answer to the forces so far. Ports answer one after the other, each seeing the newest forces of the others.
  constexpr int kSweeps = 4;
  std::vector<std::size_t> touching;
  for (std::size_t k = 0; k < ports.size(); ++k)
    if (ports[k].kind == ContactKind::touch && ports[k].touching) touching.push_back(k);
  update_responses(ports, touching, state.x, report);
  couple(touching, stage.a);
  std::vector<Vec3> ends, steps(touching.size(), Vec3::Zero());
  for (const std::size_t k : touching)
    ends.push_back(skin_->position(ports[k].point, responses_[k].b, state.x) + stage.a * gather(responses_[k].b, dv));
  for (int sweep = 0; sweep < (touching.size() > 1 ? kSweeps : 1); ++sweep)
    for (std::size_t i = 0; i < touching.size(); ++i) {
      const std::size_t k = touching[i];
      const Vec3 free = ends[i] - coupling_[i][i] * ports[k].lambda;
      const ContactClosure closure = close_contact(free, coupling_[i][i], normals[k], tool_points[k], ports[k].parameters);
      const Vec3 step = closure.lambda - ports[k].lambda;
      for (std::size_t j = 0; j < touching.size(); ++j) ends[j] += coupling_[j][i] * step;
      steps[i] += step;
      ports[k].lambda = closure.lambda;
      slips[k] = closure.slip;
    }
  for (std::size_t i = 0; i < touching.size(); ++i)
    for (std::size_t axis = 0; axis < 3; ++axis)
      dv += stage.a * steps[i][static_cast<Eigen::Index>(axis)] * responses_[touching[i]].w[axis];
}

bool Integrator::newton(const Stage& stage, const std::vector<Vec3>& tool_points, BodyState& state, std::vector<ToolPort>& ports,
                        AdvanceReport& report) {
  const double a = stage.a;
  const auto place = [&] {
    for (std::uint32_t i = 0; i < dynamics_->nodes(); ++i)
      if (!held_[i]) at_node(state.x, i) = at_node(stage.x_hat, i) + a * at_node(state.v, i);
  };
  place();
  std::vector<Vec3> normals(ports.size(), Vec3::UnitZ()), slips(ports.size(), Vec3::Zero());
  bool any_contact = false;
  for (std::size_t k = 0; k < ports.size(); ++k)
    if (ports[k].kind == ContactKind::touch && ports[k].touching) {
      if (!any_contact) skin_->place(state.x, skin_positions_);
      normals[k] = normal_at(skin_->view(), skin_positions_, ports[k].point);
      any_contact = true;
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
    total_forces(state, ports, f_);
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
    if (any_contact) close_ports(stage, tool_points, normals, state, ports, dv, slips, report);
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
        const Vec3 gap = tool_points[k] - skin_->position(port.point, responses_[k].b, state.x);
        if (is_lost(port, gap.norm(), spacing_m_)) port.lambda.setZero();
        port.touching = port.lambda.squaredNorm() > 0;
        if (slips[k].squaredNorm() > 0) port.point = slide(skin_->view(), skin_positions_, port.point, slips[k]);
      }
      return true;
    }
    // An old matrix that no longer contracts well is replaced; a fresh one that does not contract means too long a step.
    if (iteration > 0 && move > 0.25 * last_move) {
      if (fresh && iteration > 8 && move > 0.9 * last_move) return false;
      if (!fresh || iteration % 4 == 0) {
        if (!refresh_matrix(state, a, report)) return false;
        fresh = true;
      }
    }
    last_move = move;
  }
  return false;
}

}  // namespace palpate
