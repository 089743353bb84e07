#include "server/body/skin.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <optional>
#include <utility>

namespace palpate {

namespace {

constexpr double kLongestPath = 1.5;  // of a path along edges, relative to the radius

}  // namespace

/// Vertices in reach of one along the edges of a surface.
class Skin::Reach {
 public:
  Reach(const SurfaceView& surface, const std::vector<Vec3>& x)
      : x_(x), way_m_(x.size()), is_far_(x.size(), 0), seen_(x.size(), 0) {
    first_.push_back(0);
    to_.reserve(2 * surface.incident.size());
    for (std::uint32_t i = 0; i < x.size(); ++i) {
      const std::size_t begin = to_.size();
      for (std::uint32_t e = surface.first[i]; e < surface.first[i + 1]; ++e)
        for (const std::uint32_t j : surface.triangles[surface.incident[e]])
          if (j != i && std::find(to_.begin() + static_cast<std::ptrdiff_t>(begin), to_.end(), j) == to_.end()) to_.push_back(j);
      for (std::size_t k = begin; k < to_.size(); ++k) length_m_.push_back((x[to_[k]] - x[i]).norm());
      first_.push_back(to_.size());
    }
  }

  /// Returns those nearer than `radius_m` to which a path of kLongestPath times that at most leads, ascending. The shortest
  /// ways are the least ones that fit each other, in whatever order they are found: a queue takes less time than a heap.
  const std::vector<std::uint32_t>& from(std::uint32_t start, double radius_m) {
    constexpr double kSlack = 1e-9;  // what is left out is left out by more than rounding
    const double reach_m = kLongestPath * radius_m, near_m2 = (1 + kSlack) * radius_m * radius_m;
    // A path that goes farther away than this is too long when it has come back into the radius.
    const double furthest_m2 = 0.25 * (1 + kLongestPath) * (1 + kLongestPath) * near_m2;
    ++search_;
    found_.clear();
    next_.clear();
    const auto reached = [&](std::uint32_t j, double way_m) {
      if (way_m > reach_m || (seen_[j] == search_ && way_m_[j] <= way_m)) return;
      if (seen_[j] != search_) {
        seen_[j] = search_;
        const double away_m2 = (x_[j] - x_[start]).squaredNorm();
        is_far_[j] = away_m2 > furthest_m2 ? 1 : 0;
        if (away_m2 <= near_m2) found_.push_back(j);
      }
      way_m_[j] = way_m;
      if (is_far_[j] == 0) next_.emplace_back(j, way_m);
    };
    reached(start, 0);
    for (std::size_t n = 0; n < next_.size(); ++n) {
      const auto [i, way_m] = next_[n];
      if (way_m > way_m_[i]) continue;
      for (std::size_t k = first_[i]; k < first_[i + 1]; ++k) reached(to_[k], way_m + length_m_[k]);
    }
    std::sort(found_.begin(), found_.end());
    return found_;
  }

