#include "bench/tissue/pulled_body.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "server/solve/linear_solver.hpp"

namespace palpate {
namespace {

constexpr IntegratorOptions kOptions{.step_s = 0.01, .tolerance_m = 1e-8};

/// Nodes at the ends of both arms: +1 above, -1 below. Those that a cut has copied have none.
std::vector<std::pair<std::uint32_t, int>> ends_of(const LumpedBody& body) {
  std::vector<std::pair<std::uint32_t, int>> ends;
  for (std::uint32_t i = 0; i < body.nodes.size(); ++i) {
    const Vec3& x = body.nodes[i];
    if (x.x() < 1e-9 && (x.z() < 1e-9 || x.z() > 2 * DoubleCantilever::kArmM - 1e-9))
      ends.emplace_back(i, x.z() > DoubleCantilever::kArmM ? 1 : -1);
  }
  return ends;
}

}  // namespace

PulledBody::PulledBody(Scene scene, std::vector<ToolPort> ports, Motion motion)
    : scene_(std::move(scene)),
      motion_(std::move(motion)),
      skin_(scene_.body, scene_.tool.radius_m),
      dynamics_(std::in_place, scene_.body),
      state_(dynamics_->rest_state()),
      at_rest_(state_),
      ports_(std::move(ports)),
      integrator_(std::in_place, *dynamics_, skin_, kOptions),
      cuts_(BodyInParts{&scene_, &skin_, &tissue_, &dynamics_, &state_, &at_rest_, &ports_}) {}

bool PulledBody::frame(double length_s) {
  std::vector<Vec3> force, place;
  for (const ToolPort& port : ports_) {
    force.push_back(port.lambda);
    place.push_back(motion_(port, state_.time_s).position);
  }
  const auto tools = [&](std::size_t k, double t) { return motion_(ports_[k], t); };
  if (!integrator_->advance(state_, ports_, state_.time_s + length_s, tools).converged)
    throw std::runtime_error("a body that is pulled found no equilibrium");
  for (std::size_t k = 0; k < ports_.size(); ++k)
    work_j_ += 0.5 * (force[k] + ports_[k].lambda).dot(motion_(ports_[k], state_.time_s).position - place[k]);
  const double energy_before_j = energy_j();
  const Vec3 momentum_before = momentum();
  if (!cuts_.cut_on()) return false;
  energy_jump_ = std::max(energy_jump_, std::abs(energy_j() / energy_before_j - 1));
  velocity_jump_m_s_ = std::max(velocity_jump_m_s_, (momentum() - momentum_before).norm() / dynamics_->masses().sum());
  for (std::size_t k = 1; k < cuts_.parted().cell_before.size(); ++k)
    cells_ += cuts_.parted().cell_before[k] == cuts_.parted().cell_before[k - 1];
  integrator_.emplace(*dynamics_, skin_, kOptions);
  return true;
}

Vec3 PulledBody::momentum() const {
  Vec3 sum = Vec3::Zero();
  for (std::uint32_t i = 0; i < dynamics_->nodes(); ++i) sum += dynamics_->masses()[3 * i] * at_node(state_.v, i);
  return sum;
}

Scene double_cantilever(double spacing_m, double cut_m, const std::string& more, const std::string& element) {
  const auto nodes = [&](double extent_m) { return 1 + static_cast<int>(std::lround(extent_m / spacing_m)); };
  return read_scene(fmt::format(R"({{"body": {{"lattice": {{"nodes": [{}, {}, {}], "size_m": [{}, {}, {}], "fixed_faces": ["x+"],
        "solid": {{"element": "{}", "young_pa": {}, "poisson": 0.4, "law": "corotational", "damping_s": 0.002}}}},
        "cuts": [{{"path": [{{"at_m": [-0.01, -0.01, {}]}}, {{"at_m": [{}, -0.01, {}]}}], "direction": [0, 1, 0], "depth_m": 0.04}}],
        "tissue": [{{"toughness_j_m2": {}}}], "tears": true{}}}, "tool": {{"contact": "attach"}}}})",
                                nodes(DoubleCantilever::kLongM), nodes(DoubleCantilever::kBroadM),
                                2 * nodes(DoubleCantilever::kArmM) - 1, DoubleCantilever::kLongM, DoubleCantilever::kBroadM,
                                2 * DoubleCantilever::kArmM, element, DoubleCantilever::kYoungPa, DoubleCantilever::kArmM,
                                cut_m + 0.3 * spacing_m, DoubleCantilever::kArmM, DoubleCantilever::kToughnessJM2, more),
                    "bar");
}

OpenedArms opened_arms(const Dynamics& dynamics, double force_n) {
  const auto ends = ends_of(dynamics.body());
  OpenedArms result{Vector::Zero(dynamics.masses().size())};
  Vector load = result.u;
  for (const auto& [node, side] : ends) at_node(load, node).z() = 2 * side * force_n / static_cast<double>(ends.size());
  BlockMatrix k = dynamics.make_matrix();
  dynamics.assemble(dynamics.rest_state(), 0, 0, 1, dynamics.body().fixed, false, k);
  LinearSolver solver(dynamics.nodes(), LinearSolver::Method::direct);
  if (!solver.factorise(k)) throw std::runtime_error("a bar with two arms has no equilibrium");
  solver.solve(load, 1e-12, result.u);
  for (const auto& [node, side] : ends)
    result.apart_m += 2 * side * at_node(result.u, node).z() / static_cast<double>(ends.size());
  return result;
}

PulledBody pulled_arms(double spacing_m, double cut_m, const std::function<double(double)>& apart_m, const std::string& more) {
  Scene scene = double_cantilever(spacing_m, cut_m, more);
  std::vector<std::uint32_t> held;
  for (const auto& [node, side] : ends_of(scene.body)) held.push_back(node);
  return gripped(std::move(scene), held, [=](const Vec3& rest, double t) {
    return Vec3(rest + (rest.z() > DoubleCantilever::kArmM ? 0.5 : -0.5) * apart_m(t) * Vec3::UnitZ());
  });
}

PulledBody gripped(Scene scene, const std::vector<std::uint32_t>& held,
                   std::function<Vec3(const Vec3& rest, double time_s)> grips) {
  std::vector<ToolPort> ports;
  for (const std::uint32_t node : held) {
    ToolPort& port = ports.emplace_back();
    port.kind = ContactKind::attach;
    port.node = node;
  }
  auto motion = [rest = scene.body.nodes, grips = std::move(grips)](const ToolPort& port, double t) {
    constexpr double kStepS = 1e-6;
    ToolAt at;
    at.position = grips(rest[port.node], t);
    at.velocity = (grips(rest[port.node], t + kStepS) - grips(rest[port.node], t - kStepS)) / (2 * kStepS);
    return at;
  };
  return PulledBody(std::move(scene), std::move(ports), std::move(motion));
}

}  // namespace palpate
