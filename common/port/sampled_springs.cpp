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

/// Sum over springs of weight G^T G, and of weight (n . G)^T (n . G).
Eigen::MatrixXd weighted(const Eigen::ArrayXd& weights, const Eigen::MatrixXd& g) {
  const Eigen::VectorXd of_rows = weights.matrix().transpose().replicate(3, 1).reshaped();
  return g.transpose() * of_rows.asDiagonal() * g;
}
Eigen::MatrixXd weighted_along(const Eigen::ArrayXd& weights, const Eigen::MatrixXd& g, const Eigen::Matrix3Xd& axes) {
  Eigen::MatrixXd along(axes.cols(), g.cols());
  for (Eigen::Index e = 0; e < axes.cols(); ++e) along.row(e) = axes.col(e).transpose() * g.middleRows<3>(3 * e);
  return along.transpose() * weights.matrix().asDiagonal() * along;
}

}  // namespace

Eigen::Matrix3Xf SampledSprings::spans() const {
  Eigen::Matrix3Xf d(3, count());
  for (int e = 0; e < count(); ++e) d.col(e) = position.col(ends(1, e)) - position.col(ends(0, e));
  return d;
}

Eigen::MatrixXf SampledSprings::motions(int tool) const {
  const Eigen::MatrixXf v = motion.rows(tool);
  Eigen::MatrixXf g(3 * count(), v.cols());
  for (int e = 0; e < count(); ++e) g.middleRows<3>(3 * e) = v.middleRows<3>(3 * ends(1, e)) - v.middleRows<3>(3 * ends(0, e));
  return g;
}

SampledForce::SampledForce(const SampledSprings& springs, int tool, const Eigen::VectorXd& rate, double tick_s)
    : variables_(tool + springs.motion.modes()), stiffening_(static_cast<double>(springs.stiffening)) {
  const int m = springs.count(), nodes = springs.motion.nodes();
  if (m == 0 || variables_ <= tool) return;
  const Eigen::MatrixXd v = springs.motion.rows(tool).cast<double>(), g = springs.motions(tool).cast<double>();
  const Eigen::Matrix3Xd d = springs.spans().cast<double>();
  rows_x_ = v(Eigen::seqN(0, nodes, 3), Eigen::all);
  rows_y_ = v(Eigen::seqN(1, nodes, 3), Eigen::all);
  rows_z_ = v(Eigen::seqN(2, nodes, 3), Eigen::all);
  for (int e = 0; e < m; ++e) {
    a_[static_cast<std::size_t>(e)] = static_cast<std::uint8_t>(springs.ends(0, e));
    b_[static_cast<std::size_t>(e)] = static_cast<std::uint8_t>(springs.ends(1, e));
  }
  span_ = {d.row(0).transpose().array(), d.row(1).transpose().array(), d.row(2).transpose().array()};
  rest_length_ = springs.rest_length.cast<double>().array();
  stiffness_ = springs.stiffness.cast<double>().array();
  damping_ = springs.damping.cast<double>().array();
  const double stable = kStiffest / (tick_s * tick_s);
  const Eigen::MatrixXd stretched = weighted(stiffness_, g);
  const double most = stable / std::max(stiffest(stretched, tool), 1e-6);
  if (!(most >= 1)) return;
  if (stiffening_ > 0) straight_from_ = std::sqrt((most - 1) / (3 * stiffening_));
  length_ = span_.dot(span_).sqrt().max(kLengthMin);
  axis_ = {span_.x / length_, span_.y / length_, span_.z / length_};
  const Each elongation = length_ - rest_length_;
  tension_ = tension(elongation);
  across_ = tension_ / length_;
  along_ = slope(elongation) - across_;
  stored_ = stored(elongation);
  Eigen::Matrix3Xd axes(3, m);
  axes << axis_.x.matrix().transpose(), axis_.y.matrix().transpose(), axis_.z.matrix().transpose();
  far_stiffness_ = stretched - weighted(across_, g) - weighted_along(along_, g, axes);
  if (!(stiffest(far_stiffness_, tool) <= stable)) return;
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

SampledForce::Vectors SampledForce::moved(const Exact& u) const noexcept {
  const OfNodes x = rows_x_ * u, y = rows_y_ * u, z = rows_z_ * u;
  const Eigen::Index m = rest_length_.size();
  Vectors delta{Each(m), Each(m), Each(m)};
  for (Eigen::Index e = 0; e < m; ++e) {
    const auto a = a_[static_cast<std::size_t>(e)], b = b_[static_cast<std::size_t>(e)];
    delta.x[e] = x[b] - x[a];
    delta.y[e] = y[b] - y[a];
    delta.z[e] = z[b] - z[a];
  }
  return delta;
}

SampledForce::Exact SampledForce::collect(const Vectors& f) const noexcept {
  OfNodes x = OfNodes::Zero(rows_x_.rows()), y = x, z = x;
  for (Eigen::Index e = 0; e < rest_length_.size(); ++e) {
    const auto a = a_[static_cast<std::size_t>(e)], b = b_[static_cast<std::size_t>(e)];
    x[a] -= f.x[e];
    y[a] -= f.y[e];
    z[a] -= f.z[e];
    x[b] += f.x[e];
    y[b] += f.y[e];
    z[b] += f.z[e];
  }
  Exact g = rows_x_.transpose() * x;
  g.noalias() += rows_y_.transpose() * y;
  g.noalias() += rows_z_.transpose() * z;
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
