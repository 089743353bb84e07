#include "server/body/coarse_space.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "server/body/grid_edge.hpp"

namespace palpate {
namespace {

constexpr std::size_t kNodesAPiece = 50, kPiecesLeast = 8;
constexpr double kNear = 1.25;  // coefficients apart by less have one inverse

using Box = std::array<int, 3>;

/// Boxes with this edge that have a free node, numbered in the order of those nodes.
std::map<Box, std::uint32_t> boxes_of(const LumpedBody& body, double edge_m) {
  std::map<Box, std::uint32_t> boxes;
  for (std::size_t i = 0; i < body.nodes.size(); ++i) {
    if (body.fixed[i]) continue;
    const Vec3 at = body.nodes[i] / edge_m;
    boxes.try_emplace(
        {static_cast<int>(std::floor(at.x())), static_cast<int>(std::floor(at.y())), static_cast<int>(std::floor(at.z()))},
        static_cast<std::uint32_t>(boxes.size()));
  }
  return boxes;
}

/// The smallest that has no more than so many boxes.
double edge_for(const LumpedBody& body, std::size_t most) {
  return smallest_edge(mean_edge_m(body), most, [&](double edge_m) { return boxes_of(body, edge_m).size(); });
}

bool is_near(double a, double b) { return a <= kNear * b && b <= kNear * a; }

}  // namespace

CoarseSpace::CoarseSpace(const Dynamics& dynamics, std::size_t pieces) {
  if (dynamics.body().planar) return;
  gather(dynamics.body(), pieces);
  const BodyState rest = dynamics.rest_state();
  const std::vector<std::uint8_t> none(dynamics.nodes(), 0);
  BlockMatrix a = dynamics.make_matrix();
  const auto at_rest = [&](double c_m, double c_d, double c_k) {
    dynamics.assemble(rest, c_m, c_d, c_k, none, false, a);
    return project(a);
  };
  m_ = at_rest(1, 0, 0);
  d_ = at_rest(0, 1, 0);
  k_ = at_rest(0, 0, 1);
}

void CoarseSpace::gather(const LumpedBody& body, std::size_t most) {
  const double edge_m = edge_for(body, std::clamp(body.nodes.size() / kNodesAPiece, kPiecesLeast, most));
  const std::map<Box, std::uint32_t> boxes = boxes_of(body, edge_m);
  std::vector<Vec3> center(boxes.size(), Vec3::Zero());
  std::vector<double> count(boxes.size(), 0);
  std::vector<Mat3> spread(boxes.size(), Mat3::Zero());
  nodes_.resize(body.nodes.size());
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    if (body.fixed[i]) continue;
    const Vec3 at = body.nodes[i] / edge_m;
    nodes_[i].piece = boxes.at(
        {static_cast<int>(std::floor(at.x())), static_cast<int>(std::floor(at.y())), static_cast<int>(std::floor(at.z()))});
    center[nodes_[i].piece] += body.nodes[i];
    count[nodes_[i].piece] += 1;
  }
  for (std::size_t p = 0; p < center.size(); ++p) center[p] /= count[p];
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    if (nodes_[i].piece == kNone) continue;
    const Vec3 arm = body.nodes[i] - center[nodes_[i].piece];
    Eigen::Map<Eigen::Vector3f>(nodes_[i].arm) = arm.cast<float>();
    spread[nodes_[i].piece] += arm * arm.transpose();
  }
  // Two extents: one alone leaves a turn about it without effect.
  for (const Mat3& s : spread) {
    const Vec3 extents = Eigen::SelfAdjointEigenSolver<Mat3>(s, Eigen::EigenvaluesOnly).eigenvalues();
    turns_.push_back(extents[1] > 1e-4 * edge_m * edge_m);
  }
}

Eigen::Matrix<double, 3, CoarseSpace::kMotions> CoarseSpace::motions(std::uint32_t node) const {
  Eigen::Matrix<double, 3, kMotions> e = Eigen::Matrix<double, 3, kMotions>::Zero();
  e.leftCols<3>().setIdentity();
  if (!turns_[nodes_[node].piece]) return e;
  const Vec3 r = Eigen::Map<const Eigen::Vector3f>(nodes_[node].arm).cast<double>();
  e.rightCols<3>() << 0, r.z(), -r.y(), -r.z(), 0, r.x(), r.y(), -r.x(), 0;
  return e;
}

Matrix CoarseSpace::project(const BlockMatrix& a) const {
  const auto size = kMotions * static_cast<Eigen::Index>(turns_.size());
  Matrix coarse = Matrix::Zero(size, size);
  for (std::uint32_t i = 0; i < a.rows(); ++i) {
    if (nodes_[i].piece == kNone) continue;
    const Eigen::Matrix<double, kMotions, 3> row = motions(i).transpose();
    for (std::uint32_t e = a.row_begin(i); e < a.row_end(i); ++e) {
      const std::uint32_t j = a.column(e);
      if (nodes_[j].piece == kNone) continue;
      coarse.block<kMotions, kMotions>(kMotions * static_cast<Eigen::Index>(nodes_[i].piece),
                                       kMotions * static_cast<Eigen::Index>(nodes_[j].piece)) += row * a.block(e) * motions(j);
    }
  }
  return coarse;
}

std::shared_ptr<const CoarseInverse> CoarseSpace::inverse(double c_m, double c_d) {
  for (const auto& known : inverses_)
    if (is_near(known->c_m, c_m) && is_near(known->c_d, c_d)) return known;
  Matrix a = k_ + c_d * d_ + c_m * m_;
  std::vector<Eigen::Index> idle;  // turns of a piece that has none
  for (Eigen::Index i = 0; i < a.rows(); ++i) {
    if (a(i, i) != 0) continue;
    a(i, i) = 1;
    idle.push_back(i);
  }
  const Eigen::LLT<Matrix> factor(a);
  if (factor.info() != Eigen::Success) return nullptr;
  Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> inverse =
      factor.solve(Matrix::Identity(a.rows(), a.cols())).cast<float>();
  for (const Eigen::Index i : idle) inverse(i, i) = 0;
  constexpr std::size_t kKept = 8;
  if (inverses_.size() == kKept) inverses_.pop_front();
  return inverses_.emplace_back(std::make_shared<const CoarseInverse>(
      CoarseInverse{c_m, c_d, size(), std::vector<float>(inverse.data(), inverse.data() + inverse.size())}));
}

}  // namespace palpate
