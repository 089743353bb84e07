#include "server/solve/ssor_cg.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "server/solve/fused.hpp"
#include "server/solve/node_sum.hpp"

namespace palpate {
namespace {

using Four = float __attribute__((vector_size(16), may_alias));

template <class Quad>
[[gnu::always_inline]] inline Four& four(Quad& quad) {
  return reinterpret_cast<Four&>(quad.v);
}
template <class Quad>
[[gnu::always_inline]] inline const Four& four(const Quad& quad) {
  return reinterpret_cast<const Four&>(quad.v);
}

struct FourLanes {
  using Term = Four;
};
using Sum = NodeSum<FourLanes>;
double total(Sum& sum) {
  const auto lanes = sum.total();
  return lanes[0] + lanes[1] + lanes[2] + lanes[3];
}

}  // namespace

void SsorConjugateGradients::read_pattern(const BlockMatrix& a) {
  std::vector<std::uint32_t> upper_half(a.block_count());
  struct Block {
    std::uint32_t column, entry;
    bool operator<(const Block& other) const { return column < other.column; }
  };
  std::vector<Block> blocks;
  for (const bool lower : {false, true}) {
    StrictTriangle& triangle = lower ? lower_ : upper_;
    triangle.first.assign(1, 0);
    for (std::uint32_t k = 0; k < a.rows(); ++k) {
      blocks.clear();
      for (std::uint32_t e = a.row_begin(k); e < a.row_end(k); ++e)
        if (const std::uint32_t column = a.column(e); lower ? column < k : column > k) blocks.push_back({column, e});
      // Those that are known last come last.
      std::sort(blocks.begin(), blocks.end());
      if (!lower) std::reverse(blocks.begin(), blocks.end());
      for (std::size_t n = 0; n < blocks.size(); ++n) {
        const auto half = static_cast<std::uint32_t>(2 * triangle.columns.size());
        if (n % 2 == 0) triangle.columns.push_back({blocks[n].column, blocks[n].column});
        triangle.columns.back().b = blocks[n].column;
        const std::uint32_t at = n % 2 == 0 ? half : half - 1;
        if (lower)
          places_.push_back({blocks[n].entry, k, blocks[n].column, at, upper_half[a.find(blocks[n].column, k)]});
        else
          upper_half[blocks[n].entry] = at;
      }
      triangle.first.push_back(static_cast<std::uint32_t>(triangle.columns.size()));
    }
    triangle.pairs.assign(triangle.columns.size(), Pair{});
  }
  scale_.resize(a.rows());
}

void SsorConjugateGradients::put(const Quad (&columns)[3], std::uint32_t half, StrictTriangle& to) {
  for (int c = 0; c < 3; ++c) four(*reinterpret_cast<Quad*>(&to.pairs[half / 2].columns[c][4 * (half % 2)])) = four(columns[c]);
}

bool SsorConjugateGradients::pack(const BlockMatrix& a) {
  if (scale_.empty()) read_pattern(a);
  struct Factor {
    Quad columns[3];
  };
  std::vector<Factor> factors(scale_.size());
  for (std::size_t k = 0; k < scale_.size(); ++k) {
    const Eigen::LLT<Mat3> llt(Mat3(a.block(a.diagonal(static_cast<std::uint32_t>(k)))));
    if (llt.info() != Eigen::Success) return false;
    scale_[k] = llt.matrixL().solve(Mat3(Mat3::Identity()));
    for (int c = 0; c < 3; ++c)
      for (int r = 0; r < 4; ++r) factors[k].columns[c].v[r] = r < 3 ? static_cast<float>(scale_[k](r, c)) : 0;
  }
  for (const Place& place : places_) {
    const auto block = a.block(place.entry);
    const Quad(&left)[3] = factors[place.row].columns;
    const Quad(&right)[3] = factors[place.column].columns;
    // S_row^-1 A S_column^-T, column by column; S^-1 has only zeros above its diagonal.
    Four half[3];
    for (int c = 0; c < 3; ++c)
      half[c] = static_cast<float>(block(0, c)) * four(left[0]) + static_cast<float>(block(1, c)) * four(left[1]) +
                static_cast<float>(block(2, c)) * four(left[2]);
    Quad columns[3], rows[3];
    four(columns[0]) = right[0].v[0] * half[0];
    four(columns[1]) = right[0].v[1] * half[0] + right[1].v[1] * half[1];
    four(columns[2]) = right[0].v[2] * half[0] + right[1].v[2] * half[1] + right[2].v[2] * half[2];
    for (int c = 0; c < 3; ++c)
      for (int r = 0; r < 4; ++r) rows[c].v[r] = r < 3 ? columns[r].v[c] : 0;
    put(columns, place.lower, lower_);
    put(rows, place.upper, upper_);
  }
  return true;
}

[[gnu::always_inline]] inline SsorConjugateGradients::Quad SsorConjugateGradients::product(const StrictTriangle& triangle,
                                                                                           std::size_t row, const Quads& x) {
  EightFloats s0{}, s1{}, s2{};  // three sums that do not wait for each other
  for (std::uint32_t k = triangle.first[row]; k < triangle.first[row + 1]; ++k) {
    const Four& a = four(x[triangle.columns[k].a]);
    const Four& b = four(x[triangle.columns[k].b]);
    const auto* columns = reinterpret_cast<const EightFloats*>(triangle.pairs[k].columns);
    const EightFloats p = __builtin_shufflevector(a, b, 0, 1, 2, 3, 4, 5, 6, 7);
    add_product(columns[0], __builtin_shufflevector(p, p, 0, 0, 0, 0, 4, 4, 4, 4), s0);
    add_product(columns[1], __builtin_shufflevector(p, p, 1, 1, 1, 1, 5, 5, 5, 5), s1);
    add_product(columns[2], __builtin_shufflevector(p, p, 2, 2, 2, 2, 6, 6, 6, 6), s2);
  }
  const EightFloats sum = s0 + s1 + s2;
  Quad product;
  four(product) = __builtin_shufflevector(sum, sum, 0, 1, 2, 3) + __builtin_shufflevector(sum, sum, 4, 5, 6, 7);
  return product;
}

/// t = C^-T p
void SsorConjugateGradients::solve_upper(const Quads& p, Quads& t) const {
  for (std::size_t k = p.size(); k-- > 0;) four(t[k]) = four(p[k]) - four(product(upper_, k, t));
}

/// y = C^-1 q, row by row; use(row) is called with each y.
template <class Use>
void SsorConjugateGradients::solve_lower(const Quads& q, Quads& y, const Use& use) const {
  for (std::size_t k = 0; k < q.size(); ++k) {
    four(y[k]) = four(q[k]) - four(product(lower_, k, y));
    use(k);
  }
}

int SsorConjugateGradients::solve(const Vector& r, double tolerance, Vector& x, bool& positive_definite) {
  const std::size_t n = scale_.size();
  // Scaled to unit length, so that nothing small is lost below the smallest float.
  const double length = r.norm();
  for (Quads* quads : {&d_, &r_, &p_, &t_, &y_, &q_}) quads->resize(n);
  for (std::size_t k = 0; k < n; ++k) {
    const Eigen::Vector3f scaled = (scale_[k] * r.segment<3>(3 * static_cast<Eigen::Index>(k)) / length).cast<float>();
    four(q_[k]) = Four{scaled.x(), scaled.y(), scaled.z(), 0};
    four(d_[k]) = Four{};
  }
  Sum square;
  solve_lower(q_, r_, [&](std::size_t k) { square.add(four(r_[k]) * four(r_[k])); });
  p_ = r_;
  double rr = total(square);
  const double target = tolerance * tolerance * rr;
  int iterations = 0;
  const int limit = 3 * static_cast<int>(n) + 50;
  while (iterations < limit && rr > target) {
    ++iterations;
    solve_upper(p_, t_);
    for (std::size_t k = 0; k < n; ++k) four(q_[k]) = four(p_[k]) - four(t_[k]);
    Sum bends;
    solve_lower(q_, y_, [&](std::size_t k) {
      four(q_[k]) = four(t_[k]) + four(y_[k]);  // A^ p
      bends.add(four(p_[k]) * four(q_[k]));
    });
    const double curvature = total(bends);
    if (!(curvature > 0)) {
      positive_definite = false;
      break;
    }
    const auto alpha = static_cast<float>(rr / curvature);
    Sum next;
    for (std::size_t k = 0; k < n; ++k) {
      four(d_[k]) += alpha * four(t_[k]);
      four(r_[k]) -= alpha * four(q_[k]);
      next.add(four(r_[k]) * four(r_[k]));
    }
    const double rr_next = total(next);
    const auto beta = static_cast<float>(rr_next / rr);
    for (std::size_t k = 0; k < n; ++k) four(p_[k]) = four(r_[k]) + beta * four(p_[k]);
    rr = rr_next;
  }
  for (std::size_t k = 0; k < n; ++k) {
    const Vec3 d(d_[k].v[0], d_[k].v[1], d_[k].v[2]);
    x.segment<3>(3 * static_cast<Eigen::Index>(k)) += length * scale_[k].transpose() * d;
  }
  return iterations;
}

}  // namespace palpate
