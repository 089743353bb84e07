#include "server/room/nodal_fields.hpp"

#include <algorithm>
#include <cmath>

#include "server/body/element_kernel.hpp"

namespace palpate {

std::vector<float> element_tension(const LumpedBody& body, const Vector& x) {
  std::vector<float> largest(body.nodes.size(), 0.0F);
  for (const Element& element : body.elements) {
    const auto at = [&](std::uint32_t node) { return x.segment<3>(3 * static_cast<Eigen::Index>(node)); };
    const double elongation = (at(element.b) - at(element.a)).norm() - element.rest_length_m;
    const auto tension = static_cast<float>(std::abs(spring_response(body.law, body.stiffening, element, elongation).tension));
    for (const std::uint32_t node : {element.a, element.b}) largest[node] = std::max(largest[node], tension);
  }
  return largest;
}

void add_support(const Patch& patch, std::span<const Vec3> positions, std::vector<float>& support) {
  constexpr double kSamePointM = 1e-9;  // a patch's vertices are the body's own
  const auto count = static_cast<std::size_t>(patch.surface.vertex_count);
  double most = 0;
  for (std::size_t i = 0; i < count; ++i) most = std::max(most, patch.surface.vertices[i].rows.norm());
  if (!(most > 0)) return;
  for (std::size_t i = 0; i < count; ++i) {
    const auto& vertex = patch.surface.vertices[i];
    const auto node = std::find_if(positions.begin(), positions.end(), [&](const Vec3& x) {
      return (x - vertex.position).squaredNorm() < kSamePointM * kSamePointM;
    });
    if (node == positions.end()) continue;
    float& value = support[static_cast<std::size_t>(node - positions.begin())];
    value = std::max(value, static_cast<float>(vertex.rows.norm() / most));
  }
}

}  // namespace palpate
