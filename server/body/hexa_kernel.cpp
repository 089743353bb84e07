#include "server/body/hexa_kernel.hpp"

#include <Eigen/Dense>
#include <cassert>
#include <cmath>

namespace palpate {
namespace {

using Vec8 = Eigen::Matrix<double, 8, 1>;

Vec3 corner(int i) { return {i & 1 ? 1.0 : -1.0, i & 2 ? 1.0 : -1.0, i & 4 ? 1.0 : -1.0}; }

double mode(int a, const Vec3& xi) { return a == 3 ? xi.prod() : xi[(a + 1) % 3] * xi[(a + 2) % 3]; }

/// Returns the derivatives of the shape functions by xi, as columns.
Mat38 slopes_at(const Vec3& xi) {
  Mat38 d;
  for (int i = 0; i < 8; ++i) {
    const Vec3 c = corner(i), one = Vec3::Ones() + c.cwiseProduct(xi);
    d.col(i) = Vec3(c.x() * one.y() * one.z(), c.y() * one.z() * one.x(), c.z() * one.x() * one.y()) / 8;
  }
  return d;
}

}  // namespace

HexaRest::HexaRest(const Mat38& rest) : g(Mat78::Zero()), volume_m3(0), half_edges_m(rest * slopes_at(Vec3::Zero()).transpose()) {
  for (int point = 0; point < 8; ++point) {  // two-point Gauss rule, exact: det dX/dxi is quadratic in each xi
    const Mat38 d = slopes_at(corner(point) / std::sqrt(3.0));
    const Mat3 jacobian = rest * d.transpose();
    const double det = jacobian.determinant();
    volume_m3 += det;
    g.topRows<3>() += det * jacobian.inverse().transpose() * d;
  }
  assert(volume_m3 > 0);
  g.topRows<3>() /= volume_m3;
  for (int a = 0; a < kModesOfHexa; ++a) {
    Vec8 h;
    for (int i = 0; i < 8; ++i) h[i] = mode(a, corner(i));
    g.row(3 + a) = (h.transpose() - (rest * h).transpose() * g.topRows<3>()) / 8;
  }
}

Hourglass::Hourglass(const SolidMaterial& material, const HexaRest& rest) : damping_s(material.damping_s) {
  const Vec3 slopes = rest.half_edges_m.colwise().squaredNorm().cwiseInverse();  // 1 / |J_k|^2
  const double stiffness = rest.volume_m3 * material.young_pa;
  for (int a = 0; a < 3; ++a) {
    const double b = slopes[(a + 1) % 3], c = slopes[(a + 2) % 3];
    k[a] = stiffness / 3 * 2 * b * c / (b + c);
  }
  k[3] = stiffness / 9 * slopes.mean();
}

double elastic_energy(const TetraMaterial& m, const Hourglass& modes, const HexaRest& rest, const Mat37& gradient) {
  return rest.volume_m3 * elastic_energy_density(m, gradient.leftCols<3>()) +
         0.5 * modes.k.dot(gradient.rightCols<4>().colwise().squaredNorm().transpose());
}

Mat37 elastic_stress(const TetraMaterial& m, const Hourglass& modes, const HexaRest& rest, const Mat37& gradient) {
  Mat37 p;
  p.leftCols<3>() = rest.volume_m3 * elastic_stress(m, gradient.leftCols<3>());
  p.rightCols<4>() = gradient.rightCols<4>() * modes.k.asDiagonal();
  return p;
}

Mat37 viscous_stress(const TetraMaterial& m, const Hourglass& modes, const HexaRest& rest, const Mat37& gradient,
                     const Mat37& rate) {
  const Mat3 f = gradient.leftCols<3>();
  const Mat34 q = gradient.rightCols<4>();
  const Mat34 s =
      modes.damping_s * (rate.leftCols<3>().transpose() * q + f.transpose() * rate.rightCols<4>()) * modes.k.asDiagonal();
  Mat37 p;
  p.leftCols<3>() = rest.volume_m3 * viscous_stress(m, f, rate.leftCols<3>()) + q * s.transpose();
  p.rightCols<4>() = f * s;
  return p;
}

HexaTangent::HexaTangent(const TetraMaterial& material, const Mat37& gradient, bool clamp)
    : gradient_(gradient), of_law_(material, f(), clamp) {}

Mat3 HexaTangent::block(const TetraMaterial& m, const Hourglass& modes, const HexaRest& rest, int i, int j, double c_d,
                        double c_k) const {
  const Vec3 bi = rest.g.col(i).head<3>(), bj = rest.g.col(j).head<3>();
  const Eigen::Vector4d gi = rest.g.col(i).tail<4>(), stiff_j = modes.k.cwiseProduct(rest.g.col(j).tail<4>());
  const Mat3 at = f();
  const double straight = gi.dot(stiff_j);
  Mat3 k = c_k * of_law_.block(rest.volume_m3, bi, bj, i == j) + c_d * viscous_block(m, rest.volume_m3, bi, bj, at);
  k.diagonal().array() += c_k * straight;
  const Vec3 qi = q() * modes.k.cwiseProduct(gi), qj = q() * stiff_j;
  k += c_d * modes.damping_s *
       (bi.dot(bj) * q() * modes.k.asDiagonal() * q().transpose() + qj * (at * bi).transpose() + (at * bj) * qi.transpose() +
        straight * at * at.transpose());
  return k;
}

}  // namespace palpate
