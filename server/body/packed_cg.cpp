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

}  // namespace

void PackedConjugateGradients::pack(const BlockMatrix& a) {
  a_ = &a;
  blocks_.resize(a.block_count());
  for (std::uint32_t e = 0; e < a.block_count(); ++e) {
    blocks_[e].topRows<3>() = a.block(e).cast<float>();
    blocks_[e].row(3).setZero();
  }
  inverse_diagonal_.resize(a.rows());
  for (std::uint32_t i = 0; i < a.rows(); ++i) {
    inverse_diagonal_[i].topRows<3>() = Mat3(a.block(a.diagonal(i))).inverse().cast<float>();
    inverse_diagonal_[i].row(3).setZero();
  }
}

void PackedConjugateGradients::multiply(const Nodes& x, Nodes& y) const {
  // Six sums that do not wait for each other: with one, each addition's latency would set the pace.
  for (std::uint32_t i = 0; i < a_->rows(); ++i) {
    Node s0 = Node::Zero(), s1 = s0, s2 = s0, s3 = s0, s4 = s0, s5 = s0;
    std::uint32_t e = a_->row_begin(i);
    const std::uint32_t end = a_->row_end(i);
    for (; e + 1 < end; e += 2) {
      const Block &b = blocks_[e], &c = blocks_[e + 1];
      const Node &p = x[a_->column(e)], &q = x[a_->column(e + 1)];
      s0 += b.col(0) * p[0];
      s1 += b.col(1) * p[1];
      s2 += b.col(2) * p[2];
      s3 += c.col(0) * q[0];
      s4 += c.col(1) * q[1];
      s5 += c.col(2) * q[2];
    }
    if (e < end) {
      const Block& b = blocks_[e];
      const Node& p = x[a_->column(e)];
      s0 += b.col(0) * p[0];
      s1 += b.col(1) * p[1];
      s2 += b.col(2) * p[2];
    }
    y[i] = ((s0 + s3) + (s1 + s4)) + (s2 + s5);
  }
}

void PackedConjugateGradients::precondition(const Nodes& r, Nodes& z) const {
  for (std::size_t i = 0; i < r.size(); ++i)
    z[i] = inverse_diagonal_[i].col(0) * r[i][0] + inverse_diagonal_[i].col(1) * r[i][1] + inverse_diagonal_[i].col(2) * r[i][2];
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
  for (std::size_t i = 0; i < n; ++i)
    x.segment<3>(3 * static_cast<Eigen::Index>(i)) += scale * d_[i].head<3>().cast<double>();
  return iterations;
}

}  // namespace palpate
