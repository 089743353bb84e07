#include "server/scene/ligaments.hpp"

#include <fmt/format.h>

#include <limits>

namespace palpate {

void add_ligaments(LumpedBody& body, std::uint32_t first, std::uint32_t end, const std::vector<LigamentSettings>& ligaments,
                   const SceneText& text) {
  for (std::size_t k = 0; k < ligaments.size(); ++k) {
    const LigamentSettings& ligament = ligaments[k];
    std::vector<std::uint32_t> ends;
    double nearest_m = std::numeric_limits<double>::infinity();
    bool ends_there = false;  // true if a node in reach lies at the ligament's other end
    for (std::uint32_t i = first; i < end; ++i) {
      if (body.fixed[i]) continue;
      const double distance_m = (body.nodes[i] - ligament.from_m).norm();
      nearest_m = std::min(nearest_m, distance_m);
      if (distance_m > ligament.radius_m) continue;
      if ((body.nodes[i] - ligament.to_m).norm() > 0)
        ends.push_back(i);
      else
        ends_there = true;
    }
    const std::string path = "body.ligaments[" + std::to_string(k) + "]";
    if (ends.empty() && ends_there)
      text.refuse(path + ".to_m", fmt::format("{} ends on the node that it begins at", path), "a to_m beside the body's nodes");
    if (ends.empty())
      text.refuse(path + ".radius_m", fmt::format("{} reaches no free node of the body", path),
                  fmt::format("a radius of more than {:.4g} m, or another from_m", nearest_m));
    const auto anchor = static_cast<std::uint32_t>(body.nodes.size());
    body.nodes.push_back(ligament.to_m);
    body.fixed.push_back(1);
    body.masses_kg.push_back(body.masses_kg[ends.front()]);  // irrelevant: it never moves
    const auto share = 1 / static_cast<double>(ends.size());
    for (const std::uint32_t i : ends)
      body.elements.push_back(
          {i, anchor, (body.nodes[i] - ligament.to_m).norm(), share * ligament.stiffness_n_m, share * ligament.damping_n_s_m});
  }
}

}  // namespace palpate
