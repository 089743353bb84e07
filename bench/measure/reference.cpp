#include "bench/measure/reference.hpp"

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

std::vector<ReferenceForce> reference_forces(const Scene& scene, std::span<const ToolPath> paths) {
  std::vector<ReferenceForce> result(paths.size());
  if (paths.empty() || paths[0].empty()) return result;
  const Skin skin(scene.body, scene.tool.radius_m);
  const Dynamics dynamics(scene.body);
  Integrator integrator(dynamics, skin, {scene.body.nodes.size() <= kFineNodes ? kFineStepS : kTickStepS, kToleranceM});
  BodyState state = settled_state(dynamics, skin);
  const bool attach = scene.tool.contact == ContactKind::attach;
  const Vec3 node = state.x.segment<3>(3 * static_cast<Eigen::Index>(scene.tool.node));

  bool settle = false;
  for (const ToolPath& path : paths) settle |= needs_settling(scene, path[0]);
  std::vector<ToolTrack> tracks(paths.size());
  std::vector<Grasp> grasps;
  std::vector<ToolPort> ports(paths.size());
  for (std::size_t k = 0; k < paths.size(); ++k) {
    std::vector<ToolSample> samples;
    if (settle) samples.push_back({-kSettle, paths[k][0]});
    for (std::size_t i = 0; i < paths[k].size(); ++i)
      samples.push_back({Micros{1000 * static_cast<std::int64_t>(i)}, paths[k][i]});
    tracks[k].add(samples);
    grasps.emplace_back(tracks[k].begin(), attach ? Vec3(node - paths[k][0]) : Vec3::Zero());
    ports[k].kind = scene.tool.contact;
    ports[k].node = scene.tool.node;
    ports[k].parameters = {scene.tool.coupling_n_m, scene.tool.friction};
  }
  state.time_s = seconds(tracks[0].begin());
  const auto tool = [&](std::size_t k, double t) { return grasps[k].at(tracks[k], from_seconds(t)); };
  for (std::size_t i = 0; i < paths[0].size(); ++i) {
    if (!integrator.advance(state, ports, static_cast<double>(i) * 1e-3, tool).converged)
      throw std::runtime_error("the reference did not converge " + std::to_string(i) + " ms into the motion");
    for (std::size_t k = 0; k < ports.size(); ++k) {
      const bool contact = attach || ports[k].touching;
      result[k].force.push_back(contact ? Vec3(-ports[k].lambda) : Vec3::Zero());
      result[k].contact.push_back(contact);
    }
  }
  return result;
}

}  // namespace palpate
