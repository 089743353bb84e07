#include "server/body/skin.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

namespace palpate {

namespace {

constexpr double kLongestPath = 1.5;  // of a path along edges, relative to the radius

/// Returns the vertices in reach of one, along edges.
std::vector<std::uint32_t> in_reach(const SurfaceView& surface, const std::vector<Vec3>& x, std::uint32_t from, double reach_m) {
  std::map<std::uint32_t, double> found;
  std::set<std::pair<double, std::uint32_t>> next{{0.0, from}};
  while (!next.empty()) {
    const auto [way_m, i] = *next.begin();
    next.erase(next.begin());
    if (!found.try_emplace(i, way_m).second) continue;
    for (std::uint32_t e = surface.first[i]; e < surface.first[i + 1]; ++e)
      for (const std::uint32_t j : surface.triangles[surface.incident[e]]) {
        const double to_m = way_m + (x[j] - x[i]).norm();
        if (to_m <= reach_m && !found.contains(j)) next.emplace(to_m, j);
      }
  }
  std::vector<std::uint32_t> vertices;
  for (const auto& [vertex, way_m] : found) vertices.push_back(vertex);
  return vertices;
}

}  // namespace

Skin::Skin(const LumpedBody& body, double radius_m)
    : body_(&body), surface_(body.triangles, body.vertices()), rest_(vertices_at_rest(body)), smooth_(body.vertices()) {
  for (const Triangle& t : body.triangles) vertices_.insert(vertices_.end(), t.begin(), t.end());
  std::sort(vertices_.begin(), vertices_.end());
  vertices_.erase(std::unique(vertices_.begin(), vertices_.end()), vertices_.end());
  for (const std::uint32_t i : vertices_) {
    box_.extend(rest_[i]);
    double sum = 0;
    const auto average = [&](const std::vector<std::uint32_t>& over) {
      for (const std::uint32_t j : over) {
        const double d = i == j || !(radius_m > 0) ? 0.0 : (rest_[i] - rest_[j]).norm() / radius_m;
        if ((i != j && !(radius_m > 0)) || d >= 1) continue;
        const double weight = (1 - d * d) * (1 - d * d);
        if (body.is_node(j))
          smooth_[i].emplace_back(j, weight);
        else
          for (const auto& [node, share] : body.embedded[j - body.nodes.size()].weights)
            smooth_[i].emplace_back(node, share * weight);
        sum += weight;
      }
    };
    if (body.embedded.empty())
      average(vertices_);
    else
      average(in_reach(surface_.view(), rest_, i, kLongestPath * radius_m));
    for (auto& entry : smooth_[i]) entry.second /= sum;
    if (!body.embedded.empty()) smooth_[i] = merged(std::move(smooth_[i]));
  }
}

void Skin::place(const Vector& x, std::vector<double>& positions) const {
  if (empty()) {
    positions.assign(x.begin(), x.end());
    return;
  }
  if (positions.size() != rest().size()) positions.assign(rest().begin(), rest().end());
  for (const std::uint32_t i : vertices_) {
    Vec3 s = rest_[i];
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
  const double moved_m =
      std::sqrt(3.0) * (x - Eigen::Map<const Vector>(body_->nodes.front().data(), x.size())).cwiseAbs().maxCoeff();
  return box_.exteriorDistance(point) - moved_m;
}

NodeWeights Skin::weights(const SurfacePoint& point) const {
  NodeWeights b;
  const Triangle& t = view().triangles[point.triangle];
  for (std::size_t k = 0; k < 3; ++k)
    for (const auto& [j, weight] : smooth_[t[k]]) b.emplace_back(j, point.weight[static_cast<int>(k)] * weight);
  return merged(std::move(b));
}

Vec3 Skin::position(const SurfacePoint& point, const NodeWeights& b, const Vector& x) const {
  const Triangle& t = view().triangles[point.triangle];
  Vec3 p = Vec3::Zero();
  for (std::size_t k = 0; k < 3; ++k) p += point.weight[static_cast<int>(k)] * rest_[t[k]];
  for (const auto& [j, weight] : b) p += weight * (x.segment<3>(3 * static_cast<Eigen::Index>(j)) - body_->nodes[j]);
  return p;
}

Vec3 gather(const NodeWeights& b, const Vector& y) {
  Vec3 sum = Vec3::Zero();
  for (const auto& [j, weight] : b) sum += weight * y.segment<3>(3 * static_cast<Eigen::Index>(j));
  return sum;
}

void scatter(const NodeWeights& b, const Vec3& f, Vector& y) {
  for (const auto& [j, weight] : b) y.segment<3>(3 * static_cast<Eigen::Index>(j)) += weight * f;
}

}  // namespace palpate
