#include "client/view/cavity.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

namespace palpate {
namespace {

constexpr std::uint32_t kNobody = std::numeric_limits<std::uint32_t>::max();

/// Neighbours of every vertex, each at least once.
struct Neighbours {
  std::vector<std::uint32_t> list, begin;

  Neighbours(std::span<const Triangle> triangles, std::size_t vertices) : begin(vertices + 1, 0) {
    for (const Triangle& t : triangles)
      for (const std::uint32_t i : t) begin[i + 1] += 2;
    for (std::size_t i = 0; i < vertices; ++i) begin[i + 1] += begin[i];
    list.resize(begin[vertices]);
    std::vector<std::uint32_t> next(begin.begin(), begin.end() - 1);
    for (const Triangle& t : triangles)
      for (std::size_t k = 0; k < 3; ++k) {
        list[next[t[k]]++] = t[(k + 1) % 3];
        list[next[t[k]]++] = t[(k + 2) % 3];
      }
  }
  std::span<const std::uint32_t> of(std::uint32_t i) const { return std::span(list).subspan(begin[i], begin[i + 1] - begin[i]); }
};

/// Finds in each direction the vertex whose distance is nearest to the reach.
class Ring {
 public:
  Ring(const Vec3f& normal, float reach_m) : x_(normal.unitOrthogonal()), y_(normal.cross(x_)), reach_m_(reach_m) {
    vertices_.fill(kNobody);
  }
  void offer(std::uint32_t vertex, const Vec3f& to) {
    const float turn = std::atan2(to.dot(y_), to.dot(x_)) / (2 * std::numbers::pi_v<float>)+0.5F;
    const auto sector = std::min(static_cast<std::size_t>(turn * kSectors), kSectors - 1);
    const float miss = std::abs(to.norm() - reach_m_);
    if (vertices_[sector] != kNobody && miss >= misses_[sector]) return;
    vertices_[sector] = vertex;
    misses_[sector] = miss;
  }
  const auto& vertices() const { return vertices_; }

 private:
  static constexpr std::size_t kSectors = Cavity::kSectors;
  Vec3f x_, y_;
  float reach_m_;
  std::array<std::uint32_t, kSectors> vertices_;
  std::array<float, kSectors> misses_{};
};

}  // namespace

void Cavity::prepare(std::span<const Triangle> triangles, std::span<const Vec3f> rest) {
  reach_m_ = kReach * bounds(triangles, rest).diagonal();
  const Neighbours neighbours(triangles, rest.size());
  std::vector<Vec3f> normals;
  update_normals(triangles, rest, normals);
  std::vector<std::uint32_t> visited, seen_by(rest.size(), kNobody);
  around_.clear();
  begin_.assign(1, 0);
  for (std::uint32_t i = 0; i < rest.size(); ++i) {
    Ring ring(normals[i], reach_m_);
    visited.assign(1, i);
    seen_by[i] = i;
    for (std::size_t k = 0; k < visited.size() && visited.size() < kMostVisited; ++k) {
      if ((rest[visited[k]] - rest[i]).norm() > reach_m_) continue;
      for (const std::uint32_t j : neighbours.of(visited[k])) {
        if (std::exchange(seen_by[j], i) == i) continue;
        visited.push_back(j);
        ring.offer(j, rest[j] - rest[i]);
      }
    }
    std::copy_if(ring.vertices().begin(), ring.vertices().end(), std::back_inserter(around_),
                 [](auto j) { return j != kNobody; });
    begin_.push_back(static_cast<std::uint32_t>(around_.size()));
  }
}

void Cavity::measure(std::span<const Vec3f> positions, std::span<const Vec3f> normals, std::vector<float>& cavity) const {
  cavity.assign(positions.size(), 0.0F);
  for (std::size_t i = 0; i < positions.size(); ++i) {
    for (std::uint32_t k = begin_[i]; k < begin_[i + 1]; ++k) {
      const Vec3f to = positions[around_[k]] - positions[i];
      cavity[i] += std::clamp(reach_m_ * normals[i].dot(to) / std::max(to.squaredNorm(), 1e-20F), -1.0F, 1.0F);
    }
    if (begin_[i + 1] > begin_[i]) cavity[i] /= static_cast<float>(begin_[i + 1] - begin_[i]);
  }
}

}  // namespace palpate
