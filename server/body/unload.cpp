#include "server/body/unload.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "common/base/error.hpp"
#include "server/body/settle.hpp"

namespace palpate {
namespace {

constexpr int kTriesMax = 60;
constexpr double kShareLeast = 1.0 / 64;

bool has_volume(const LumpedBody& body) {
  const auto all_positive = [&](const auto& elements, const auto& volume) {
    return std::all_of(elements.begin(), elements.end(), volume);
  };
  return all_positive(body.tetrahedra,
                      [&](const Tetrahedron& t) {
                        const Vec3& a = body.nodes[t.nodes[0]];
                        return (body.nodes[t.nodes[1]] - a).cross(body.nodes[t.nodes[2]] - a).dot(body.nodes[t.nodes[3]] - a) > 0;
                      }) &&
         all_positive(body.hexahedra, [&](const Hexahedron& h) {
           const auto edge = [&](std::size_t to) { return body.nodes[h.nodes[to]] - body.nodes[h.nodes[0]]; };
           const auto back = [&](std::size_t to) { return body.nodes[h.nodes[to]] - body.nodes[h.nodes[7]]; };
           return edge(1).cross(edge(2)).dot(edge(4)) > 0 && back(6).cross(back(5)).dot(back(3)) < 0;
         });
}

}  // namespace

LumpedBody unloaded(LumpedBody body, const std::string& where) {
  if (!body.is_loaded) return body;
  body.is_loaded = false;
  const std::vector<Vec3> given = body.nodes;
  const double enough_m = kUnloadedTo * mean_edge_m(body);
  LumpedBody best = body;
  std::vector<Vec3> way;  // from where it hangs to where it should
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
                   "a body that is stiff enough for its weight, or given_shape \"stress-free\"");
}

Scene open_scene(const std::filesystem::path& file, const MeshFolders& besides) {
  Scene scene = load_scene(file, besides);
  scene.body = unloaded(std::move(scene.body), file.string() + ": body.given_shape");
  return scene;
}

}  // namespace palpate
