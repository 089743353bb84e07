#include "server/elements/element_shape.hpp"

#include <Eigen/Dense>
#include <array>
#include <cassert>
#include <cmath>

namespace palpate {
namespace {

using Vec8 = Eigen::Matrix<double, 8, 1>;

Vec3 corner(int i) { return {i & 1 ? 1.0 : -1.0, i & 2 ? 1.0 : -1.0, i & 4 ? 1.0 : -1.0}; }

double mode(int a, const Vec3& xi) { return a == 3 ? xi.prod() : xi[(a + 1) % 3] * xi[(a + 2) % 3]; }

/// Modes at the corners.
std::array<Vec8, 4> modes() {
  std::array<Vec8, 4> h;
  for (int a = 0; a < 4; ++a)
    for (int i = 0; i < 8; ++i) h[static_cast<std::size_t>(a)][i] = mode(a, corner(i));
  return h;
}

/// Returns the derivatives of the shape functions by xi, as columns.
Mat38 slopes_at(const Vec3& xi) {
  Mat38 d;
  for (int i = 0; i < 8; ++i) {
    const Vec3 c = corner(i), one = Vec3::Ones() + c.cwiseProduct(xi);
    d.col(i) = Vec3(c.x() * one.y() * one.z(), c.y() * one.z() * one.x(), c.z() * one.x() * one.y()) / 8;
  }
  return d;
}

/// Those at the points of Gauss' rule with two points per axis.
std::array<Mat38, 8> slopes_at_gauss() {
  std::array<Mat38, 8> slopes;
  for (int point = 0; point < 8; ++point) slopes[static_cast<std::size_t>(point)] = slopes_at(corner(point) / std::sqrt(3.0));
  return slopes;
}

}  // namespace

template <>
TetraShape::ElementShape(const Mat34& rest, double, double share) {
  const Mat3 edges = rest.rightCols<3>().colwise() - rest.col(0);
  if (rest.col(3) == rest.col(0)) {
    const Eigen::Matrix<double, 3, 2> sides = edges.leftCols<2>();
    b.col(3).setZero();
    b.middleCols<2>(1) = sides * (sides.transpose() * sides).inverse();
    volume_m3 = 0.5 * edges.col(0).cross(edges.col(1)).norm();
  } else {
    b.rightCols<3>() = edges.inverse().transpose();
    volume_m3 = edges.determinant() / 6;
  }
  b.col(0) = -b.rightCols<3>().rowwise().sum();
  volume_m3 *= share;
}

template <>
HexaShape::ElementShape(const Mat38& rest, double young_pa, double share) : b(Mat38::Zero()) {
  static const std::array<Mat38, 8> at_gauss = slopes_at_gauss();
  static const std::array<Vec8, 4> at_corners = modes();
  static const Mat38 at_middle = slopes_at(Vec3::Zero());
  for (const Mat38& d : at_gauss) {  // exact: det dX/dxi is quadratic in each xi
    const Mat3 jacobian = rest * d.transpose();
    const double det = jacobian.determinant();
    volume_m3 += det;
    b += det * jacobian.inverse().transpose() * d;
  }
  assert(volume_m3 > 0);
  b /= volume_m3;
  volume_m3 *= share;
  for (int a = 0; a < kModes; ++a) {
    const Vec8& h = at_corners[static_cast<std::size_t>(a)];
    gamma.row(a) = (h.transpose() - (rest * h).transpose() * b) / 8;
  }
  const Mat3 half_edges_m = rest * at_middle.transpose();
  const Vec3 slopes = half_edges_m.colwise().squaredNorm().cwiseInverse();  // 1 / |J_k|^2
  const double stiffness = volume_m3 * young_pa;
  for (int a = 0; a < 3; ++a) {
    const double over = slopes[(a + 1) % 3], along = slopes[(a + 2) % 3];
    k[static_cast<std::size_t>(a)] = stiffness / 3 * 2 * over * along / (over + along);
  }
  k[3] = stiffness / 9 * slopes.mean();
}

}  // namespace palpate
