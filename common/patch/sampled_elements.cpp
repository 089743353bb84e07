#include "common/patch/sampled_elements.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cassert>
#include <cmath>

namespace palpate {
namespace {

constexpr double kStepsPerOctave = 16;  // format: a byte reaches slopes of 2^(255 / 16) = 6e4, to 4 %

}  // namespace

Eigen::MatrixXf gradient_motion(const Eigen::MatrixXf& gradients, const std::vector<Eigen::Matrix3Xf>& edges) {
  const Eigen::Index d = gradients.cols();
  Eigen::MatrixXf h = Eigen::MatrixXf::Zero(3 * d, edges[0].cols());
  for (Eigen::Index i = 0; i < d; ++i)
    for (Eigen::Index r = 0; r < 3; ++r)
      for (Eigen::Index c = 0; c < d; ++c) h.row(d * r + c) += gradients(i, c) * edges[static_cast<std::size_t>(i)].row(r);
  return h;
}

Eigen::Matrix3Xf SampledElements::edges(const Eigen::Matrix3Xf& places, int element) const {
  Eigen::Matrix3Xf edges(3, dimension());
  for (int i = 0; i < dimension(); ++i) edges.col(i) = places.col(nodes(i + 1, element)) - places.col(nodes(0, element));
  return edges;
}

Eigen::MatrixXf SampledElements::gradients(int element, float& volume) const {
  volume = 1;
  if (!is_solid()) return Eigen::MatrixXf::Ones(1, 1);
  const Eigen::Matrix3d at_rest = edges(rest, element).cast<double>();
  if (is_triangle(element)) {
    const Eigen::Matrix<double, 3, 2> sides = at_rest.leftCols<2>();
    Eigen::Matrix3d rows = Eigen::Matrix3d::Zero();
    rows.topRows<2>() = (sides.transpose() * sides).inverse() * sides.transpose();
    volume = static_cast<float>(at_rest.col(0).cross(at_rest.col(1)).norm());
    return rows.cast<float>();
  }
  volume = static_cast<float>(at_rest.determinant());
  return at_rest.inverse().cast<float>();
}

Eigen::MatrixXf SampledElements::motions(int tool) const {
  assert(tool == 0 || tool == 3);
  const Eigen::MatrixXf v = motion.rows(tool);
  const int rows = 3 * dimension();
  Eigen::MatrixXf h(rows * count(), v.cols());
  std::vector<Eigen::Matrix3Xf> edges(static_cast<std::size_t>(dimension()));
  for (int e = 0; e < count(); ++e) {
    float volume = 0;
    for (int i = 0; i < dimension(); ++i)
      edges[static_cast<std::size_t>(i)] = v.middleRows<3>(3 * nodes(i + 1, e)) - v.middleRows<3>(3 * nodes(0, e));
    h.middleRows(rows * e, rows) = gradient_motion(gradients(e, volume), edges);
  }
  return h;
}

Eigen::Matrix3Xf SampledElements::spans() const {
  Eigen::Matrix3Xf d(3, count());
  for (int e = 0; e < count(); ++e) d.col(e) = edges(position, e);
  return d;
}

Eigen::ArrayXd SampledElements::steepest() const {
  Eigen::ArrayXd slopes = Eigen::ArrayXd::Ones(count());
  for (std::size_t e = 0; e < max_slope.size(); ++e)
    slopes[static_cast<Eigen::Index>(e)] = std::exp2(max_slope[e] / kStepsPerOctave);
  return slopes;
}

std::vector<std::uint8_t> SampledElements::steep_of(const Eigen::ArrayXd& slopes) {
  assert(slopes.size() == 0 || slopes.allFinite());
  std::vector<std::uint8_t> max_slope;
  for (const double slope : slopes)
    max_slope.push_back(
        static_cast<std::uint8_t>(std::clamp(std::ceil(kStepsPerOctave * std::log2(std::max(1.0, slope))), 0.0, 255.0)));
  return max_slope;
}

}  // namespace palpate
