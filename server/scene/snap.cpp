#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "server/scene/clip.hpp"

namespace palpate {

namespace {

constexpr int kSmoothingSteps = 12;
constexpr double kSmoothing = 0.5;  // share of the way to the mean of the neighbours, per step
constexpr double kMaxMove = 1.0;    // [spacings]
constexpr int kRimSteps = 8;
constexpr int kInteriorSweeps = 40;

class Snapper {
 public:
  Snapper(Clipped& body, const Grid& grid, const SignedDistance& solid)
      : grid_(grid),
        number_(body.nodes.number),
        solid_(solid),
        x_(body.nodes.positions),
        start_(x_),
        reach_(kMaxMove * grid.spacing().minCoeff()) {
    classify(body.faces);
  }

  void run() {
    for (int step = 0; step <= kSmoothingSteps; ++step) move_outside(step > 0 ? kSmoothing : 0.0);
    move_inside();
  }

 private:
  /// Collects outer nodes, their neighbours along the edges of faces, and the axes along which they may not move.
  void classify(std::span<const BoundaryFace> faces) {
    const std::size_t n = x_.size();
    outside_.assign(n, 0);
    on_shape_.assign(n, 0);
    held_axes_.assign(n, 0);
    around_.assign(n, {});
    for (const BoundaryFace& face : faces) {
      for (std::size_t i = 0; i < 4; ++i) {
        const auto a = face.corners[i], b = face.corners[(i + 1) % 4];
        outside_[a] = 1;
        if (face.wall < 0) {
          on_shape_[a] = 1;
        } else {
          held_axes_[a] = static_cast<std::uint8_t>(held_axes_[a] | 1 << face.wall);
        }
        around_[a].push_back(b);
        around_[b].push_back(a);
      }
    }
  }

  bool on_rim(std::size_t i) const { return on_shape_[i] && held_axes_[i]; }

  Vec3 held(std::size_t i, Vec3 p) const {
    for (int a = 0; a < 3; ++a) {
      if (held_axes_[i] >> a & 1) p[a] = start_[i][a];
    }
    return p;
  }

  /// Mean of the neighbours along the surface. On the rim of a flat cut only rim nodes count, as the others would pull it
  /// inwards.
  Vec3 mean_around(std::size_t i) const {
    Vec3 sum = Vec3::Zero();
    int count = 0;
    for (const auto j : around_[i]) {
      if (on_rim(i) && !on_rim(j)) continue;
      sum += x_[j];
      ++count;
    }
    return count > 0 ? Vec3(sum / count) : x_[i];
  }

  void move_outside(double smoothing) {
    std::vector<Vec3> next = x_;
    for (std::size_t i = 0; i < x_.size(); ++i) {
      if (!outside_[i]) continue;
      Vec3 p = held(i, x_[i] + smoothing * (mean_around(i) - x_[i]));
      for (int step = 0; on_shape_[i] && step < (on_rim(i) ? kRimSteps : 1); ++step) p = held(i, solid_.nearest(p));
      const Vec3 move = p - start_[i];
      next[i] = start_[i] + move * std::min(1.0, reach_ / std::max(move.norm(), 1e-12));
    }
    x_ = std::move(next);
  }

  /// Carries the moves of outer nodes inwards: every inner move becomes the mean of its neighbours' moves.
  void move_inside() {
    for (int sweep = 0; sweep < kInteriorSweeps; ++sweep) {
      grid_.each([&](const Index3& n) {
        const auto i = number_[grid_.index(n)];
        if (i == kNoNode || outside_[i]) return;
        Vec3 sum = Vec3::Zero();
        for (std::size_t a = 0; a < 3; ++a) {
          for (const int d : {-1, 1}) {
            Index3 neighbour = n;
            neighbour[a] += d;
            const auto j = number_[grid_.index(neighbour)];
            sum += x_[j] - start_[j];
          }
        }
        x_[i] = start_[i] + sum / 6;
      });
    }
  }

  const Grid& grid_;
  const std::vector<std::uint32_t>& number_;
  const SignedDistance& solid_;
  std::vector<Vec3>& x_;
  const std::vector<Vec3> start_;
  const double reach_;
  std::vector<std::uint8_t> outside_, on_shape_, held_axes_;
  std::vector<std::vector<std::uint32_t>> around_;
};

}  // namespace

void snap_to_surface(Clipped& body, const Grid& grid, const SignedDistance& solid) { Snapper(body, grid, solid).run(); }

}  // namespace palpate
