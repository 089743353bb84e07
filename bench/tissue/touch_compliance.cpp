#include "bench/tissue/touch_compliance.hpp"

#include <algorithm>

#include "server/body/dynamics.hpp"
#include "server/body/skin.hpp"
#include "server/body/surface_stiffness.hpp"
#include "server/body/touch_places.hpp"

namespace palpate {

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
  std::vector<Vec3> at, outward;
  for (const PushedPlace& pushed : places) {
    at.push_back(pushed.place);
    outward.push_back(pushed.outward);
  }
  std::vector<double> compliances;
  for (const SurfaceStiffness& found : finger_stiffnesses(scene, at, outward)) compliances.push_back(1 / found.stiffness_n_m);
  return compliances;
}

}  // namespace palpate
