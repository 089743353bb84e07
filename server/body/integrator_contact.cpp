#include "server/body/integrator.hpp"

namespace palpate {
namespace {

constexpr double kResponseTolerance = 3e-3;  // of A^-1 B: it steers the iteration, it does not set the answer

}  // namespace

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

void Integrator::update_response(std::size_t port, const SurfacePoint& point, double a, AdvanceReport& report) {
  PortResponse& r = responses_[port];
  if (r.valid && r.point.triangle == point.triangle && r.point.weight == point.weight) return;
  r.b = skin_->weights(point);
  if (r.w.rows() != a_.rows() * 3) r.w.setZero(static_cast<Eigen::Index>(a_.rows()) * 3, 3);
  for (int axis = 0; axis < 3; ++axis) {
    Vector b = Vector::Zero(r.w.rows());
    scatter(r.b, Vec3::Unit(axis), b);
    mask(held_, b);
    Vector column = r.w.col(axis);
    report.solver_iterations += solver_.solve(b, kResponseTolerance, column).iterations;
    r.w.col(axis) = column;
    r.compliance.col(axis) = a * a * gather(r.b, column);
  }
  r.compliance = 0.5 * (r.compliance + r.compliance.transpose()).eval();
  r.point = point;
  r.valid = true;
}

void Integrator::close_ports(const Stage& stage, const std::vector<Vec3>& tool_points, const std::vector<Vec3>& normals,
                             const BodyState& state, std::vector<ToolPort>& ports, Vector& dv, std::vector<Vec3>& slips,
                             AdvanceReport& report) {
  // dv is the free answer. Ports answer one after the other, each seeing the newest forces of the others.
  constexpr int kSweeps = 4;
  std::vector<std::size_t> touching;
  for (std::size_t k = 0; k < ports.size(); ++k) {
    if (ports[k].kind != ContactKind::touch || !ports[k].touching) continue;
    touching.push_back(k);
    update_response(k, ports[k].point, stage.a, report);
    dv += stage.a * (responses_[k].w * ports[k].lambda);
  }
  for (int sweep = 0; sweep < (touching.size() > 1 ? kSweeps : 1); ++sweep)
    for (const std::size_t k : touching) {
      ToolPort& port = ports[k];
      const PortResponse& r = responses_[k];
      const Vec3 p_end = skin_->position(port.point, r.b, state.x) + stage.a * gather(r.b, dv);
      const Vec3 p_free = p_end - r.compliance * port.lambda;
      const ContactClosure closure = close_contact(p_free, r.compliance, normals[k], tool_points[k], port.parameters);
      dv += stage.a * (r.w * (closure.lambda - port.lambda));
      port.lambda = closure.lambda;
      slips[k] = closure.slip;
    }
}

}  // namespace palpate
