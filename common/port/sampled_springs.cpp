#include "common/port/sampled_springs.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

constexpr double kLengthMin = 1e-6;  // below, a spring has no direction [m]

/// Largest eigenvalue of the part that belongs to the modes [1/s^2].
double stiffest(const Eigen::MatrixXd& stiffness, int tool) {
  const Eigen::Index modes = stiffness.cols() - tool;
  return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(stiffness.bottomRightCorner(modes, modes), Eigen::EigenvaluesOnly)
      .eigenvalues()
      .tail<1>()[0];
}

/// Sum over rows of weight row^T row.
Eigen::MatrixXd weighted(const Eigen::ArrayXd& weights, const Eigen::MatrixXd& rows) {
  return rows.transpose() * weights.matrix().asDiagonal() * rows;
}

}  // namespace

SampledForce::SampledForce(const SampledSprings& springs, int tool, const Eigen::VectorXd& rate, double tick_s)
    : variables_(static_cast<int>(springs.motion.cols())), stiffening_(static_cast<double>(springs.stiffening)) {
  const int m = springs.count();
  if (m == 0 || variables_ <= tool) return;
  rows_x_.resize(m, variables_);
  rows_y_.resize(m, variables_);
  rows_z_.resize(m, variables_);
  for (int e = 0; e < m; ++e) {
    rows_x_.row(e) = springs.motion.row(3 * e).cast<double>();
    rows_y_.row(e) = springs.motion.row(3 * e + 1).cast<double>();
    rows_z_.row(e) = springs.motion.row(3 * e + 2).cast<double>();
  }
  span_ = {springs.span.row(0).transpose().cast<double>().array(), springs.span.row(1).transpose().cast<double>().array(),
           springs.span.row(2).transpose().cast<double>().array()};
  rest_length_ = springs.rest_length.cast<double>().array();
  stiffness_ = springs.stiffness.cast<double>().array();
  damping_ = springs.damping.cast<double>().array();
  const double stable = kStiffest / (tick_s * tick_s);
  const double most =
      stable /
      std::max(stiffest(weighted(stiffness_, rows_x_) + weighted(stiffness_, rows_y_) + weighted(stiffness_, rows_z_), tool),
               1e-6);
  if (!(most >= 1)) return;
  if (stiffening_ > 0) straight_from_ = std::sqrt((most - 1) / (3 * stiffening_));
  length_ = span_.dot(span_).sqrt().max(kLengthMin);
  axis_ = {span_.x / length_, span_.y / length_, span_.z / length_};
  const Each elongation = length_ - rest_length_;
  tension_ = tension(elongation);
  across_ = tension_ / length_;
  along_ = slope(elongation) - across_;
  stored_ = stored(elongation);
  if (!(stiffest(far_stiffness(), tool) <= stable)) return;
  count_ = m;
  const Each braked = damping_ * axis_.dot(moved(rate)) / length_;
  braked_.resize(variables_, variables_);
  for (int i = 0; i < variables_; ++i) {
    const Vectors delta = moved(Exact::Unit(variables_, i));
    const Each along = axis_.dot(delta);
    braked_.col(i) = collect(
        {braked * (delta.x - along * axis_.x), braked * (delta.y - along * axis_.y), braked * (delta.z - along * axis_.z)});
  }
}

Eigen::MatrixXd SampledForce::far_stiffness() const {
  const Eigen::MatrixXd x = rows_x_, y = rows_y_, z = rows_z_;
  const Eigen::MatrixXd along =
      axis_.x.matrix().asDiagonal() * x + axis_.y.matrix().asDiagonal() * y + axis_.z.matrix().asDiagonal() * z;
  const Each left = stiffness_ - across_;
  return weighted(left, x) + weighted(left, y) + weighted(left, z) - weighted(along_, along);
}

SampledForce::Vectors SampledForce::moved(const Exact& u) const noexcept {
  return {(rows_x_ * u).array(), (rows_y_ * u).array(), (rows_z_ * u).array()};
}

SampledForce::Exact SampledForce::collect(const Vectors& f) const noexcept {
  Exact g = rows_x_.transpose() * f.x.matrix();
  g.noalias() += rows_y_.transpose() * f.y.matrix();
  g.noalias() += rows_z_.transpose() * f.z.matrix();
  return g;
}

SampledForce::Each SampledForce::tension(const Each& elongation) const noexcept {
  if (stiffening_ == 0) return stiffness_ * elongation;
  const Each strain = elongation / rest_length_, bent = strain.max(-straight_from_).min(straight_from_);
  const Each squared = bent.square();
  // beyond: T of the last strain, and its slope from there on
  return stiffness_ * rest_length_ * (bent * (1 + stiffening_ * squared) + (1 + 3 * stiffening_ * squared) * (strain - bent));
}

SampledForce::Each SampledForce::slope(const Each& elongation) const noexcept {
  if (stiffening_ == 0) return stiffness_;
  const Each bent = (elongation / rest_length_).max(-straight_from_).min(straight_from_);
  return stiffness_ * (1 + 3 * stiffening_ * bent.square());
}

SampledForce::Each SampledForce::stored(const Each& elongation) const noexcept {
  if (stiffening_ == 0) return 0.5 * stiffness_ * elongation.square();
  const Each strain = elongation / rest_length_, bent = strain.max(-straight_from_).min(straight_from_);
  const Each squared = bent.square(), beyond = strain - bent;
  return stiffness_ * rest_length_.square() *
         (0.5 * squared + 0.25 * stiffening_ * squared.square() + bent * (1 + stiffening_ * squared) * beyond +
          0.5 * (1 + 3 * stiffening_ * squared) * beyond.square());
}

void SampledForce::gradient(const Values& u, Values& g) const noexcept {
  const Vectors delta = moved(u.cast<double>()), there{span_.x + delta.x, span_.y + delta.y, span_.z + delta.z};
  const Each length = there.dot(there).sqrt().max(kLengthMin), elongation = length - rest_length_;
  const Each pull = tension(elongation) / length;
  const Each far = axis_.dot(delta), turned = tension_ + along_ * far;
  g = collect({pull * there.x - turned * axis_.x - across_ * delta.x, pull * there.y - turned * axis_.y - across_ * delta.y,
               pull * there.z - turned * axis_.z - across_ * delta.z})
          .cast<float>();
}

double SampledForce::energy(const Values& u) const noexcept {
  const Vectors delta = moved(u.cast<double>()), there{span_.x + delta.x, span_.y + delta.y, span_.z + delta.z};
  const Each elongation = there.dot(there).sqrt().max(kLengthMin) - rest_length_, far = axis_.dot(delta);
  return (stored(elongation) - stored_ - tension_ * far - 0.5 * (along_ * far.square() + across_ * delta.dot(delta))).sum();
}

void SampledForce::damping(const Values& u, const Values& rate, Values& change, Values& at_stamp) const noexcept {
  const Vectors delta = moved(u.cast<double>()), motion = moved(rate.cast<double>()),
                there{span_.x + delta.x, span_.y + delta.y, span_.z + delta.z};
  const Each now = damping_ * there.dot(motion) / there.dot(there).max(kLengthMin * kLengthMin);
  const Each before = damping_ * axis_.dot(motion);
  change = collect({now * there.x - before * axis_.x, now * there.y - before * axis_.y, now * there.z - before * axis_.z})
               .cast<float>();
  at_stamp = (braked_ * u.cast<double>()).cast<float>();
}

}  // namespace palpate
