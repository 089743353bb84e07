// Force of one tetrahedron beyond its linear force, against its law in double precision.
#include "common/port/nonlinear_tetrahedron.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <random>
#include <vector>

using namespace palpate;

namespace {

using Mat3d = Eigen::Matrix3d;

constexpr double kMu = 3, kLambda = 7;
const LawParameters kCorotational{SolidLaw::corotational, 0, {}, {}};

/// Rotation of the polar decomposition, by a singular value decomposition.
Mat3d rotation_next_to(const Mat3d& f) {
  const Eigen::JacobiSVD<Mat3d> svd(f, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Mat3d u = svd.matrixU();
  if (u.determinant() * svd.matrixV().determinant() < 0) u.col(2) *= -1;  // the smallest stretch is the negative one
  return u * svd.matrixV().transpose();
}

/// The first Piola-Kirchhoff stress of the corotational law.
Mat3d corotational_stress(const Mat3d& f) {
  const Mat3d r = rotation_next_to(f);
  return 2 * kMu * (f - r) + kLambda * (r.cwiseProduct(f).sum() - 3) * r;
}

class Draw {
 public:
  Mat3d rotation() {
    return Eigen::Quaterniond(Eigen::Vector4d::NullaryExpr([&] { return normal_(random_); })).normalized().toRotationMatrix();
  }
  double part() { return std::uniform_real_distribution<double>(0.3, 1)(random_); }
  Mat3d stretched(double s1, double s2, double s3) { return rotation() * Eigen::Vector3d(s1, s2, s3).asDiagonal() * rotation(); }

 private:
  std::mt19937 random_{5};
  std::normal_distribution<double> normal_;
};

TetraLanes in_all_lanes(const std::vector<Mat3d>& of) {
  TetraLanes m;
  for (std::size_t i = 0; i < 9; ++i)
    for (std::size_t l = 0; l < kTetraLane; ++l)
      m[i][static_cast<int>(l)] = static_cast<float>(of[l](static_cast<int>(i / 3), static_cast<int>(i % 3)));
  return m;
}

Mat3d as_matrix(const TetraLanes& q, std::size_t lane) {
  Mat3d m;
  for (std::size_t i = 0; i < 9; ++i)
    m(static_cast<int>(i / 3), static_cast<int>(i % 3)) = static_cast<double>(q[i][static_cast<int>(lane)]);
  return m;
}

/// Stress at F + dF minus that at F and its slope along dF, by differences.
Mat3d nonlinear_residual(const Mat3d& f, const Mat3d& df) {
  constexpr double h = 1e-5;
  const Mat3d slope = (corotational_stress(f + h * df) - corotational_stress(f - h * df)) / (2 * h);
  return corotational_stress(f + df) - corotational_stress(f) - slope;
}

/// Pushes as many tetrahedra at once as there are lanes, 50 times: stretched at the stamp; `next` returns F of a lane afterwards;
/// `right` is called with the error of the stress, and its size.
void push(const std::function<Mat3d(Draw&, int lane, const Mat3d& f)>& next, const std::function<void(double, double)>& right) {
  Draw draw;
  for (int k = 0; k < 50; ++k) {
    ElementLinearisation at;
    std::vector<Mat3d> f, df, frame, df_there;
    for (int l = 0; l < kTetraLane; ++l) {
      f.push_back(draw.stretched(1.2, 1, 0.7));
      df.push_back(next(draw, l, f.back()) - f.back());
      frame.push_back(frame_of(SolidLaw::corotational, f.back()));
      at.set(l, kCorotational, frame.back().transpose() * f.back(), kMu, kLambda);
      df_there.push_back(frame.back().transpose() * df.back());
    }
    const TetraLanes moved = in_all_lanes(df_there);
    ElementRotation turned;
    turn(at, moved, turned);
    const TetraLanes q = nonlinear_residual_stress(at, moved, turned);
    for (std::size_t l = 0; l < kTetraLane; ++l) {
      const Mat3d exact = nonlinear_residual(f[l], df[l]);
      right((frame[l] * as_matrix(q, l) - exact).norm(), exact.norm());
    }
  }
}

}  // namespace

TEST_CASE("a corotational tetrahedron pushes by its law however far it has turned since the stamp, and inside out") {
  // Far from where two stretches sum to zero, where the rotation jumps; any rotation, up to half a turn.
  push([](Draw& draw, int lane,
          const Mat3d&) { return lane % 2 ? draw.stretched(1.4, 0.9, -0.5) : draw.stretched(1.3, 0.8, 0.4); },
       [](double wrong, double size) { CHECK(wrong < 1e-5 * size); });
}

TEST_CASE(
    "a corotational tetrahedron that has turned little or somewhat since the stamp, all that are beside it too, pushes by its "
    "law") {
  const double most_rad = GENERATE(0.001, 0.03, 0.3, 1.2);
  push(
      [&](Draw& draw, int, const Mat3d& f) {
        const Eigen::AngleAxisd turn(draw.part() * most_rad, draw.rotation().col(0));
        return Mat3d(turn * f + 0.3 * most_rad * draw.rotation());
      },
      // Rounding of the input numbers in single precision.
      [&](double wrong, double) { CHECK(wrong < 3e-6 * most_rad * (kMu + kLambda)); });
}

TEST_CASE("a tetrahedron that turns from tick to tick has its rotation in the end as well as at the stamp, and after a jump") {
  constexpr int kTicks = 20'000;
  constexpr double kTickS = 5e-4;
  Draw draw;
  ElementLinearisation at;
  std::vector<Mat3d> stamp, frame, left, right, axis;
  for (int l = 0; l < kTetraLane; ++l) {
    stamp.push_back(draw.stretched(1.2, 1, 0.7));
    frame.push_back(frame_of(SolidLaw::corotational, stamp.back()));
    at.set(l, kCorotational, frame.back().transpose() * stamp.back(), kMu, kLambda);
    left.push_back(draw.rotation());
    right.push_back(draw.rotation());
    axis.push_back(draw.rotation());
  }
  ElementRotation turned;
  double worst = 0, longest = 0;
  for (int k = 1; k <= kTicks; ++k) {
    // Rotates further and further, some elements faster than one under a hurried hand, stretched on the way and half of them
    // inside out; all jump once.
    const double t = kTickS * k + (k > kTicks / 2 ? 5 : 0);
    std::vector<Mat3d> df;
    for (std::size_t l = 0; l < kTetraLane; ++l) {
      const double swing = std::sin(3 * t + static_cast<double>(l));
      const Eigen::Vector3d stretch(1.3 + 0.2 * swing, 0.9 - 0.2 * swing, l % 2 == 0 ? 0.5 + 0.1 * swing : 0.1 - 0.3 * swing);
      const Eigen::AngleAxisd turn((1 + 9.0 * static_cast<double>(l)) * t, axis[l].col(0));
      df.push_back(frame[l].transpose() * (turn * left[l] * stretch.asDiagonal() * right[l] - stamp[l]));
    }
    const TetraLanes moved = in_all_lanes(df);
    turn(at, moved, turned);
    for (std::size_t l = 0; l < kTetraLane; ++l) {
      const Mat3d r = Mat3d::Identity() + as_matrix(turned.d, l);
      worst = std::max(worst, (r - rotation_next_to(frame[l].transpose() * stamp[l] + df[l])).norm());
      longest = std::max(longest, (r.transpose() * r - Mat3d::Identity()).norm());
    }
  }
  CHECK(worst < 2e-6);
  CHECK(longest < 2e-6);  // due to single precision
}
