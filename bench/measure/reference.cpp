#include "bench/measure/reference.hpp"

#include <algorithm>
#include <stdexcept>

#include "server/body/settle.hpp"
#include "server/room/grasp.hpp"

namespace palpate {
namespace {

constexpr double kToleranceM = 1e-8;

}  // namespace

bool needs_settling(const Scene& scene, const Vec3& start) {
  constexpr double kSamePlaceM = 1e-6;
  const bool beside =
      scene.tool.contact == ContactKind::attach && (scene.body.nodes[scene.tool.node] - start).norm() > kSamePlaceM;
  return beside || scene.body.gravity_m_s2.squaredNorm() > 0;
}

ReferenceForce reference_force(const Scene& scene, const ToolPath& path) {
  return reference_forces(scene, std::span(&path, 1)).front();
}

struct ReferenceModel::State {
  explicit State(const Scene& s)
      : scene(s),
        skin(scene.body, scene.tool.radius_m),
        dynamics(scene.body),
        integrator(dynamics, skin, {scene.body.nodes.size() <= kFineNodes ? kFineStepS : kTickStepS, kToleranceM}),
        body(settled_state(dynamics, skin)) {}

  ToolAt tool_at(std::size_t k, double t_s) const { return grasps[k].at(tracks[k], from_seconds(t_s)); }

  Scene scene;
  Skin skin;
  Dynamics dynamics;
  Integrator integrator;
  BodyState body;
  std::vector<ToolTrack> tracks;
  std::vector<Grasp> grasps;
  std::vector<ToolPort> ports;
  std::int64_t ticks = 0;
};

ReferenceModel::ReferenceModel(const Scene& scene, std::span<const Vec3> tools) : state_(std::make_unique<State>(scene)) {
  State& s = *state_;
  const bool attach = scene.tool.contact == ContactKind::attach;
  const Vec3 node = s.body.x.segment<3>(3 * static_cast<Eigen::Index>(scene.tool.node));
  const bool settle = std::any_of(tools.begin(), tools.end(), [&](const Vec3& at) { return needs_settling(scene, at); });
  const Micros begin = settle ? -kSettle : Micros{};
  s.tracks.resize(tools.size());
  s.ports.resize(tools.size());
  for (std::size_t k = 0; k < tools.size(); ++k) {
    s.tracks[k].add(std::vector{ToolSample{begin, tools[k]}});
    s.grasps.emplace_back(begin, attach ? Vec3(node - tools[k]) : Vec3::Zero());
    s.ports[k].kind = scene.tool.contact;
    s.ports[k].node = scene.tool.node;
    s.ports[k].parameters = {scene.tool.coupling_n_m, scene.tool.friction};
  }
  s.body.time_s = seconds(begin);
}

ReferenceModel::~ReferenceModel() = default;

void ReferenceModel::tick(std::span<const Vec3> tools) {
  State& s = *state_;
  const Micros now{1000 * s.ticks};
  for (std::size_t k = 0; k < tools.size(); ++k) {
    s.tracks[k].add(std::vector{ToolSample{now, tools[k]}});
    s.tracks[k].forget_before(now - Micros{10'000});
  }
  const auto motion = [&](std::size_t k, double t_s) { return s.tool_at(k, t_s); };
  if (!s.integrator.advance(s.body, s.ports, 1e-3 * static_cast<double>(s.ticks), motion).converged)
    throw std::runtime_error("the reference did not converge " + std::to_string(s.ticks) + " ms into the motion");
  ++s.ticks;
}

bool ReferenceModel::contact(std::size_t tool) const {
  return state_->ports[tool].kind == ContactKind::attach || state_->ports[tool].touching;
}

Vec3 ReferenceModel::force(std::size_t tool) const { return contact(tool) ? Vec3(-state_->ports[tool].lambda) : Vec3::Zero(); }

std::vector<ReferenceForce> reference_forces(const Scene& scene, std::span<const ToolPath> paths,
                                             const std::function<void(double)>& progress) {
  std::vector<ReferenceForce> result(paths.size());
  if (paths.empty() || paths[0].empty()) return result;
  std::vector<Vec3> tools(paths.size());
  const auto place = [&](std::size_t i) {
    for (std::size_t k = 0; k < paths.size(); ++k) tools[k] = paths[k][i];
  };
  place(0);
  ReferenceModel model(scene, tools);
  for (std::size_t i = 0; i < paths[0].size(); ++i) {
    place(i);
    model.tick(tools);
    for (std::size_t k = 0; k < paths.size(); ++k) {
      result[k].force.push_back(model.force(k));
      result[k].contact.push_back(model.contact(k));
    }
    if (progress) progress(static_cast<double>(i + 1) / static_cast<double>(paths[0].size()));
  }
  return result;
}

}  // namespace palpate
