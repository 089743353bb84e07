#include "common/patch/node_motion.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "common/patch/packed_numbers.hpp"

namespace palpate {

namespace {

/// Rounds to the nearest half-precision number, or to the next one above.
float half_above(float v) {
  constexpr float kHalfSpacing = 1.0F / 1024;  // largest relative distance between two halves: 10 bits of mantissa
  const auto near = static_cast<float>(Eigen::half(v));
  return near >= v ? near : static_cast<float>(Eigen::half(v * (1 + kHalfSpacing)));
}

/// Returns the motion of node i relative to its parent.
Eigen::Matrix3Xf beyond_parent(const NodeMotion& motion, Eigen::Index i) {
  return (motion.step[i] / NodeMotion::kByteMax) *
         (motion.bytes.middleCols<3>(3 * i).cast<float>().transpose() * motion.scale.asDiagonal());
}

}  // namespace

Eigen::MatrixXf NodeMotion::rows(int tool_variables) const {
  assert(tool_variables >= 0 && tool < nodes() && static_cast<int>(parent.size()) == nodes());
  assert(bytes.rows() == modes() && bytes.cols() == 3 * nodes());
  Eigen::MatrixXf v = Eigen::MatrixXf::Zero(3 * nodes(), tool_variables + modes());
  for (int i = 0; i < nodes(); ++i) {
    auto row = v.block(3 * i, tool_variables, 3, modes());
    const int p = parent[static_cast<std::size_t>(i)];
    assert(p <= i);
    if (p < i) row = v.block(3 * p, tool_variables, 3, modes());
    row += beyond_parent(*this, i);
  }
  if (tool >= 0)
    for (int axis = 0; axis < std::min(tool_axes, tool_variables); ++axis) v(3 * tool + axis, axis) = 1;
  return v;
}

NodeMotion rounded(const Eigen::MatrixXf& modes, int tool) {
  const Eigen::Index r = modes.cols(), count = modes.rows() / 3;
  assert(modes.rows() == 3 * count && count <= 255 && tool < count && modes.allFinite());
  const auto node = [&](Eigen::Index i) { return modes.middleRows<3>(3 * i); };
  const auto least = [](const auto& v) { return v.cwiseMax(1e-20F); };
  // Find the node with the most similar motion, with each mode relative to its largest motion.
  const Eigen::RowVectorXf size = least(modes.cwiseAbs().colwise().maxCoeff().eval());
  NodeMotion motion;
  motion.tool = tool;
  Eigen::RowVectorXf scale = Eigen::RowVectorXf::Zero(r);
  for (Eigen::Index i = 0; i < count; ++i) {
    Eigen::Index nearest = i;
    float more = (node(i) * size.cwiseInverse().asDiagonal()).cwiseAbs().maxCoeff();
    for (Eigen::Index p = 0; p < i; ++p) {
      const float apart = ((node(i) - node(p)) * size.cwiseInverse().asDiagonal()).cwiseAbs().maxCoeff();
      if (apart < more) more = apart, nearest = p;
    }
    motion.parent.push_back(static_cast<std::uint8_t>(nearest));
    const Eigen::Matrix3Xf part = nearest < i ? Eigen::Matrix3Xf(node(i) - node(nearest)) : Eigen::Matrix3Xf(node(i));
    scale = scale.cwiseMax(part.cwiseAbs().colwise().maxCoeff());
  }
  motion.scale.resize(r);
  const float unit = packed::power_of_two_above(scale.maxCoeff());  // halves have few exponents
  for (Eigen::Index k = 0; k < r; ++k) motion.scale[k] = unit * half_above(scale[k] / unit);
  const Eigen::RowVectorXf per_scale = motion.scale.transpose().unaryExpr([](float s) { return s > 0 ? 1 / s : 0.0F; });
  motion.step.resize(count);
  motion.bytes.resize(r, 3 * count);
  Eigen::MatrixXf known(modes.rows(), r);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Eigen::Index p = motion.parent[static_cast<std::size_t>(i)];
    Eigen::Matrix3Xf base = Eigen::Matrix3Xf::Zero(3, r);
    if (p < i) base = known.middleRows<3>(3 * p);
    const Eigen::Matrix3Xf part = (node(i) - base) * per_scale.asDiagonal();
    const float step = motion.step[i] = half_above(part.cwiseAbs().maxCoeff());
    for (int axis = 0; axis < 3; ++axis)
      for (Eigen::Index k = 0; k < r; ++k) {
        const float byte = step > 0 ? std::round(part(axis, k) / step * NodeMotion::kByteMax) : 0.0F;
        motion.bytes(k, 3 * i + axis) =
            static_cast<std::int8_t>(std::clamp<float>(byte, -NodeMotion::kByteMax, NodeMotion::kByteMax));
      }
    known.middleRows<3>(3 * i) = base + beyond_parent(motion, i);
  }
  return motion;
}

}  // namespace palpate
