#include "server/sampling/sampling.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <ranges>

#include "common/base/random.hpp"

namespace palpate {
namespace {

constexpr int kSampleSums = 32;     // measured: 24 cost the organ 1 to 3 dB (docs/notebook.md, 30)
constexpr int kLikeliestAlone = 3;  // samples unmixed: axes of a grasp; for a touch undeviated rollouts or its indentations

using AtSums = Eigen::Matrix<float, Eigen::Dynamic, kSampleSums, Eigen::RowMajor>;

/// Returns weights of orthogonal sums of samples: some frequencies of a cosine transform of samples with random signs. Least
/// squares over a few such sums approximate those over all samples (Woodruff, FnTTCS 10 (2014), chapter 2).
Eigen::MatrixXf make_mixing() {
  Random random(2);
  Eigen::MatrixXf mix(kSamples, kSampleSums);
  for (Eigen::Index s = 0; s < kSamples; ++s) {
    const double sign = random.chance(0.5) ? 1 : -1;
    for (Eigen::Index j = 0; j < kSampleSums; ++j) {
      const auto frequency = static_cast<double>(j * kSamples / kSampleSums);
      const double wave = std::cos(M_PI * (static_cast<double>(s) + 0.5) * frequency / kSamples);
      mix(s, j) = static_cast<float>(sign * (j == 0 ? std::sqrt(0.5) : wave));
    }
  }
  return mix;
}

const Eigen::MatrixXf& mixing() {
  static const Eigen::MatrixXf mix = make_mixing();
  return mix;
}

/// Scales the part of forces in the span of the columns of `at_port` (orthonormal), which acts at the port, by kPortWeight.
template <typename Forces>
void weigh_port(const Eigen::MatrixXf& at_port, Forces& forces) {
  if (at_port.cols() > 0) forces += (kPortWeight - 1) * at_port * (at_port.transpose() * forces);
}

}  // namespace

Matrix samples(const Sampling& sampling) {
  constexpr double kLargeAmplitude = 1.5, kSmallAmplitude = 0.3;  // of likely sizes; tuned: others make another patch
  const Matrix& likely = sampling.likely;
  assert(likely.cols() > 0);
  Random random(1);
  const auto draw = [&] { return random.uniform(-1, 1); };
  Matrix u(likely.rows(), kSamples);
  Eigen::Index k = 0;
  for (const Eigen::Index i : sampling.likeliest | std::views::take(kLikeliestAlone))
    for (const double much : {1.0, -1.0, 2.0, -2.0}) u.col(k++) = much * likely.col(i);
  for (; k < u.cols(); ++k) {
    Vector mixture(likely.cols());
    for (double& part : mixture) part = draw() * (draw() > 1.0 / 3 ? kLargeAmplitude : kSmallAmplitude);
    u.col(k) = kLargeAmplitude * draw() * (likely * mixture);
  }
  return u;
}

Matrix root_of(const Matrix& u) {
  const Eigen::SelfAdjointEigenSolver<Matrix> eigen(u * u.transpose());
  return eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0).cwiseSqrt().asDiagonal();
}

std::vector<std::uint32_t> largest(const Eigen::VectorXf& parts, std::size_t most) {
  std::vector<std::pair<float, std::uint32_t>> order;
  for (Eigen::Index k = 0; k < parts.size(); ++k) order.emplace_back(-parts[k], static_cast<std::uint32_t>(k));
  if (order.size() > most) {
    std::nth_element(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(most), order.end());
    order.resize(most);
  }
  std::vector<std::uint32_t> found;
  for (const auto& [part, element] : order) found.push_back(element);
  std::sort(found.begin(), found.end());
  return found;
}

SampledResiduals::SampledResiduals(const Eigen::MatrixXf& all, const Matrix& u, const Sampling& sampling)
    : unit_(sampling.stiffness.cwiseSqrt().cwiseInverse().cast<float>()) {
  assert(sampling.stiffness.minCoeff() > 0 && all.rows() == unit_.size() && all.cols() == kSamples && u.cols() == kSamples);
  assert(sampling.at_port.cols() == 0 || sampling.at_port.rows() == unit_.size());
  if (sampling.at_port.cols() > 0) {
    const Eigen::ColPivHouseholderQR<Matrix> at_port(sampling.stiffness.cwiseSqrt().asDiagonal() * sampling.at_port);
    at_port_ = (at_port.householderQ() * Matrix::Identity(unit_.size(), at_port.rank())).cast<float>();
  }
  Eigen::MatrixXf nonlinear = unit_.asDiagonal() * all;
  const Eigen::MatrixXf linear = unit_.cwiseInverse().asDiagonal() * u.cast<float>();
  const Eigen::VectorXf size =
      (nonlinear.colwise().norm() + static_cast<float>(kLinearForceShare) * linear.colwise().norm()).cwiseMax(1e-30F).transpose();
  mix_ = size.cwiseInverse().asDiagonal() * mixing();
  weigh_port(at_port_, nonlinear);
  all_ = (mix_.transpose() * nonlinear.transpose()).reshaped();
}

