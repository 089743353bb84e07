#include "server/room/nodal_fields.hpp"

#include <Eigen/LU>

#include <algorithm>
#include <cassert>
#include <cmath>

#include "common/mechanics/polar.hpp"
#include "server/elements/spring_material.hpp"
#include "server/operators/local_body.hpp"
#include "server/sampling/element_gradient.hpp"

namespace palpate {

std::vector<float> element_tension(const LumpedBody& body, const Vector& x) {
  assert(x.size() == 3 * static_cast<Eigen::Index>(body.nodes.size()));
  std::vector<float> largest(body.nodes.size(), 0.0F);
  const SpringMaterial law(body);
  for (const Element& element : body.elements) {
    const auto at = [&](std::uint32_t node) { return x.segment<3>(3 * static_cast<Eigen::Index>(node)); };
    const double elongation = (at(element.b) - at(element.a)).norm() - element.rest_length_m;
    double tension, slope;
    law.respond(element.stiffness_n_m, element.rest_length_m, elongation, tension, slope);
    for (const std::uint32_t node : {element.a, element.b})
      largest[node] = std::max(largest[node], static_cast<float>(std::abs(tension)));
  }
  return largest;
}

namespace {

/// `relaxed`: the relaxed part of the second Piola-Kirchhoff stress.
double value_of(const ElementMaterial& material, const Mat3& f, const Mat3& relaxed, ShapeChannel field) {
  if (field == ShapeChannel::strain) return (signed_svd(f).s.array() - 1).abs().maxCoeff();
  const Mat3 cauchy = (elastic_stress(material, f) - f * relaxed) * f.transpose() / std::max(f.determinant(), kVolumeRatioLeast);
  const double mean = cauchy.trace() / 3;
  if (field == ShapeChannel::pressure) return -mean;
  return std::sqrt(1.5) * (cauchy - mean * Mat3::Identity()).norm();
}

}  // namespace

std::vector<float> nodal_field(const Dynamics& dynamics, const BodyState& state, ShapeChannel field) {
  if (field == ShapeChannel::tension) return element_tension(dynamics.body(), state.x);
  assert(field == ShapeChannel::stress || field == ShapeChannel::strain || field == ShapeChannel::pressure);
  std::vector<double> sums(dynamics.nodes(), 0.0), volumes(sums);
  const LumpedBody& body = dynamics.body();
  const std::vector<ElementMaterial> materials(body.materials.begin(), body.materials.end());
  for (std::uint32_t e = 0; body.is_solid() && e < elements_of(body); ++e) {
    const ElementGradient element = element_gradient(dynamics, e);
    if (materials[element.material].kind == SolidLaw::membrane) continue;
    const double value = value_of(materials[element.material], mean_gradient(dynamics, e, state.x),
                                  dynamics.relaxation().relaxed_stress(state, e), field);
    for (const std::uint32_t node : element.nodes) {
      sums[node] = field == ShapeChannel::pressure ? sums[node] + element.volume_m3 * value : std::max(sums[node], value);
      volumes[node] += element.volume_m3;
    }
  }
  std::vector<float> values(sums.size(), 0.0F);
  for (std::size_t i = 0; i < sums.size(); ++i)
    if (volumes[i] > 0) values[i] = static_cast<float>(field == ShapeChannel::pressure ? sums[i] / volumes[i] : sums[i]);
  return values;
}

std::vector<float> at_vertices(const LumpedBody& body, std::vector<float> of_nodes) {
  for (const EmbeddedVertex& vertex : body.embedded) {
    double sum = 0;
    for (const auto& [node, weight] : vertex.weights) sum += weight * static_cast<double>(of_nodes[node]);
    of_nodes.push_back(static_cast<float>(sum));
  }
  return of_nodes;
}

void add_support(const Patch& patch, std::span<const Vec3> positions, std::vector<float>& support) {
  assert(support.size() == positions.size());
  constexpr double kSamePointM = 1e-9;  // a patch's vertices are the body's own, up to rounding
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
