#include "server/body/hexa_kernel.hpp"

#include <Eigen/Dense>
#include <cassert>
#include <cmath>

namespace palpate {
namespace {

using Vec8 = Eigen::Matrix<double, 8, 1>;
using Vec12 = Eigen::Matrix<double, 12, 1>;

Vec3 corner(int i) { return {i & 1 ? 1.0 : -1.0, i & 2 ? 1.0 : -1.0, i & 4 ? 1.0 : -1.0}; }

double mode(int a, const Vec3& xi) { return a == 3 ? xi.prod() : xi[(a + 1) % 3] * xi[(a + 2) % 3]; }

/// The derivatives of the shape functions by xi, as columns.
Mat38 slopes_at(const Vec3& xi) {
  Mat38 d;
  for (int i = 0; i < 8; ++i) {
    const Vec3 c = corner(i), one = Vec3::Ones() + c.cwiseProduct(xi);
    d.col(i) = Vec3(c.x() * one.y() * one.z(), c.y() * one.z() * one.x(), c.z() * one.x() * one.y()) / 8;
  }
  return d;
}

/// F^T q_a for every mode.
Mat34 turned_back(const Mat3& f, const Mat34& q) { return f.transpose() * q; }

Mat34 times_c(const Mat12& c, const Mat34& q) {
  Mat34 s;
  Eigen::Map<Vec12>(s.data()) = c * Eigen::Map<const Vec12>(q.data());
  return s;
}

/// What `s` conjugate to F^T q makes of (F, q): its derivative's adjoint.
Mat37 pulled(const Mat37& gradient, const Mat34& s) {
  Mat37 p;
  p.leftCols<3>() = gradient.rightCols<4>() * s.transpose();
  p.rightCols<4>() = gradient.leftCols<3>() * s;
  return p;
}

/// The first derivative of F^T q in a direction.
Mat34 changed(const Mat37& gradient, const Mat37& change) {
  return change.leftCols<3>().transpose() * gradient.rightCols<4>() + gradient.leftCols<3>().transpose() * change.rightCols<4>();
}

/// Of the linear modes: squares of the in-plane strains that vary with each xi_k, weighed by what they cost.
void add_linear_modes(const SolidMaterial& m, const HexaRest& rest, Mat12& c) {
  const Mat3 normals = rest.half_edges_m.inverse().transpose();
  const double mu = m.young_pa / (2 * (1 + m.poisson)), third = rest.volume_m3 / 3;
  for (int k = 0; k < 3; ++k) {
    const Vec3 n = normals.col(k).normalized();
    const Mat3 plane = Mat3::Identity() - n * n.transpose();
    Eigen::Matrix<double, 9, 12> strain = Eigen::Matrix<double, 9, 12>::Zero();
    for (int a = 0; a < 3; ++a) {
      if (a == k) continue;
      const int b = 3 - a - k;  // d h_a / d xi_b = xi_k
      for (int r = 0; r < 3; ++r) {
        const Mat3 e = plane * (Vec3::Unit(r) * normals.col(b).transpose()) * plane, half = 0.5 * (e + e.transpose());
        strain.col(3 * a + r) = Eigen::Map<const Eigen::Matrix<double, 9, 1>>(half.data());
      }
    }
    const Eigen::Matrix<double, 1, 12> trace = strain.row(0) + strain.row(4) + strain.row(8);
    c += third * 2 * mu * (strain.transpose() * strain + m.poisson / (1 - m.poisson) * trace.transpose() * trace);
  }
}

void add_trilinear_mode(const SolidMaterial& m, const HexaRest& rest, Mat12& c) {
  for (int k = 0; k < 3; ++k) {
    const Vec3 along = rest.half_edges_m.col(k) / rest.half_edges_m.col(k).squaredNorm();
    c.bottomRightCorner<3, 3>() += rest.volume_m3 / 9 * m.young_pa * along * along.transpose();
  }
}

}  // namespace

HexaRest::HexaRest(const Mat38& rest) : g(Mat78::Zero()), volume_m3(0), half_edges_m(rest * slopes_at(Vec3::Zero()).transpose()) {
  for (int point = 0; point < 8; ++point) {  // exact: det dX/dxi is of second order in each xi
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

Hourglass::Hourglass(const SolidMaterial& material, const HexaRest& rest) : c(Mat12::Zero()), damping_s(material.damping_s) {
  add_linear_modes(material, rest, c);
  add_trilinear_mode(material, rest, c);
  constexpr double kRounding = 1e-12;  // of what a box has no coupling for
  const double negligible = kRounding * c.diagonal().maxCoeff();
  c = c.unaryExpr([&](double entry) { return std::abs(entry) > negligible ? entry : 0.0; }).eval();
  k0 = std::max(0.0, Eigen::SelfAdjointEigenSolver<Mat12>(c, Eigen::EigenvaluesOnly).eigenvalues()[0]);
  c.diagonal().array() -= k0;
}

double elastic_energy(const TetraMaterial& m, const Hourglass& modes, const HexaRest& rest, const Mat37& gradient) {
  const Mat34 q = gradient.rightCols<4>(), back = turned_back(gradient.leftCols<3>(), q);
  return rest.volume_m3 * elastic_energy_density(m, gradient.leftCols<3>()) +
         0.5 * back.cwiseProduct(times_c(modes.c, back)).sum() + 0.5 * modes.k0 * q.squaredNorm();
}

Mat37 elastic_stress(const TetraMaterial& m, const Hourglass& modes, const HexaRest& rest, const Mat37& gradient) {
  const Mat34 q = gradient.rightCols<4>();
  Mat37 p = pulled(gradient, times_c(modes.c, turned_back(gradient.leftCols<3>(), q)));
  p.leftCols<3>() += rest.volume_m3 * elastic_stress(m, gradient.leftCols<3>());
  p.rightCols<4>() += modes.k0 * q;
  return p;
}

Mat37 viscous_stress(const TetraMaterial& m, const Hourglass& modes, const HexaRest& rest, const Mat37& gradient,
                     const Mat37& rate) {
  const Mat34 back = modes.damping_s * changed(gradient, rate);
  Mat37 p = pulled(gradient, times_c(modes.c, back) + modes.k0 * back);
  p.leftCols<3>() += rest.volume_m3 * viscous_stress(m, gradient.leftCols<3>(), rate.leftCols<3>());
  return p;
}

Mat37 second_order_stress(const TetraMaterial& m, const Hourglass& modes, const HexaRest& rest, const Mat37& gradient,
                          const Mat37& change_1, const Mat37& change_2) {
  const Mat34 s_1 = times_c(modes.c, changed(gradient, change_1)), s_2 = times_c(modes.c, changed(gradient, change_2));
  Mat37 p = pulled(gradient, times_c(modes.c, changed(change_1, change_2))) + pulled(change_1, s_2) + pulled(change_2, s_1);
  p.leftCols<3>() +=
      rest.volume_m3 * second_order_stress(m, gradient.leftCols<3>(), change_1.leftCols<3>(), change_2.leftCols<3>());
  return p;
}

HexaTangent::HexaTangent(const TetraMaterial& material, const Hourglass& modes, const Mat37& gradient, bool clamp)
    : gradient_(gradient),
      s_(clamp ? Mat34(Mat34::Zero()) : times_c(modes.c, turned_back(f(), q()))),
      of_law_(material, f(), clamp) {}

Mat3 HexaTangent::block(const TetraMaterial& m, const Hourglass& modes, const HexaRest& rest, int i, int j, double c_d,
                        double c_k) const {
  const Vec3 bi = rest.g.col(i).head<3>(), bj = rest.g.col(j).head<3>();
  const Eigen::Vector4d gi = rest.g.col(i).tail<4>(), gj = rest.g.col(j).tail<4>();
  const auto motion_of = [&](const Vec3& b, const Eigen::Vector4d& gamma) {  // F^T q by one node's motion
    Eigen::Matrix<double, 12, 3> moved;
    for (int a = 0; a < kModesOfHexa; ++a)
      moved.middleRows<3>(3 * a) = b * gradient_.col(3 + a).transpose() + gamma[a] * gradient_.leftCols<3>().transpose();
    return moved;
  };
  const Eigen::Matrix<double, 12, 3> mi = motion_of(bi, gi), mj = motion_of(bj, gj);
  const double viscous = c_d * modes.damping_s;
  Mat3 k = mi.transpose() * ((c_k + viscous) * (modes.c * mj) + viscous * modes.k0 * mj);
  k.diagonal().array() += c_k * (bi.dot(s_ * gj) + bj.dot(s_ * gi) + modes.k0 * gi.dot(gj));
  k += c_k * of_law_.block(rest.volume_m3, bi, bj, i == j);
  return k + c_d * viscous_block(m, rest.volume_m3, bi, bj, f());
}

}  // namespace palpate
