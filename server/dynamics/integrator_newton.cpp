#include <algorithm>
#include <cmath>

#include "common/base/limits.hpp"
#include "common/patch/contact_law.hpp"
#include "server/dynamics/integrator.hpp"
#include "server/dynamics/needle_ports.hpp"

namespace palpate {

bool Integrator::refresh_matrix(const BodyState& state, double a, bool indefinite, AdvanceReport& report) {
  for (PortResponse& r : responses_) r.valid = false;
  ++report.factorisations;
  if (!a_) a_ = dynamics_->make_matrix();
  for (const bool clamp : {false, true}) {
    if (!clamp && indefinite) continue;
    dynamics_->assemble(state, 1, a, a * a, held_, clamp, *a_);
    if (!solver_.factorise(*a_)) continue;
    matrix_a_ = a;
    matrix_held_ = held_;
    matrix_clamped_ = clamp;
    return true;
  }
  matrix_a_ = 0;
  return false;
}

std::vector<Vec3> Integrator::normals_of(const std::vector<ToolPort>& ports, const Vector& x) const {
  std::vector<Vec3> normals(ports.size(), Vec3::UnitZ());
  for (std::size_t k = 0; k < ports.size(); ++k)
    if (ports[k].in_contact())
      normals[k] = ports[k].on_path() ? along_path(ports[k], x) : normal_at(skin_->view(), skin_positions_, ports[k].point);
  return normals;
}

void Integrator::finish_contacts(const std::vector<Vec3>& tool_points, const std::vector<Vec3>& slips, const BodyState& state,
                                 std::vector<ToolPort>& ports) {
  for (std::size_t k = 0; k < ports.size(); ++k) {
    ToolPort& port = ports[k];
    if (!port.in_contact()) continue;
    if (port.on_path()) {
      const Vec3 gap = joined_point(port, tool_points[k]) - position_of(*skin_, port, responses_[k].b, state.x);
      if (is_lost(port, gap.norm(), spacing_m_))
        leave_body(ports, k);
      else
        slide_on_path(ports, k, slips[k].dot(along_path(port, state.x)), state.x);
      continue;
    }
    const Vec3 normal = normal_at(skin_->view(), skin_positions_, port.point);
    const Vec3 gap = port.lowest(tool_points[k], normal) - skin_->position(port.point, responses_[k].b, state.x);
    if (is_lost(port, gap.norm(), spacing_m_)) port.lambda.setZero();
    port.touching = port.lambda.squaredNorm() > 0;
    if (!port.touching) port.clearance = clearance_of(port.point, gap, normal);
    if (slips[k].squaredNorm() > 0) port.point = slide(skin_->view(), skin_positions_, port.point, slips[k]);
  }
  if (follow_needles(tool_points, state.x, ports))
    for (PortResponse& r : responses_) r.valid = false;
}

bool Integrator::slide_on(std::vector<Vec3>& slips, const BodyState& state, std::vector<ToolPort>& ports) {
  bool any = false;
  for (std::size_t k = 0; k < ports.size(); ++k) {
    ToolPort& port = ports[k];
    if (!port.in_contact() || !(slips[k].norm() > kSlipToleranceM)) continue;
    if (!any) skin_->place(state.x, skin_positions_);
    any = true;
    if (port.on_path())
      slide_on_path(ports, k, slips[k].dot(along_path(port, state.x)), state.x);
    else
      port.point = slide(skin_->view(), skin_positions_, port.point, slips[k]);
    slips[k].setZero();
  }
  return any;
}

void Integrator::place(const Stage& stage, BodyState& state) const {
  for (std::uint32_t i = 0; i < dynamics_->nodes(); ++i)
    if (!held_[i]) at_node(state.x, i) = at_node(stage.x_hat, i) + stage.a * at_node(state.v, i);
}

bool Integrator::newton(const Stage& stage, const std::vector<Vec3>& tool_points, BodyState& state, std::vector<ToolPort>& ports,
                        AdvanceReport& report) {
  constexpr double kOvershoot = 0.5, kLeastShare = 0.1;
  const double a = stage.a;
  place(stage, state);
  const bool contact = std::any_of(ports.begin(), ports.end(), [](const ToolPort& p) { return p.in_contact(); });
  if (contact) skin_->place(state.x, skin_positions_);
  const double tolerance_m = contact ? std::max(options_.tolerance_m, options_.contact_tolerance_m) : options_.tolerance_m;
  std::vector<Vec3> normals = normals_of(ports, state.x);
  std::vector<Vec3> slips(ports.size(), Vec3::Zero());
  bool fresh = !(std::abs(matrix_a_ - a) < 0.01 * a);
  if (fresh && !refresh_matrix(state, a, false, report)) return false;
  int since_slide = 0, slides = 0;
  double last_move = 0, pull_before = 0;
  Vector dv;
  for (int iteration = 0; iteration < stage.iterations_max; ++iteration) {
    ++report.newton_iterations;
    total_forces(state, ports, f_);
    r_ = dynamics_->masses().cwiseProduct(stage.v_hat - state.v) + a * f_;
    mask(held_, r_);
    if (!r_.allFinite()) return false;
    const double pull = iteration > 0 && !contact ? r_.dot(dv) : 0;
    if (!(pull >= -kOvershoot * pull_before)) {
      const double share = std::isfinite(pull) ? std::max(pull_before / (pull_before - pull), kLeastShare) : kLeastShare;
      state.v -= (1 - share) * dv;
      place(stage, state);
      dv *= share;
      pull_before *= share;
      last_move *= share;
      continue;
    }
    dv = Vector::Zero(r_.size());
    const SolveStats solved = solver_.solve(r_, options_.solve_tolerance, dv);
    report.solver_iterations += solved.iterations;
    if (!solved.positive_definite) {
      if ((fresh && matrix_clamped_) || !refresh_matrix(state, a, fresh, report)) return false;
      fresh = true;
      continue;
    }
    pull_before = r_.dot(dv);
    if (contact) close_ports(stage, tool_points, normals, state, ports, dv, slips, report);
    state.v += dv;
    place(stage, state);
    const double move = a * dv.cwiseAbs().maxCoeff();
    if (!(move <= kWorldExtentM)) return false;
    // What is still to come when moves shrink by the factor seen last: the sum of a geometric series.
    const double ratio = since_slide > 0 ? move / last_move : 1;
    const double left = ratio < 0.5 ? move * ratio / (1 - ratio) : move;
    if (left < tolerance_m) {
      if (slides < kSlidesMax && slide_on(slips, state, ports)) {
        ++slides;
        since_slide = 0;
        last_move = 0;
        normals = normals_of(ports, state.x);
        continue;
      }
      finish_contacts(tool_points, slips, state, ports);
      return true;
    }
    // A matrix that no longer contracts well is replaced; with contacts a fresh one that does not contract means too long a step.
    if (since_slide > 0 && move > 0.25 * last_move) {
      if (contact && fresh && iteration > 8 && move > 0.9 * last_move) return false;
      if (!contact || !fresh || iteration % 4 == 0) {
        if (!refresh_matrix(state, a, false, report)) return false;
        fresh = true;
      }
    }
    last_move = move;
    ++since_slide;
  }
  return false;
}

}  // namespace palpate
