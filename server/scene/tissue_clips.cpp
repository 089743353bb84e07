#include "server/scene/tissue_clips.hpp"

#include <fmt/format.h>

namespace palpate {

void add_clips(LumpedBody& body, const std::vector<TissueClipSettings>& clips, const SceneText& text) {
  if (clips.empty()) return;
  const std::size_t others = body.elements.size();
  const auto edges = edges_of(body);
  for (std::size_t k = 0; k < clips.size(); ++k) {
    const TissueClipSettings& clip = clips[k];
    std::vector<std::pair<std::uint32_t, std::uint32_t>> held;
    const auto is_near = [&](std::uint32_t node) { return (body.nodes[node] - clip.at_m).norm() <= clip.radius_m; };
    for (std::size_t i = others; i < edges.size(); ++i)
      if (is_near(edges[i].first) && is_near(edges[i].second)) held.push_back(edges[i]);
    const std::string path = "body.clips[" + std::to_string(k) + "]";
    if (held.empty())
      text.refuse(path + ".radius_m", path + " has no two nodes of a cell in reach",
                  fmt::format("a radius of more than {:.4g} m, or another at_m", mean_edge_m(body)));
    const auto share = 1 / static_cast<double>(held.size());
    for (const auto& [a, b] : held)
      body.elements.push_back(
          {a, b, (body.nodes[a] - body.nodes[b]).norm(), share * clip.stiffness_n_m, share * clip.damping_n_s_m});
  }
}

}  // namespace palpate
