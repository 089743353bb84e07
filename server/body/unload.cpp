#include "server/body/unload.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>

#include "common/base/error.hpp"
#include "server/body/settle.hpp"

namespace palpate {
namespace {

constexpr int kTriesMax = 60;
constexpr double kShareLeast = 1.0 / 64;

bool has_volume(const LumpedBody& body) {
  const auto det = [&](std::uint32_t at, std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    const Vec3& origin = body.nodes[at];
    return (body.nodes[a] - origin).cross(body.nodes[b] - origin).dot(body.nodes[c] - origin);
  };
  return std::all_of(
             body.tetrahedra.begin(), body.tetrahedra.end(),
             [&](const Tetrahedron& t) { return t.is_triangle() || det(t.nodes[0], t.nodes[1], t.nodes[2], t.nodes[3]) > 0; }) &&
         std::all_of(body.hexahedra.begin(), body.hexahedra.end(), [&](const Hexahedron& h) {
           return det(h.nodes[0], h.nodes[1], h.nodes[2], h.nodes[4]) > 0 &&
                  det(h.nodes[7], h.nodes[6], h.nodes[5], h.nodes[3]) < 0;
         });
}

}  // namespace

LumpedBody unloaded(LumpedBody body, const std::string& where) {
  if (!body.is_loaded) return body;
  body.is_loaded = false;
  const std::vector<Vec3> given = body.nodes;
  const double enough_m = kUnloadedTo * mean_edge_m(body);
  LumpedBody best = body;
  std::vector<Vec3> way;  // from the equilibrium to the wanted shape
  double off_m = 0, share = 1;
  for (int k = 0; k < kTriesMax && share >= kShareLeast; ++k) {
    if (!way.empty()) {
      body = best;
      for (std::size_t i = 0; i < way.size(); ++i) body.nodes[i] += share * way[i];
      for (Element& e : body.elements) e.rest_length_m = (body.nodes[e.b] - body.nodes[e.a]).norm();
    }
    if (has_volume(body)) {
      const Dynamics dynamics(body);
      BodyState from = dynamics.rest_state();
      for (std::uint32_t i = 0; i < given.size(); ++i) at_node(from.x, i) = given[i];
      const Equilibrium hangs = find_equilibrium(dynamics, from);
      double farthest_m = 0;
      std::vector<Vec3> ways;
      for (std::uint32_t i = 0; i < given.size(); ++i) {
        ways.push_back(given[i] - at_node(hangs.state.x, i));
        farthest_m = std::max(farthest_m, ways.back().norm());
      }
      if (hangs.found && farthest_m <= enough_m) return body;
      if (hangs.found && (way.empty() || farthest_m < off_m)) {
        best = body;
        way = std::move(ways);
        off_m = farthest_m;
        share = std::min(1.0, 2 * share);
        continue;
      }
      if (way.empty()) break;
    }
    share /= 2;
  }
  throw InputError(where,
                   way.empty()
                       ? std::string("finds no equilibrium in gravity")
                       : fmt::format("has no shape free of stress that hangs as it is given: {:.3g} mm off at best", 1e3 * off_m),
                   "a body that is stiff enough for its weight, or reference_configuration \"stress-free\"");
}

Scene opened(Scene scene, const std::string& where) {
  scene.body = unloaded(std::move(scene.body), where + ": body.reference_configuration");
  return scene;
}

Scene open_scene(const std::filesystem::path& file, const MeshFolders& besides) {
  return opened(load_scene(file, besides), file.string());
}

}  // namespace palpate
