#include "server/body/touch_places.hpp"

#include <algorithm>

namespace palpate {

std::vector<Vec3> touch_places(const LumpedBody& body, const Vec3& first, std::size_t count) {
  std::vector<Vec3> middles;
  const std::vector<Vec3> at = vertices_at_rest(body);
  for (const auto& [a, b, c] : body.triangles)
    if (!body.is_fixed(a) && !body.is_fixed(b) && !body.is_fixed(c)) middles.emplace_back((at[a] + at[b] + at[c]) / 3);
  std::vector<double> away;
  for (const Vec3& x : middles) away.push_back(-(x - first).squaredNorm());
  std::vector<Vec3> places;
  while (places.size() < std::min(count, middles.size())) {
    const auto farthest = static_cast<std::size_t>(std::max_element(away.begin(), away.end()) - away.begin());
    places.push_back(middles[farthest]);
    for (std::size_t i = 0; i < middles.size(); ++i) {
      const double squared = (middles[i] - places.back()).squaredNorm();
      away[i] = places.size() == 1 ? squared : std::min(away[i], squared);
    }
  }
  return places;
}

}  // namespace palpate
