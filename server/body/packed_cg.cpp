#include "server/body/packed_cg.hpp"

#include <Eigen/LU>
#include <cmath>

namespace palpate {
namespace {

/// Sums in double: a single-precision sum over thousands of nodes would cost digits that the recursion needs.
template <class Nodes>
double dot(const Nodes& a, const Nodes& b) {
  Eigen::Vector4d sum = Eigen::Vector4d::Zero();
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i].cwiseProduct(b[i]).template cast<double>();
  return sum.sum();
}

using FloatBlock = Eigen::Map<Eigen::Matrix3f>;
Eigen::Map<const Eigen::Vector4f> column(const float* at) { return Eigen::Map<const Eigen::Vector4f>(at); }

}  // namespace

void PackedConjugateGradients::pack(const BlockMatrix& a) {
  a_ = &a;
  blocks_.resize(9 * std::size_t{a.block_count()} + 1);
  for (std::uint32_t e = 0; e < a.block_count(); ++e) FloatBlock(blocks_.data() + 9 * std::size_t{e}) = a.block(e).cast<float>();
  inverse_diagonal_.resize(9 * std::size_t{a.rows()} + 1);
  for (std::uint32_t i = 0; i < a.rows(); ++i)
    FloatBlock(inverse_diagonal_.data() + 9 * std::size_t{i}) = Mat3(a.block(a.diagonal(i))).inverse().cast<float>();
}

void PackedConjugateGradients::multiply(const Nodes& x, Nodes& y) const {
  // Three sums that do not wait for each other.
  const float* b = blocks_.data();
  for (std::uint32_t i = 0; i < a_->rows(); ++i) {
    Node s0 = Node::Zero(), s1 = s0, s2 = s0;
    for (std::uint32_t e = a_->row_begin(i); e < a_->row_end(i); ++e, b += 9) {
      const Node& p = x[a_->column(e)];
      s0 += column(b) * p[0];
      s1 += column(b + 3) * p[1];
      s2 += column(b + 6) * p[2];
    }
    y[i] = s0 + s1 + s2;
    y[i][3] = 0;
  }
}

void PackedConjugateGradients::precondition(const Nodes& r, Nodes& z) const {
  const float* b = inverse_diagonal_.data();
  for (std::size_t i = 0; i < r.size(); ++i, b += 9) {
    z[i] = column(b) * r[i][0] + column(b + 3) * r[i][1] + column(b + 6) * r[i][2];
    z[i][3] = 0;
  }
}

int PackedConjugateGradients::solve(const Vector& r, double tolerance, Vector& x, bool& positive_definite) {
  const std::size_t n = a_->rows();
  // Scaled to unit length, so that nothing small is lost below the smallest float.
  const double scale = r.norm();
  for (Nodes* nodes : {&d_, &r_, &z_, &p_, &ap_}) nodes->resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    d_[i].setZero();
    r_[i] << (r.segment<3>(3 * static_cast<Eigen::Index>(i)) / scale).cast<float>(), 0.0F;
  }
  precondition(r_, z_);
  p_ = z_;
  double rz = dot(r_, z_);
  int iterations = 0;
  const int limit = 3 * static_cast<int>(n) + 50;
  while (iterations < limit) {
    ++iterations;
    multiply(p_, ap_);
    const double curvature = dot(p_, ap_);
    if (!(curvature > 0)) {
      positive_definite = false;
      break;
    }
    const auto alpha = static_cast<float>(rz / curvature);
    for (std::size_t i = 0; i < n; ++i) {
      d_[i] += alpha * p_[i];
      r_[i] -= alpha * ap_[i];
    }
    if (std::sqrt(dot(r_, r_)) <= tolerance) break;
    precondition(r_, z_);
    const double rz_next = dot(r_, z_);
    const auto beta = static_cast<float>(rz_next / rz);
    for (std::size_t i = 0; i < n; ++i) p_[i] = z_[i] + beta * p_[i];
    rz = rz_next;
  }
  for (std::size_t i = 0; i < n; ++i) x.segment<3>(3 * static_cast<Eigen::Index>(i)) += scale * d_[i].head<3>().cast<double>();
  return iterations;
}

}  // namespace palpate
