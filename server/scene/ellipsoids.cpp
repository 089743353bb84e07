#include <cmath>
#include <limits>
#include <vector>

#include "server/scene/signed_distance.hpp"

namespace palpate {

namespace {

struct Ellipsoid {
  Vec3 center, radii;
  Mat3 to_world;

  double distance(const Vec3& p) const {
    const Vec3 local = to_world.transpose() * (p - center);
    const Vec3 scaled = local.cwiseQuotient(radii);
    const double k0 = scaled.norm(), k1 = scaled.cwiseQuotient(radii).norm();
    return k1 > 0 ? k0 * (k0 - 1) / k1 : -radii.minCoeff();
  }
  /// Half extent of the bounding box along each world axis.
  Vec3 reach() const { return (to_world * radii.asDiagonal()).rowwise().norm(); }
};

class Ellipsoids final : public SignedDistance {
 public:
  Ellipsoids(std::span<const EllipsoidSettings> parts, double blend) : blend_(blend) {
    for (const auto& e : parts) parts_.push_back({e.center_m, e.radii_m, rotation_xyz(e.rotation_deg)});
  }

  double distance(const Vec3& p) const override {
    double d = parts_[0].distance(p);
    for (std::size_t i = 1; i < parts_.size(); ++i) {
      const double next = parts_[i].distance(p);
      const double h = blend_ > 0 ? std::max(blend_ - std::abs(d - next), 0.0) / blend_ : 0;
      d = std::min(d, next) - 0.25 * h * h * blend_;
    }
    return d;
  }

  Vec3 nearest(const Vec3& start) const override {
    constexpr int kMaxSteps = 12;
    Vec3 p = start;
    for (int i = 0; i < kMaxSteps; ++i) {
      const double d = distance(p);
      const Vec3 slope = gradient(p);
      const double steepness = slope.squaredNorm();
      if (std::abs(d) < 1e-9 || steepness < 1e-6) break;
      p -= d / steepness * slope;
    }
    return p;
  }

  Eigen::AlignedBox3d bounds() const override {
    Eigen::AlignedBox3d box;
    const Vec3 bulge = Vec3::Constant(parts_.size() > 1 ? 0.25 * blend_ : 0);
    for (const Ellipsoid& e : parts_) {
      box.extend(e.center - e.reach() - bulge);
      box.extend(e.center + e.reach() + bulge);
    }
    return box;
  }

 private:
  Vec3 gradient(const Vec3& p) const {
    constexpr double kStep = 1e-6;
    Vec3 g;
    for (int a = 0; a < 3; ++a) {
      const Vec3 d = kStep * Vec3::Unit(a);
      g[a] = (distance(p + d) - distance(p - d)) / (2 * kStep);
    }
    return g;
  }

  std::vector<Ellipsoid> parts_;
  double blend_;
};

}  // namespace

std::unique_ptr<SignedDistance> make_ellipsoids(std::span<const EllipsoidSettings> ellipsoids, double blend_m) {
  return std::make_unique<Ellipsoids>(ellipsoids, blend_m);
}

Mat3 rotation_xyz(const Vec3& degrees) {
  const Vec3 r = degrees * (std::acos(-1.0) / 180);
  using Eigen::AngleAxisd;
  return (AngleAxisd(r[2], Vec3::UnitZ()) * AngleAxisd(r[1], Vec3::UnitY()) * AngleAxisd(r[0], Vec3::UnitX())).toRotationMatrix();
}

}  // namespace palpate
