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

namespace {

/// `relaxed`: what has faded of the second Piola-Kirchhoff stress.
double value_of(const TetraMaterial& material, const Mat3& f, const Mat3& relaxed, SolidField field) {
  if (field == SolidField::strain) return (signed_svd(f).s.array() - 1).abs().maxCoeff();
  const Mat3 cauchy = (elastic_stress(material, f) - f * relaxed) * f.transpose() / std::max(f.determinant(), kLeastVolume);
  const double mean = cauchy.trace() / 3;
  if (field == SolidField::pressure) return -mean;
  return std::sqrt(1.5) * (cauchy - mean * Mat3::Identity()).norm();
}

}  // namespace

std::vector<float> solid_field(const Dynamics& dynamics, const BodyState& state, SolidField field) {
  std::vector<double> sums(dynamics.nodes(), 0.0), volumes(sums);
  const auto add = [&](std::span<const std::uint32_t> nodes, std::uint32_t element, const TetraMaterial& material, const Mat3& f,
                       double volume_m3) {
    const double value = value_of(material, f, dynamics.relaxation().relaxed_stress(state, element), field);
    for (const std::uint32_t node : nodes) {
      sums[node] = field == SolidField::pressure ? sums[node] + volume_m3 * value : std::max(sums[node], value);
      volumes[node] += volume_m3;
    }
  };
  const LumpedBody& body = dynamics.body();
  const Tetrahedra& tetrahedra = dynamics.tetrahedra();
  const Hexahedra& hexahedra = dynamics.hexahedra();
  for (std::uint32_t e = 0; e < body.tetrahedra.size(); ++e)
    add(body.tetrahedra[e].nodes, e, tetrahedra.material(e), tetrahedra.gradient(e, state.x), tetrahedra.rest(e).volume_m3);
  for (std::uint32_t e = 0; e < body.hexahedra.size(); ++e)
    add(body.hexahedra[e].nodes, e, hexahedra.material(e), hexahedra.gradient(e, state.x).leftCols<3>(),
        hexahedra.shape(e).rest.volume_m3);
  std::vector<float> values(sums.size(), 0.0F);
  for (std::size_t i = 0; i < sums.size(); ++i)
    if (volumes[i] > 0) values[i] = static_cast<float>(field == SolidField::pressure ? sums[i] / volumes[i] : sums[i]);
  return values;
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
