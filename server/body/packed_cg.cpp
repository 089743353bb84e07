#include "server/body/packed_cg.hpp"

#include <Eigen/LU>
#include <cmath>

#include "server/body/fused.hpp"

namespace palpate {
namespace {

/// Sums in double: a single-precision sum over thousands of nodes would cost digits that the recursion needs.
template <class Nodes>
double dot(const Nodes& a, const Nodes& b) {
  Eigen::Vector4d sum = Eigen::Vector4d::Zero();
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i].cwiseProduct(b[i]).template cast<double>();
  return sum.sum();
}

using Half = float __attribute__((vector_size(16), may_alias));

}  // namespace

void PackedConjugateGradients::take_pattern(const BlockMatrix& a) {
  first_.assign(1, 0);
  for (std::uint32_t i = 0; i < a.rows(); ++i) {
    for (std::uint32_t e = a.row_begin(i); e < a.row_end(i); e += 2)
      neighbours_.push_back({a.column(e), a.column(e + 1 < a.row_end(i) ? e + 1 : e)});
    first_.push_back(static_cast<std::uint32_t>(neighbours_.size()));
  }
  pairs_.assign(neighbours_.size(), Pair{});
  inverse_diagonal_.resize(a.rows());
}

void PackedConjugateGradients::pack(const BlockMatrix& a) {
  if (first_.empty()) take_pattern(a);
  for (std::uint32_t i = 0; i < a.rows(); ++i) {
    for (std::uint32_t e = a.row_begin(i); e < a.row_end(i); ++e) {
      const std::uint32_t at = e - a.row_begin(i);
      Pair& pair = pairs_[first_[i] + at / 2];
      const auto block = a.block(e);
      for (int c = 0; c < 3; ++c)
        for (int r = 0; r < 3; ++r) pair.columns[c][4 * (at % 2) + static_cast<unsigned>(r)] = static_cast<float>(block(r, c));
    }
    inverse_diagonal_[i] = Mat3(a.block(a.diagonal(i))).inverse().cast<float>();
  }
}

void PackedConjugateGradients::multiply(const Nodes& x, Nodes& y) const {
  for (std::size_t i = 0; i + 1 < first_.size(); ++i) {
    EightFloats s0{}, s1{}, s2{};  // three sums that do not wait for each other
    for (std::uint32_t k = first_[i]; k < first_[i + 1]; ++k) {
      const auto& a = *reinterpret_cast<const Half*>(x[neighbours_[k].a].data());
      const auto& b = *reinterpret_cast<const Half*>(x[neighbours_[k].b].data());
      const auto* columns = reinterpret_cast<const EightFloats*>(pairs_[k].columns);
      const EightFloats p = __builtin_shufflevector(a, b, 0, 1, 2, 3, 4, 5, 6, 7);
      s0 += columns[0] * __builtin_shufflevector(p, p, 0, 0, 0, 0, 4, 4, 4, 4);
      s1 += columns[1] * __builtin_shufflevector(p, p, 1, 1, 1, 1, 5, 5, 5, 5);
      s2 += columns[2] * __builtin_shufflevector(p, p, 2, 2, 2, 2, 6, 6, 6, 6);
    }
    const EightFloats sum = s0 + s1 + s2;
    y[i] << sum[0] + sum[4], sum[1] + sum[5], sum[2] + sum[6], 0.0F;
  }
}

void PackedConjugateGradients::precondition(const Nodes& r, Nodes& z) const {
  for (std::size_t i = 0; i < r.size(); ++i) z[i].head<3>() = inverse_diagonal_[i] * r[i].head<3>();
}

int PackedConjugateGradients::solve(const Vector& r, double tolerance, Vector& x, bool& positive_definite) {
  const std::size_t n = inverse_diagonal_.size();
  // Scaled to unit length, so that nothing small is lost below the smallest float.
  const double scale = r.norm();
  for (Nodes* nodes : {&d_, &r_, &z_, &p_, &ap_}) nodes->resize(n, Node::Zero());
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
