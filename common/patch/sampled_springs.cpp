#include "common/patch/sampled_springs.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>
#include <vector>

namespace palpate {
namespace {

constexpr float kSpringLengthMinM = 1e-6F;   // below, a spring has no direction
constexpr double kStiffnessMin_1_s2 = 1e-6;  // so that springs that hold no mode do not divide by 0
constexpr double kCompressionMax = 2;        // limit of L / |d| in the added mass: more would slow motions that matter

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

void dot(const ElementLane (&v)[3], const ElementLane (&w)[3], ElementLane& product) {
  product = v[0] * w[0] + v[1] * w[1] + v[2] * w[2];
}
/// Limits v to -bound and bound.
void limit(const ElementLane& v, const ElementLane& bound, ElementLane& within) {
  within = v < -bound ? -bound : v;
  within = within > bound ? bound : within;
}
/// Computes max(square, least)^1/2.
void length_of(const ElementLane& square, ElementLane& length) {
  const ElementLane least = ElementLane{} + kSpringLengthMinM * kSpringLengthMinM;
  lane_roots(square > least ? square : least, length);
}

}  // namespace

SampledSpringForce::SampledSpringForce(const SampledElements& springs, int tool, const Eigen::VectorXd& rate, double step_s,
                                       bool slowed) {
  variables_ = tool + springs.motion.modes();
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

  // Springs side by side, padded with ones without stiffness to whole groups.
  std::vector<int> lanes(static_cast<std::size_t>(m));
  std::iota(lanes.begin(), lanes.end(), 0);
  lay_out(g.cast<float>(), lanes, (m + kSampledLanes - 1) / kSampledLanes);
  damped_ = springs.damping.maxCoeff() > 0;
  damping_at_stamp_.setZero(variables_, variables_);
  for (int e = 0; e < m; ++e) {
    SampledSpringGroup& at = group(e / kSampledLanes);
    const int l = e % kSampledLanes;
    for (int axis = 0; axis < 3; ++axis) at.axis[axis][l] = static_cast<float>(axes(axis, e));
    at.length[l] = static_cast<float>(length[e]);
    at.turning[l] = static_cast<float>(slope[e] - across[e]);
    at.damper[l] = springs.damping[e];
    at.stiffens = stiffening > 0;
    at.stiffening[l] = static_cast<float>(third[e]);
    at.elongation[l] = static_cast<float>(elongation[e]);
    at.linear_at[l] = static_cast<float>(linear_beyond[e]);
    at.in_law[l] = static_cast<float>(in_law[e]);
    const auto of_spring = g.middleRows<3>(3 * e);
    const double braked = static_cast<double>(springs.damping[e]) * axes.col(e).dot(of_spring * rate) / length[e];
    const Eigen::Matrix3d turned = Eigen::Matrix3d::Identity() - axes.col(e) * axes.col(e).transpose();
    damping_at_stamp_ += braked * of_spring.transpose() * turned * of_spring;
  }
  move_to(Values::Zero(variables_));
}

SampledSpringGroup::SampledSpringGroup() {
  const ElementLane none{};
  for (ElementLane* const all : {axis, delta})
    for (int i = 0; i < 3; ++i) all[i] = none;
  length = reach = none + 1.0F;
  turning = damper = stiffening = elongation = in_law = linear_at = along = longer = more = none;
}

void SampledSpringGroup::move(const ElementLane (&change)[3]) noexcept {
  ElementLane square;
  for (int i = 0; i < 3; ++i) delta[i] = change[i];
  dot(axis, delta, along);
  dot(delta, delta, square);
  const ElementLane gained = 2.0F * length * along + square;
  length_of(length * length + gained, reach);
  longer = gained / (reach + length);
  if (!stiffens) return;
  const ElementLane now = elongation + longer;
  ElementLane to;
  limit(now, linear_at, to);
  const ElementLane further = to - in_law;
  more = stiffening * further * (3.0F * (now - to) * (to + in_law) + further * (to + 2.0F * in_law));
}

void SampledSpringGroup::force(ElementLane (&q)[3]) const noexcept {
  ElementLane square;
  dot(delta, delta, square);
  const ElementLane left = (along * longer - square) / (reach + length), by_delta = (turning * longer + more) / reach;
  const ElementLane by_axis = (length * more - turning * (length * left + along * longer)) / reach;
  for (int i = 0; i < 3; ++i) q[i] = by_delta * delta[i] + by_axis * axis[i];
}

double SampledSpringGroup::energy() const noexcept {
  using Doubles = Eigen::Array<double, kSampledLanes, 1>;
  const auto doubles = [](const ElementLane& of) {
    Doubles d;
    for (int l = 0; l < kSampledLanes; ++l) d[l] = static_cast<double>(of[l]);
    return d;
  };
  ElementLane square;
  dot(delta, delta, square);
  const ElementLane left = (along * longer - square) / (reach + length), turned = turning * left * (longer + along);
  const double linear = -0.5 * doubles(turned).sum();
  if (!stiffens) return linear;
  const Doubles from = doubles(elongation), further = doubles(longer), bends = doubles(linear_at);
  const auto stored = [&](const Doubles& e) -> Doubles {
    const Doubles to = e.max(-bends).min(bends), squared = to.square(), beyond = e - to;
    return squared * (0.25 * squared + to * beyond + 1.5 * beyond.square());
  };
  const Doubles at = from.max(-bends).min(bends), squared = at.square(), first = squared * (3 * from - 2 * at);
  return linear +
         (doubles(stiffening) * (stored(from + further) - stored(from) - first * further - 1.5 * squared * further.square()))
             .sum();
}

void SampledSpringGroup::damping(const ElementLane (&rate)[3], ElementLane (&q)[3]) const noexcept {
  ElementLane there[3], square, product, before;
  for (int i = 0; i < 3; ++i) there[i] = length * axis[i] + delta[i];
  dot(there, there, square);
  dot(there, rate, product);
  dot(axis, rate, before);
  const ElementLane least = ElementLane{} + kSpringLengthMinM * kSpringLengthMinM;
  const ElementLane now = damper * product / (square > least ? square : least);
  for (int i = 0; i < 3; ++i) q[i] = now * there[i] - damper * before * axis[i];
}

}  // namespace palpate
