#include "server/body/skin.hpp"

#include <algorithm>
#include <cmath>

namespace palpate {

Skin::Skin(const LumpedBody& body, double radius_m)
    : body_(&body), surface_(body.triangles, body.nodes.size()), smooth_(body.nodes.size()) {
  for (const Triangle& t : body.triangles) vertices_.insert(vertices_.end(), t.begin(), t.end());
  std::sort(vertices_.begin(), vertices_.end());
  vertices_.erase(std::unique(vertices_.begin(), vertices_.end()), vertices_.end());
  for (const std::uint32_t i : vertices_) {
    box_.extend(body.nodes[i]);
    double sum = 0;
    for (const std::uint32_t j : vertices_) {
      const double d = i == j || !(radius_m > 0) ? 0.0 : (body.nodes[i] - body.nodes[j]).norm() / radius_m;
      if ((i != j && !(radius_m > 0)) || d >= 1) continue;
      const double weight = (1 - d * d) * (1 - d * d);
      smooth_[i].emplace_back(j, weight);
      sum += weight;
    }
    for (auto& entry : smooth_[i]) entry.second /= sum;
  }
}

void Skin::place(const Vector& x, std::vector<double>& positions) const {
  if (positions.size() != static_cast<std::size_t>(x.size())) positions.assign(rest().begin(), rest().end());
  for (const std::uint32_t i : vertices_) {
    Vec3 s = body_->nodes[i];
    for (const auto& [j, weight] : smooth_[i]) s += weight * (x.segment<3>(3 * static_cast<Eigen::Index>(j)) - body_->nodes[j]);
    Eigen::Map<Vec3>(positions.data() + 3 * std::size_t{i}) = s;
  }
}

std::vector<double> Skin::place(const Vector& x) const {
  std::vector<double> positions;
  place(x, positions);
  return positions;
}

double Skin::distance_at_least(const Vec3& point, const Vector& x) const {
  const double moved_m = std::sqrt(3.0) * (x - Eigen::Map<const Vector>(rest().data(), x.size())).cwiseAbs().maxCoeff();
  return box_.exteriorDistance(point) - moved_m;
}

Skin::Weights Skin::weights(const SurfacePoint& point) const {
  Weights b;
  const Triangle& t = view().triangles[point.triangle];
  for (std::size_t k = 0; k < 3; ++k)
    for (const auto& [j, weight] : smooth_[t[k]]) b.emplace_back(j, point.weight[static_cast<int>(k)] * weight);
  std::sort(b.begin(), b.end());
  Weights merged;
  for (const auto& [j, weight] : b) {
    if (!merged.empty() && merged.back().first == j)
      merged.back().second += weight;
    else if (weight > 0)
      merged.emplace_back(j, weight);
  }
  return merged;
}

Vec3 Skin::position(const SurfacePoint& point, const Weights& b, const Vector& x) const {
  const Triangle& t = view().triangles[point.triangle];
  Vec3 p = Vec3::Zero();
  for (std::size_t k = 0; k < 3; ++k) p += point.weight[static_cast<int>(k)] * body_->nodes[t[k]];
  for (const auto& [j, weight] : b) p += weight * (x.segment<3>(3 * static_cast<Eigen::Index>(j)) - body_->nodes[j]);
  return p;
}

Vec3 gather(const Skin::Weights& b, const Vector& y) {
  Vec3 sum = Vec3::Zero();
  for (const auto& [j, weight] : b) sum += weight * y.segment<3>(3 * static_cast<Eigen::Index>(j));
  return sum;
}

void scatter(const Skin::Weights& b, const Vec3& f, Vector& y) {
  for (const auto& [j, weight] : b) y.segment<3>(3 * static_cast<Eigen::Index>(j)) += weight * f;
}

}  // namespace palpate
