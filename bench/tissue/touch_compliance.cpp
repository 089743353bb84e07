#include "bench/tissue/touch_compliance.hpp"

#include <algorithm>

#include "server/body/dynamics.hpp"
#include "server/body/settle.hpp"
#include "server/body/skin.hpp"
#include "server/body/touch_places.hpp"
#include "server/solve/linear_solver.hpp"

namespace palpate {
namespace {

constexpr double kTolerance = 1e-6;

}  // namespace

std::vector<PushedPlace> compared_places(const Scene& scene, double held_below_m, const Vec3& first, std::size_t count) {
  double top_m = held_below_m;
  for (const Vec3& x : scene.body.nodes) top_m = std::max(top_m, x.z());
  const double from_m = held_below_m + std::min(scene.tool.radius_m, 0.5 * (top_m - held_below_m));
  LumpedBody above = scene.body;  // touch_places() leaves out triangles with a fixed node
  for (std::size_t i = 0; i < above.nodes.size(); ++i)
    if (above.nodes[i].z() < from_m) above.fixed[i] = 1;
  const Skin skin(scene.body, scene.tool.radius_m);
  const Vector rest = Dynamics(scene.body).rest_state().x;
  std::vector<PushedPlace> places;
  for (const Vec3& place : touch_places(above, first, count))
    places.push_back({place, nearest_point(skin.view(), skin.place(rest), place).normal});
  return places;
}

std::vector<double> touch_compliances(const Scene& scene, std::span<const PushedPlace> places) {
  const LumpedBody& body = scene.body;
  if (std::ranges::none_of(body.fixed, [](std::uint8_t held) { return held != 0; })) return {};
  const Dynamics dynamics(body);
  const Skin skin(body, scene.tool.radius_m);
  const BodyState still = settled_state(dynamics, scene.name);
  BlockMatrix stiffness = dynamics.make_matrix();
  dynamics.assemble(still, 0, 0, 1, body.fixed, true, stiffness);
  LinearSolver solver(dynamics.nodes());
  if (!solver.factorise(stiffness)) return {};
  std::vector<double> compliances;
  Vector push(still.x.size()), moved(still.x.size());
  for (const auto& [place, outward] : places) {
    const Skin::Weights weights = skin.weights(nearest_point(skin.view(), skin.place(still.x), place).point);
    push.setZero();
    moved.setZero();
    scatter(weights, outward, push);
    mask(body.fixed, push);
    if (!solver.solve(push, kTolerance, moved).positive_definite) return {};
    compliances.push_back(gather(weights, moved).dot(outward));
    if (!(compliances.back() > 0)) return {};
  }
  return compliances;
}

}  // namespace palpate
