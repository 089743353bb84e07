#include "server/body/surface_stiffness.hpp"

#include <algorithm>
#include <cassert>

#include "server/body/dynamics.hpp"
#include "server/body/settle.hpp"
#include "server/body/skin.hpp"
#include "server/solve/linear_solver.hpp"

namespace palpate {
namespace {

constexpr double kTolerance = 1e-6;

struct Port {
  Vec3 place, outward;
  NodeWeights weights;
};

Port port_of(const Scene& scene, const Skin& skin, const Vector& x, const Vec3& tool) {
  if (scene.tool.contact == ContactKind::attach) {
    const Vec3 place = x.segment<3>(3 * static_cast<Eigen::Index>(scene.tool.node));
    return {place, scene.body.planar ? Vec3::UnitY() : Vec3::UnitZ(), {{scene.tool.node, 1.0}}};
  }
  const NearestPoint nearest = nearest_point(skin.view(), skin.place(x), tool);
  return {nearest.position, nearest.normal, skin.weights(nearest.point)};
}

}  // namespace

std::optional<SurfaceStiffness> finger_stiffness(const Scene& scene, const Vec3& tool) {
  const std::vector<SurfaceStiffness> found = finger_stiffnesses(scene, {&tool, 1});
  return found.empty() ? std::nullopt : std::optional(found.front());
}

std::vector<SurfaceStiffness> finger_stiffnesses(const Scene& scene, std::span<const Vec3> tools, std::span<const Vec3> outward) {
  assert(outward.empty() || outward.size() == tools.size());
  const LumpedBody& body = scene.body;
  if (std::none_of(body.fixed.begin(), body.fixed.end(), [](std::uint8_t held) { return held != 0; })) return {};
  const Dynamics dynamics(body);
  const Skin skin(body, scene.tool.radius_m);
  if (scene.tool.contact == ContactKind::touch && skin.empty()) return {};
  const BodyState still = settled_state(dynamics, scene.name);

  BlockMatrix stiffness = dynamics.make_matrix();
  dynamics.assemble(still, 0, 0, 1, body.fixed, true, stiffness);
  LinearSolver solver(dynamics.nodes());
  if (!solver.factorise(stiffness)) return {};
  std::vector<SurfaceStiffness> found;
  Vector push(still.x.size()), moved(still.x.size());
  for (std::size_t k = 0; k < tools.size(); ++k) {
    Port port = port_of(scene, skin, still.x, tools[k]);
    if (!outward.empty()) port.outward = outward[k];
    push.setZero();
    moved.setZero();
    scatter(port.weights, port.outward, push);
    mask(body.fixed, push);
    if (!solver.solve(push, kTolerance, moved).positive_definite) return {};
    const double gives_way_m_n = gather(port.weights, moved).dot(port.outward);
    if (!(gives_way_m_n > 0)) return {};
    found.push_back({port.place, port.outward, 1 / gives_way_m_n});
  }
  return found;
}

}  // namespace palpate
