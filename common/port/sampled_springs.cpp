#include "common/port/sampled_springs.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cassert>
#include <cmath>

namespace palpate {
namespace {

constexpr float kSpringLengthMinM = 1e-6F;   // below, a spring has no direction
constexpr double kStiffnessMin_1_s2 = 1e-6;  // so that springs that hold no mode do not divide by 0
constexpr double kCompressionMax = 2;        // limit of L / |d| in the added mass: more would slow motions that matter
constexpr double kStepsPerOctave = 16;       // format: a byte reaches slopes of 2^(255 / 16) = 6e4, to 4 %

/// Returns the largest eigenvalue of the part of the modes, for a mass of 1 plus `added_mass`, if any [1/s^2].
double stiffest(const Eigen::MatrixXd& stiffness, int tool, const Eigen::MatrixXd& added_mass = {}) {
  const Eigen::Index modes = stiffness.cols() - tool;
  Eigen::MatrixXd mass = Eigen::MatrixXd::Identity(modes, modes);
  if (added_mass.size() > 0) mass += added_mass;
  return Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd>(stiffness.bottomRightCorner(modes, modes), mass,
                                                                   Eigen::EigenvaluesOnly)
      .eigenvalues()
      .tail<1>()[0];
}

/// Returns the sum over springs of weight G^T G, or of weight (n . G)^T (n . G).
Eigen::MatrixXd weighted(const Eigen::ArrayXd& weights, const Eigen::MatrixXd& g) {
  assert(g.rows() == 3 * weights.size());
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

Eigen::ArrayXd SampledSprings::steepest() const {
  Eigen::ArrayXd slopes = Eigen::ArrayXd::Ones(count());
  for (std::size_t e = 0; e < max_slope.size(); ++e)
    slopes[static_cast<Eigen::Index>(e)] = std::exp2(max_slope[e] / kStepsPerOctave);
  return slopes;
}

std::vector<std::uint8_t> SampledSprings::steep_of(const Eigen::ArrayXd& slopes) {
  assert(slopes.size() == 0 || slopes.allFinite());
  std::vector<std::uint8_t> max_slope;
  for (const double slope : slopes)
    max_slope.push_back(
        static_cast<std::uint8_t>(std::clamp(std::ceil(kStepsPerOctave * std::log2(std::max(1.0, slope))), 0.0, 255.0)));
  return max_slope;
}

Eigen::MatrixXf SampledSprings::motions(int tool) const {
  assert(tool == 0 || tool == 3);
  const Eigen::MatrixXf v = motion.rows(tool);
  Eigen::MatrixXf g(3 * count(), v.cols());
  for (int e = 0; e < count(); ++e) g.middleRows<3>(3 * e) = v.middleRows<3>(3 * ends(1, e)) - v.middleRows<3>(3 * ends(0, e));
  return g;
}

SampledForce::SampledForce(const SampledSprings& springs, int tool, const Eigen::VectorXd& rate, double step_s, bool slowed)
    : variables_(tool + springs.motion.modes()) {
  const int m = springs.count();
  if (m == 0 || variables_ <= tool) return;
  assert(m <= kMaxSprings && variables_ <= kMaxVariables && rate.size() == variables_ && step_s > 0);
  const Eigen::MatrixXd g = springs.motions(tool).cast<double>();
  const Eigen::Matrix3Xd d = springs.spans().cast<double>();
  const Eigen::ArrayXd stiffness = springs.stiffness.cast<double>(), rest = springs.rest_length.cast<double>();
  const double stiffening = static_cast<double>(springs.stiffening), stable = kStableStiffness / (step_s * step_s);
  const Eigen::ArrayXd slopes = springs.steepest(), steepest = slopes * stiffness;
  const double times = stable / std::max(stiffest(weighted(steepest, g), tool), kStiffnessMin_1_s2);
  if (!slowed && !(times >= 1)) return;
  const Eigen::MatrixXd stretched = weighted(stiffness, g);
  Eigen::ArrayXd linear_strain = Eigen::ArrayXd::Zero(m);
  if (stiffening > 0) linear_strain = ((std::max(times, 1.0) * slopes - 1) / (3 * stiffening)).sqrt();
  linear_from_ = linear_strain.minCoeff();

  const Eigen::ArrayXd length = d.colwise().norm().transpose().array().max(static_cast<double>(kSpringLengthMinM)),
                       elongation = length - rest;
  const Eigen::Matrix3Xd axes = d * length.inverse().matrix().asDiagonal();
  const Eigen::ArrayXd linear_beyond = linear_strain * rest, in_law = elongation.max(-linear_beyond).min(linear_beyond);
  const Eigen::ArrayXd third = stiffness * stiffening / rest.square();
  const Eigen::ArrayXd slope = stiffness + 3 * third * in_law.square();
  const Eigen::ArrayXd across = (stiffness * elongation + third * in_law.square() * (3 * elongation - 2 * in_law)) / length;
  far_stiffness_ = stretched - weighted(across, g) - weighted_along(slope - across, g, axes);
  if (!(times >= 1)) {
    const Eigen::ArrayXd at_most = steepest * (rest / length).max(1.0).min(kCompressionMax);
    const Eigen::MatrixXd steepest_form = weighted(at_most, g.rightCols(variables_ - tool));
    added_mass_ = (1 / stable - 1 / stiffest(steepest_form, 0)) * steepest_form;
  }
  if (!(stiffest(far_stiffness_, tool, added_mass_) <= stable)) return;

  count_ = (m + kFloatLanes - 1) / kFloatLanes * kFloatLanes;
  motion_.setZero(3 * count_, variables_);
  axis_.setZero(count_, 3);
  for (int axis = 0; axis < 3; ++axis) {
    motion_.middleRows(axis * count_, m) = g(Eigen::seqN(axis, m, 3), Eigen::all).cast<float>();
    axis_.col(axis).head(m) = axes.row(axis).transpose().cast<float>().array();
  }
  const auto of_each = [&](const Eigen::ArrayXd& values, float none) {
    Each all = Each::Constant(count_, none);
    all.head(m) = values.cast<float>();
    return all;
  };
  length_ = of_each(length, 1);
  turning_ = of_each(slope - across, 0);
  damping_ = of_each(springs.damping.cast<double>(), 0);
  if (stiffening > 0) {
    stiffening_ = of_each(third, 0);
    elongation_ = of_each(elongation, 0);
    linear_at_ = of_each(linear_beyond, 0);
    in_law_ = of_each(in_law, 0);
  }
  const Each braked = damping_ * dot(axis_, moved(rate.cast<float>())) / length_;
  damping_at_stamp_.resize(variables_, variables_);
  for (int i = 0; i < variables_; ++i) {
    const Vectors delta = moved(Values::Unit(variables_, i));
    const Each along = dot(axis_, delta);
    damping_at_stamp_.col(i) = collect(sum(braked, delta, -braked * along, axis_)).cast<double>();
  }
  move_to(Values::Zero(variables_));
}

SampledForce::Vectors SampledForce::sum(const Each& a, const Vectors& v, const Each& b, const Vectors& w) noexcept {
  Vectors to(v.rows(), 3);
  for (int axis = 0; axis < 3; ++axis) to.col(axis) = a * v.col(axis) + b * w.col(axis);
  return to;
}

SampledForce::Each SampledForce::dot(const Vectors& v, const Vectors& w) noexcept {
  return v.col(0) * w.col(0) + v.col(1) * w.col(1) + v.col(2) * w.col(2);
}

SampledForce::Vectors SampledForce::moved(const Values& u) const noexcept {
  Vectors delta(count_, 3);
  Eigen::Map<Eigen::VectorXf>(delta.data(), delta.size()).noalias() = motion_ * u;
  return delta;
}

SampledForce::Values SampledForce::collect(const Vectors& f) const noexcept {
  Values g(variables_);
  g.noalias() = motion_.transpose() * Eigen::Map<const Eigen::VectorXf>(f.data(), f.size());
  return g;
}

void SampledForce::move_to(const Values& u) noexcept {
  assert(u.size() == variables_);
  u_ = u;
  auto& [delta, along, longer, length, more] = deformed_;
  delta = moved(u);
  along = dot(axis_, delta);
  const Each gained = 2 * length_ * along + dot(delta, delta);
  length = (length_.square() + gained).max(kSpringLengthMinM * kSpringLengthMinM).sqrt();
  longer = gained / (length + length_);
  if (stiffening_.size() == 0) {
    more.setZero(count_);
    return;
  }
  const Each elongation = elongation_ + longer, to = elongation.max(-linear_at_).min(linear_at_), further = to - in_law_;
  more = stiffening_ * further * (3 * (elongation - to) * (to + in_law_) + further * (to + 2 * in_law_));
}

void SampledForce::gradient(Values& g) const noexcept {
  const Deformed& b = deformed_;
  const Each left = (b.along * b.longer - dot(b.delta, b.delta)) / (b.length + length_);
  const Each by_delta = (turning_ * b.longer + b.more) / b.length;
  const Each by_axis = (length_ * b.more - turning_ * (length_ * left + b.along * b.longer)) / b.length;
  g = collect(sum(by_delta, b.delta, by_axis, axis_));
}

double SampledForce::energy() const noexcept {
  const Deformed& b = deformed_;
  const Each left = (b.along * b.longer - dot(b.delta, b.delta)) / (b.length + length_);
  const double linear = static_cast<double>(-0.5F * (turning_ * left * (b.longer + b.along)).sum());
  if (stiffening_.size() == 0) return linear;
  const Eigen::ArrayXd from = elongation_.cast<double>(), longer = b.longer.cast<double>(), bends = linear_at_.cast<double>();
  const auto stored = [&](const Eigen::ArrayXd& e) -> Eigen::ArrayXd {
    const Eigen::ArrayXd to = e.max(-bends).min(bends), squared = to.square(), beyond = e - to;
    return squared * (0.25 * squared + to * beyond + 1.5 * beyond.square());
  };
  const Eigen::ArrayXd at = from.max(-bends).min(bends), squared = at.square();
  const Eigen::ArrayXd first = squared * (3 * from - 2 * at), second = 3 * squared;
  return linear +
         (stiffening_.cast<double>() * (stored(from + longer) - stored(from) - first * longer - 0.5 * second * longer.square()))
             .sum();
}

void SampledForce::damping(const Values& rate, Values& change, Values& at_stamp) const noexcept {
  const Vectors there = sum(length_, axis_, Each::Ones(count_), deformed_.delta), motion = moved(rate);
  const Each now = damping_ * dot(there, motion) / dot(there, there).max(kSpringLengthMinM * kSpringLengthMinM);
  const Each before = damping_ * dot(axis_, motion);
  change = collect(sum(now, there, -before, axis_));
  at_stamp = (damping_at_stamp_ * u_.cast<double>()).cast<float>();
}

}  // namespace palpate
