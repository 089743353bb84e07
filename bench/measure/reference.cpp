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

ReferenceForce reference_force(const Scene& scene, std::span<const Vec3> positions) {
  ReferenceForce result;
  if (positions.empty()) return result;
  const Skin skin(scene.body, scene.tool.radius_m);
  const Dynamics dynamics(scene.body);
  Integrator integrator(dynamics, skin, {scene.body.nodes.size() <= kFineNodes ? kFineStepS : kTickStepS, kToleranceM});
  BodyState state = settled_state(dynamics, skin);

  std::vector<ToolSample> samples;
  if (needs_settling(scene, positions[0])) samples.push_back({-kSettle, positions[0]});
  for (std::size_t i = 0; i < positions.size(); ++i)
    samples.push_back({Micros{1000 * static_cast<std::int64_t>(i)}, positions[i]});
  ToolTrack track;
  track.add(samples);
  state.time_s = seconds(track.begin());
  const Vec3 node = state.x.segment<3>(3 * static_cast<Eigen::Index>(scene.tool.node));
  const Grasp grasp(track.begin(), scene.tool.contact == ContactKind::attach ? Vec3(node - positions[0]) : Vec3::Zero());
  const auto tool = [&](std::size_t, double t) { return grasp.at(track, from_seconds(t)); };

  std::vector<ToolPort> ports(1);
  ports[0].kind = scene.tool.contact;
  ports[0].node = scene.tool.node;
  ports[0].parameters = {scene.tool.coupling_n_m, scene.tool.friction};
  for (std::size_t i = 0; i < positions.size(); ++i) {
    if (!integrator.advance(state, ports, static_cast<double>(i) * 1e-3, tool).converged)
      throw std::runtime_error("the reference did not converge " + std::to_string(i) + " ms into the motion");
    const bool contact = scene.tool.contact == ContactKind::attach || ports[0].touching;
    result.force.push_back(contact ? Vec3(-ports[0].lambda) : Vec3::Zero());
    result.contact.push_back(contact);
  }
  return result;
}

}  // namespace palpate
