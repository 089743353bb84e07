#include "server/dynamics/contact_sweeps.hpp"
#include "server/dynamics/integrator.hpp"
#include "server/dynamics/needle_ports.hpp"

namespace palpate {
namespace {

constexpr double kNearSpacings = 0.3;  // from where A^-1 B was computed to where it still steers

}  // namespace

bool Integrator::begin_contacts(const std::vector<Vec3>& tool_points, const BodyState& state,
                                std::vector<ToolPort>& ports) const {
  bool any = false;
  std::vector<double> x;
  for (std::size_t k = 0; k < ports.size(); ++k) {
    if (ports[k].kind != ContactKind::touch || ports[k].touching || ports[k].on_path() || skin_->empty()) continue;
    if (x.empty()) skin_->place(state.x, x);
    const Onset onset =
        skin_->look_for_contact(ports[k].skin_copy, x, tool_points[k], ports[k].sphere.radius_m, ports[k].clearance);
    ports[k].point = onset.nearest.point;
    ports[k].lambda.setZero();
    ports[k].touching = onset.touches;
    any |= ports[k].touching;
  }
  return any;
}

void Integrator::update_responses(const std::vector<ToolPort>& ports, const std::vector<std::size_t>& touching, const Vector& x,
                                  AdvanceReport& report) {
  for (const std::size_t k : touching) {
    PortResponse& r = responses_[k];
    r.b = weights_of(*skin_, ports[k]);
    const auto way_m = [&] {
      return (position_of(*skin_, ports[k], r.b, x) - position_of(*skin_, r.port, weights_of(*skin_, r.port), x)).norm();
    };
    if (r.valid && way_m() <= kNearSpacings * spacing_m_) continue;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      Vector b = Vector::Zero(x.size());
      scatter(r.b, Vec3::Unit(static_cast<Eigen::Index>(axis)), b);
      mask(held_, b);
      r.w[axis].resize(0);
      report.solver_iterations += solver_.solve(b, options_.solve_tolerance, r.w[axis]).iterations;
    }
    r.port = ports[k];
    r.valid = true;
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
  // dv is the answer to the forces so far.
  std::vector<std::size_t> touching;
  for (std::size_t k = 0; k < ports.size(); ++k)
    if (ports[k].in_contact()) touching.push_back(k);
  update_responses(ports, touching, state.x, report);
  couple(touching, stage.a);
  std::vector<SweptContact> contacts;
  for (const std::size_t k : touching) {
    const Vec3 end = position_of(*skin_, ports[k], responses_[k].b, state.x) + stage.a * gather(responses_[k].b, dv);
    if (ports[k].on_path())
      contacts.push_back({k, end, normals[k], joined_point(ports[k], tool_points[k]), path_contact(ports[k])});
    else
      contacts.push_back({k, end, normals[k], ports[k].lowest(tool_points[k], normals[k])});
  }
  sweep_contacts(coupling_, contacts, ports);
  for (const SweptContact& contact : contacts) {
    slips[contact.port] = contact.slip;
    for (std::size_t axis = 0; axis < 3; ++axis)
      dv += stage.a * contact.change[static_cast<Eigen::Index>(axis)] * responses_[contact.port].w[axis];
  }
}

}  // namespace palpate
