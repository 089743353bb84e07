#include "client/view/camera.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace palpate {
namespace {

constexpr float kTanHalfView = 0.26F;     // vertical half angle of 15 degrees: little perspective distortion
constexpr float kFill = 0.74F;            // share of the picture that the fitted body may cover
constexpr float kInstrumentRoom = 0.24F;  // share of the diagonal, above the box

}  // namespace

Eigen::Matrix3f Camera::axes() const {
  const float ca = std::cos(azimuth_), sa = std::sin(azimuth_), ce = std::cos(elevation_), se = std::sin(elevation_);
  Eigen::Matrix3f m;
  m.col(0) = Vec3f(-sa, ca, 0);
  m.col(2) = Vec3f(ce * ca, ce * sa, se);
  m.col(1) = m.col(2).cross(m.col(0));
  return m;
}

void Camera::fit(std::span<const Triangle> triangles, std::span<const Vec3f> positions, float aspect, float covered) {
  covered_ = covered;
  const Box box = bounds(triangles, positions);
  size_ = box.diagonal();
  const Vec3f instrument(box.center().x(), box.center().y(), box.high.z() + kInstrumentRoom * size_);
  target_ = Vec3f(box.center().x(), box.center().y(), 0.5F * (box.low.z() + instrument.z()));
  const Eigen::Matrix3f axis = axes();
  distance_ = 0;
  const auto include = [&](const Vec3f& p) {
    const Vec3f q = axis.transpose() * (p - target_);
    const float half = std::max(std::abs(q.x()) / (aspect * (1 - covered)), std::abs(q.y()));
    distance_ = std::max(distance_, half / (kFill * kTanHalfView) + q.z());
  };
  include(instrument);
  for (const Triangle& t : triangles) {
    for (const std::uint32_t i : t) include(positions[i]);
  }
  distance_ /= nearer_;
}

void Camera::look_from(Side side) {
  constexpr float kQuarter = std::numbers::pi_v<float> / 2;
  azimuth_ = side == Side::side ? 0.0F : side == Side::three_quarter ? kAzimuth : -kQuarter;
  elevation_ = side == Side::top ? kQuarter : side == Side::three_quarter ? kElevation : 0.05F;
}

void Camera::orbit(float dx, float dy) {
  constexpr float kPi = std::numbers::pi_v<float>;
  azimuth_ = std::remainder(azimuth_ - dx * kPi, 2 * kPi);
  elevation_ = std::clamp(elevation_ + dy * kPi, -kPi / 2, kPi / 2);
}

void Camera::pan(float dx, float dy) {
  const Eigen::Matrix3f axis = axes();
  target_ += 2 * kTanHalfView * distance_ * (dy * axis.col(1) - dx * axis.col(0));
}

void Camera::zoom(float steps) { distance_ = std::clamp(distance_ * std::exp(-0.12F * steps), 0.05F * size_, 20.0F * size_); }

Vec3f Camera::eye() const { return target_ + distance_ * axes().col(2); }

Eigen::Matrix4f Camera::view() const {
  Eigen::Matrix4f m = Eigen::Matrix4f::Identity();
  m.topLeftCorner<3, 3>() = axes().transpose();
  m.topRightCorner<3, 1>() = -axes().transpose() * eye();
  return m;
}

Eigen::Matrix4f Camera::projection(float aspect) const {
  const float near = std::max(0.02F * size_, distance_ - 3 * size_), far = distance_ + 8 * size_;
  Eigen::Matrix4f m = Eigen::Matrix4f::Zero();
  m(0, 0) = 1 / (kTanHalfView * aspect);
  m(0, 2) = covered_;  // middle of the free part
  m(1, 1) = 1 / kTanHalfView;
  m(2, 2) = -(far + near) / (far - near);
  m(2, 3) = -2 * far * near / (far - near);
  m(3, 2) = -1;
  return m;
}

Vec3f to_pixels(const Eigen::Matrix4f& view_projection, const Vec3f& point, float width, float height) {
  const Eigen::Vector4f clip = view_projection * point.homogeneous();
  if (!(clip.w() > 0)) return {0, 0, 2};
  return {(0.5F + 0.5F * clip.x() / clip.w()) * width, (0.5F - 0.5F * clip.y() / clip.w()) * height, clip.z() / clip.w()};
}

}  // namespace palpate
