#include "common/mechanics/polar.hpp"

#include <Eigen/Dense>
#include <cmath>

namespace palpate {
namespace {

constexpr int kPolarIterations = 8;       // bound on Newton's method, which converges quadratically
constexpr double kPolarWellFormed = 0.1;  // limit of J 3^1.5 / |F|^3, 1 for a rotation: below, singular values are used

}  // namespace

Eigen::Matrix3d cofactors(const Eigen::Matrix3d& f) {
  Eigen::Matrix3d g;
  g << f.col(1).cross(f.col(2)), f.col(2).cross(f.col(0)), f.col(0).cross(f.col(1));
  return g;
}

SignedSvd signed_svd(const Eigen::Matrix3d& f) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(f, Eigen::ComputeFullU | Eigen::ComputeFullV);
  SignedSvd result{svd.matrixU(), svd.matrixV(), svd.singularValues()};
  for (Eigen::Matrix3d* m : {&result.u, &result.v}) {
    if (m->determinant() > 0) continue;
    m->col(2) = -m->col(2);
    result.s.z() = -result.s.z();
  }
  return result;
}

Eigen::Matrix3d polar_rotation(const Eigen::Matrix3d& f) {
  const double size = f.norm();
  if (f.determinant() * 5.196 <= kPolarWellFormed * size * size * size) {
    const SignedSvd svd = signed_svd(f);
    return svd.u * svd.v.transpose();
  }
  Eigen::Matrix3d r = f;
  for (int i = 0; i < kPolarIterations; ++i) {
    const Eigen::Matrix3d inverse_transpose = cofactors(r) / r.determinant();
    const double scale = std::sqrt(inverse_transpose.norm() / r.norm());
    const Eigen::Matrix3d next = 0.5 * (scale * r + inverse_transpose / scale);
    const double change = (next - r).squaredNorm();
    r = next;
    if (change < 1e-24) break;
  }
  return r;
}

}  // namespace palpate