 private:
  const std::vector<Vec3>& x_;
  std::vector<std::size_t> first_;  // edges of each vertex
  std::vector<std::uint32_t> to_;
  std::vector<double> length_m_, way_m_;
  std::vector<std::uint8_t> is_far_;
  std::vector<std::uint32_t> seen_;  // the last search that reached each vertex
  std::uint32_t search_ = 0;
  std::vector<std::uint32_t> found_;
  std::vector<std::pair<std::uint32_t, double>> next_;
};

namespace {

/// Adds a weight to that of its node; `row` has each node once.
void add_to_row(std::uint32_t node, double weight, std::vector<double>& of_node, NodeWeights& row) {
  if (of_node[node] == 0) row.emplace_back(node, 0.0);
  of_node[node] += weight;
}

/// Returns the triangles of `copies` copies with this number of vertices each.
std::vector<Triangle> in_copies(const std::vector<Triangle>& triangles, std::size_t copies, std::size_t vertices) {
  std::vector<Triangle> all = triangles;
  for (std::size_t copy = 1; copy < copies; ++copy)
    for (Triangle t : triangles) {
      for (std::uint32_t& corner : t) corner += static_cast<std::uint32_t>(copy * vertices);
      all.push_back(t);
    }
  return all;
}

}  // namespace

Skin::Skin(const LumpedBody& body, std::span<const double> radii_m)
    : body_(&body),
      copies_(radii_m.size()),
      surface_(in_copies(body.triangles, radii_m.size(), body.vertices()), radii_m.size() * body.vertices()),
      rest_(vertices_at_rest(body)) {
  assert(!radii_m.empty());
  for (const Triangle& t : body.triangles) vertices_.insert(vertices_.end(), t.begin(), t.end());
  std::sort(vertices_.begin(), vertices_.end());
  vertices_.erase(std::unique(vertices_.begin(), vertices_.end()), vertices_.end());
  for (const std::uint32_t i : vertices_) box_.extend(rest_[i]);
  if (copies_ > 1) one_ = Surface(body.triangles, body.vertices());
  std::optional<Reach> reach;
  if (!body.embedded.empty() || !body.members.empty()) reach.emplace(one(), rest_);
  for (const double radius_m : radii_m) add_copy(radius_m, reach ? &*reach : nullptr);
  const std::vector<Vec3> rest = rest_;
  const std::vector<std::uint32_t> vertices = vertices_;
  for (std::size_t k = 1; k < copies_; ++k) {
    rest_.insert(rest_.end(), rest.begin(), rest.end());
    for (const std::uint32_t i : vertices) vertices_.push_back(static_cast<std::uint32_t>(k * rest.size()) + i);
  }
}

/// Appends the rows of S of a copy. `reach`: null where all vertices around count.
void Skin::add_copy(double radius_m, Reach* reach) {
  const std::size_t first = smooth_.size();
  smooth_.resize(first + rest_.size());
  std::vector<double> of_node(reach ? body_->nodes.size() : 0, 0.0);  // of a cut body, the row of S that is made
  NodeWeights row;
  for (const std::uint32_t i : vertices_) {
    row.clear();
    double sum = 0;
    const auto average = [&](const std::vector<std::uint32_t>& over) {
      for (const std::uint32_t j : over) {
        const double d = i == j || !(radius_m > 0) ? 0.0 : (rest_[i] - rest_[j]).norm() / radius_m;
        if ((i != j && !(radius_m > 0)) || d >= 1) continue;
        const double weight = (1 - d * d) * (1 - d * d);
        if (!reach)
          row.emplace_back(j, weight);
        else if (body_->is_node(j))
          add_to_row(j, weight, of_node, row);
        else
          for (const auto& [node, share] : body_->embedded[j - body_->nodes.size()].weights)
            add_to_row(node, share * weight, of_node, row);
        sum += weight;
      }
    };
    average(reach ? reach->from(i, radius_m) : vertices_);
    if (reach && !std::is_sorted(row.begin(), row.end())) std::sort(row.begin(), row.end());
    for (auto& [node, weight] : row) weight = (reach ? std::exchange(of_node[node], 0.0) : weight) / sum;
    smooth_[first + i] = row;
  }
}

NearestPoint Skin::nearest(std::size_t copy, Positions positions, const Vec3& query) const {
  const std::size_t vertices = this->vertices();
  NearestPoint nearest = nearest_point(one(), positions.subspan(3 * copy * vertices, 3 * vertices), query);
  nearest.point.triangle += first_triangle(copy);
  return nearest;
}

bool Skin::holds(const Vec3& at_rest) const {
  constexpr double kHalf = 0.5;
  return winding_number(one(), rest().first(3 * vertices()), at_rest) > kHalf;
}

Onset Skin::look_for_contact(std::size_t copy, Positions positions, const Vec3& tool, double radius_m,
                             Clearance& clearance) const {
  const std::size_t vertices = this->vertices();
  const std::uint32_t first = first_triangle(copy);
  if (clearance.known) clearance.point.triangle -= first;
  Onset onset = palpate::look_for_contact(one(), positions.subspan(3 * copy * vertices, 3 * vertices), tool, radius_m, clearance);
  if (clearance.known) clearance.point.triangle += first;
  onset.nearest.point.triangle += first;
  return onset;
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