const Eigen::MatrixXf& SampledResiduals::parts(const ElementForces& elements) const {
  assert(!elements.motion.empty() && elements.motion.size() == elements.force.size());
  assert(elements.motion[0].cols() == unit_.size());
  thread_local Eigen::MatrixXf parts;  // reused: megabytes that would be allocated for every patch
  const Eigen::Index n = unit_.size(), count = elements.motion[0].rows();
  std::vector<AtSums> mixed;
  for (const SampleMatrix& force : elements.force) mixed.emplace_back(force * mix_);
  parts.resize(kSampleSums * n, count);
  for (Eigen::Index k = 0; k < count; ++k) {
    float* const to = parts.col(k).data();
    for (Eigen::Index i = 0; i < n; ++i) {
      Eigen::Array<float, 1, kSampleSums> sum = Eigen::Array<float, 1, kSampleSums>::Zero();
      for (std::size_t number = 0; number < mixed.size(); ++number)
        sum += elements.motion[number](k, i) * mixed[number].row(k).array();
      Eigen::Map<Eigen::Array<float, 1, kSampleSums>>(to + kSampleSums * i) = unit_[i] * sum;
    }
    Eigen::Map<AtSums> part(to, n, kSampleSums);
    weigh_port(at_port_, part);
  }
  return parts;
}

void ByteCosts::with(const std::vector<Eigen::Index>& there) {
  std::fill(used_.begin(), used_.end(), std::uint8_t{0});
  int nodes = 0;
  for (const Eigen::Index column : there) {
    nodes += new_nodes(column);
    for (const std::uint32_t node : nodes_of(column)) used_[node] = 1;
  }
  const auto elements = static_cast<int>(there.size());
  const int now = numbers_(nodes, elements);
  for (int more = 0; more <= of_each_; ++more) {
    const int then = numbers_(nodes + more, elements + 1);
    const bool fits = then <= kUsualNumbers && nodes + more <= kMaxSampledNodes;
    cost_[static_cast<std::size_t>(more)] = fits ? static_cast<float>(then - now) : std::numeric_limits<float>::infinity();
  }
}

int ByteCosts::new_nodes(Eigen::Index column) const {
  const std::span<const std::uint32_t> nodes = nodes_of(column);
  int fresh = 0;
  for (auto node = nodes.begin(); node != nodes.end(); ++node)  // triangles repeat one of them
    fresh += used_[*node] == 0 && std::find(nodes.begin(), node, *node) == node ? 1 : 0;
  return fresh;
}

int NodeNumbering::number_of(std::uint32_t node) {
  if (node >= numbers_.size()) numbers_.resize(node + 1, -1);
  int& number = numbers_[node];
  if (number < 0) {
    number = static_cast<int>(nodes_.size());
    nodes_.push_back(node);
  }
  return number;
}

NodeMotion NodeNumbering::motion(const Rows& moved, int tool, int tool_axes) const {
  assert(tool_axes == 2 || tool_axes == 3);
  const Eigen::Index modes = moved.cols() - (tool < 0 ? 0 : 3);
  Eigen::MatrixXf rows(3 * static_cast<Eigen::Index>(nodes_.size()), modes);
  int held = -1;
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    rows.middleRows<3>(3 * static_cast<Eigen::Index>(i)) =
        moved.middleRows<3>(3 * static_cast<Eigen::Index>(nodes_[i])).rightCols(modes);
    if (tool >= 0 && nodes_[i] == static_cast<std::uint32_t>(tool)) held = static_cast<int>(i);
  }
  NodeMotion motion = rounded(rows, held);
  motion.tool_axes = tool_axes;
  return motion;
}

Eigen::Matrix3Xf NodeNumbering::places(const Vector& x) const {
  assert(!nodes_.empty());
  Eigen::Matrix3Xf places(3, static_cast<Eigen::Index>(nodes_.size()));
  const Vec3 origin = at_node(x, nodes_.front());
  for (std::size_t i = 0; i < nodes_.size(); ++i)
    places.col(static_cast<Eigen::Index>(i)) = (at_node(x, nodes_[i]) - origin).cast<float>();
  return places;
}

}  // namespace palpate
