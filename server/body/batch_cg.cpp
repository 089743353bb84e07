#include "server/body/batch_cg.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace palpate {
namespace {

constexpr int kLanes = BatchConjugateGradients::kColumns;

// Eight floats as one value; where the processor is narrower the compiler makes two of it. Passed to no function that is not
// inlined: how that is done depends on the processor that is compiled for.
using Wide = float __attribute__((vector_size(kLanes * sizeof(float)), may_alias));

[[gnu::always_inline]] inline Wide& wide(float (&lanes)[kLanes]) { return *reinterpret_cast<Wide*>(lanes); }
[[gnu::always_inline]] inline const Wide& wide(const float (&lanes)[kLanes]) { return *reinterpret_cast<const Wide*>(lanes); }

/// A sum over nodes: a few in single precision, these in double.
class Sum {
 public:
  [[gnu::always_inline]] void add(const Wide& term) {
    wide(few_) += term;
    if (++count_ == kFew) flush();
  }
  void take(double (&total)[kLanes]) {
    flush();
    std::copy(std::begin(total_), std::end(total_), std::begin(total));
  }

 private:
  static constexpr int kFew = 16;
  void flush() {
    for (int c = 0; c < kLanes; ++c) total_[c] += static_cast<double>(few_[c]);
    std::fill(std::begin(few_), std::end(few_), 0.0F);
    count_ = 0;
  }
  alignas(sizeof(Wide)) float few_[kLanes] = {};
  double total_[kLanes] = {};
  int count_ = 0;
};

}  // namespace

BatchConjugateGradients::Symmetric::Symmetric(const Mat3& m)
    : xx(static_cast<float>(m(0, 0))),
      xy(static_cast<float>(m(0, 1))),
      xz(static_cast<float>(m(0, 2))),
      yy(static_cast<float>(m(1, 1))),
      yz(static_cast<float>(m(1, 2))),
      zz(static_cast<float>(m(2, 2))) {}

void BatchConjugateGradients::prepare(const BlockMatrix& a, const std::vector<std::uint8_t>& held, CoarseCorrection coarse) {
  coarse_ = std::move(coarse);
  const std::uint32_t nodes = a.rows();
  first_.assign(1, 0);
  pairs_.clear();
  diagonal_.resize(nodes);
  inverse_.resize(nodes);
  free_.resize(nodes);
  for (std::uint32_t i = 0; i < nodes; ++i) {
    for (std::uint32_t e = a.row_begin(i); e < a.row_end(i); ++e) {
      if (a.column(e) <= i) continue;
      Pair& pair = pairs_.emplace_back();
      pair.column = a.column(e);
      Eigen::Map<Eigen::Matrix<float, 3, 3, Eigen::RowMajor>>(pair.block) = a.block(e).cast<float>();
    }
    first_.push_back(static_cast<std::uint32_t>(pairs_.size()));
    const Mat3 block = a.block(a.diagonal(i));
    diagonal_[i] = Symmetric(block);
    inverse_[i] = Symmetric(held[i] ? Mat3(Mat3::Zero()) : Mat3(block.inverse()));
    free_[i] = held[i] ? 0.0F : 1.0F;
  }
  for (auto* rows : {&x_, &r_, &z_, &p_, &ap_}) rows->resize(nodes);
}

void BatchConjugateGradients::multiply(const std::vector<Rows>& p, std::vector<Rows>& y) const {
  for (std::size_t i = 0; i < p.size(); ++i) {
    const Symmetric& d = diagonal_[i];
    const Wide px = wide(p[i].x), py = wide(p[i].y), pz = wide(p[i].z);
    wide(y[i].x) = d.xx * px + d.xy * py + d.xz * pz;
    wide(y[i].y) = d.xy * px + d.yy * py + d.yz * pz;
    wide(y[i].z) = d.xz * px + d.yz * py + d.zz * pz;
  }
  for (std::size_t i = 0; i < p.size(); ++i) {
    const Wide px = wide(p[i].x), py = wide(p[i].y), pz = wide(p[i].z);
    Wide sx{}, sy{}, sz{};
    for (std::uint32_t at = first_[i]; at < first_[i + 1]; ++at) {
      const float(&b)[9] = pairs_[at].block;
      const Rows& q = p[pairs_[at].column];
      Rows& to = y[pairs_[at].column];
      const Wide qx = wide(q.x), qy = wide(q.y), qz = wide(q.z);
      sx += b[0] * qx + b[1] * qy + b[2] * qz;
      sy += b[3] * qx + b[4] * qy + b[5] * qz;
      sz += b[6] * qx + b[7] * qy + b[8] * qz;
      wide(to.x) += b[0] * px + b[3] * py + b[6] * pz;
      wide(to.y) += b[1] * px + b[4] * py + b[7] * pz;
      wide(to.z) += b[2] * px + b[5] * py + b[8] * pz;
    }
    wide(y[i].x) += sx, wide(y[i].y) += sy, wide(y[i].z) += sz;
  }
}

BatchConjugateGradients::Lanes BatchConjugateGradients::dot(const std::vector<Rows>& a, const std::vector<Rows>& b) {
  Sum sum;
  for (std::size_t i = 0; i < a.size(); ++i)
    sum.add(wide(a[i].x) * wide(b[i].x) + wide(a[i].y) * wide(b[i].y) + wide(a[i].z) * wide(b[i].z));
  Lanes total;
  sum.take(total.v);
  return total;
}

/// x += alpha p, r -= alpha A p, z = the preconditioned r.
void BatchConjugateGradients::advance(const Lanes& alpha, Lanes& rr, Lanes& rz) {
  Wide by;
  for (int c = 0; c < kLanes; ++c) by[c] = static_cast<float>(alpha.v[c]);
  Sum sum_rr, sum_rz;
  for (std::size_t i = 0; i < r_.size(); ++i) {
    wide(x_[i].x) += by * wide(p_[i].x);
    wide(x_[i].y) += by * wide(p_[i].y);
    wide(x_[i].z) += by * wide(p_[i].z);
    const Wide here = by * free_[i];
    const Wide rx = wide(r_[i].x) - here * wide(ap_[i].x), ry = wide(r_[i].y) - here * wide(ap_[i].y),
               rz_i = wide(r_[i].z) - here * wide(ap_[i].z);
    wide(r_[i].x) = rx, wide(r_[i].y) = ry, wide(r_[i].z) = rz_i;
    const Symmetric& b = inverse_[i];
    const Wide zx = b.xx * rx + b.xy * ry + b.xz * rz_i, zy = b.xy * rx + b.yy * ry + b.yz * rz_i,
               zz = b.xz * rx + b.yz * ry + b.zz * rz_i;
    wide(z_[i].x) = zx, wide(z_[i].y) = zy, wide(z_[i].z) = zz;
    sum_rr.add(rx * rx + ry * ry + rz_i * rz_i);
    sum_rz.add(rx * zx + ry * zy + rz_i * zz);
  }
  sum_rr.take(rr.v);
  sum_rz.take(rz.v);
  if (coarse_.inverse) add_coarse(rz);
}

void BatchConjugateGradients::add_coarse(Lanes& rz) {
  constexpr std::size_t kMotions = CoarseSpace::kMotions;
  const std::span<const CoarseSpace::Node> nodes = coarse_.nodes;
  const std::vector<float>& inverse = coarse_.inverse->rows;
  const std::size_t size = coarse_.inverse->size;
  coarse_r_.assign(size, Row{});
  coarse_z_.resize(size);
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (nodes[i].piece == CoarseSpace::kNone) continue;
    const float(&a)[3] = nodes[i].arm;
    Row* const to = &coarse_r_[kMotions * nodes[i].piece];
    const Wide rx = wide(r_[i].x), ry = wide(r_[i].y), rz_i = wide(r_[i].z);
    wide(to[0].v) += rx, wide(to[1].v) += ry, wide(to[2].v) += rz_i;
    wide(to[3].v) += a[1] * rz_i - a[2] * ry;
    wide(to[4].v) += a[2] * rx - a[0] * rz_i;
    wide(to[5].v) += a[0] * ry - a[1] * rx;
  }
  Sum sum;
  for (std::size_t k = 0; k < size; k += kMotions) {
    Wide total[kMotions] = {};
    const float* const rows = inverse.data() + k * size;
    for (std::size_t l = 0; l < size; ++l) {
      const Wide r = wide(coarse_r_[l].v);
      for (std::size_t m = 0; m < kMotions; ++m) total[m] += rows[m * size + l] * r;
    }
    for (std::size_t m = 0; m < kMotions; ++m) {
      wide(coarse_z_[k + m].v) = total[m];
      sum.add(total[m] * wide(coarse_r_[k + m].v));
    }
  }
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (nodes[i].piece == CoarseSpace::kNone) continue;
    const float(&a)[3] = nodes[i].arm;
    const Row* const from = &coarse_z_[kMotions * nodes[i].piece];
    const Wide wx = wide(from[3].v), wy = wide(from[4].v), wz = wide(from[5].v);
    wide(z_[i].x) += free_[i] * (wide(from[0].v) + wy * a[2] - wz * a[1]);
    wide(z_[i].y) += free_[i] * (wide(from[1].v) + wz * a[0] - wx * a[2]);
    wide(z_[i].z) += free_[i] * (wide(from[2].v) + wx * a[1] - wy * a[0]);
  }
  Lanes more;
  sum.take(more.v);
  for (int c = 0; c < kColumns; ++c) rz.v[c] += more.v[c];
}

/// Puts a column into a lane, scaled so that b has unit length: nothing small is lost below the smallest float. The first guess
/// becomes the first direction, as long as 1, and goes as far as is best along it: along.v[lane] is its product with b. False
/// where b is zero, and then x is.
bool BatchConjugateGradients::load(const SolveColumn& column, int lane, double& scale, Lanes& along) {
  const bool guessed = column.x->size() == column.b->size();
  double square = 0, guess_square = 0, product = 0;
  for (std::size_t i = 0; i < r_.size(); ++i) {
    if (!(free_[i] > 0)) continue;
    const auto b = column.b->segment<3>(3 * static_cast<Eigen::Index>(i));
    square += b.squaredNorm();
    if (!guessed) continue;
    const auto x = column.x->segment<3>(3 * static_cast<Eigen::Index>(i));
    guess_square += x.squaredNorm();
    product += b.dot(x);
  }
  scale = std::sqrt(square);
  if (!(scale > 0)) {
    column.x->setZero(column.b->size());
    return false;
  }
  const double guess = std::sqrt(guess_square), shorten = std::isnormal(guess) ? 1 / guess : 0;
  along.v[lane] = shorten > 0 ? product / scale * shorten : 0;
  for (std::size_t i = 0; i < r_.size(); ++i) {
    const double by = free_[i] > 0 ? 1 / scale : 0;
    const double* b = column.b->data() + 3 * i;
    const double* x = free_[i] > 0 && shorten > 0 ? column.x->data() + 3 * i : nullptr;
    r_[i].x[lane] = static_cast<float>(by * b[0]);
    r_[i].y[lane] = static_cast<float>(by * b[1]);
    r_[i].z[lane] = static_cast<float>(by * b[2]);
    p_[i].x[lane] = x ? static_cast<float>(shorten * x[0]) : 0;
    p_[i].y[lane] = x ? static_cast<float>(shorten * x[1]) : 0;
    p_[i].z[lane] = x ? static_cast<float>(shorten * x[2]) : 0;
    x_[i].x[lane] = x_[i].y[lane] = x_[i].z[lane] = 0;
  }
  return true;
}

void BatchConjugateGradients::unload(const SolveColumn& column, int lane, double scale) const {
  column.x->resize(column.b->size());
  double* to = column.x->data();
  for (const Rows& rows : x_) {
    *to++ = scale * static_cast<double>(rows.x[lane]);
    *to++ = scale * static_cast<double>(rows.y[lane]);
    *to++ = scale * static_cast<double>(rows.z[lane]);
  }
}

/// p = z + beta p.
void BatchConjugateGradients::turn(const Lanes& beta) {
  Wide by;
  for (int c = 0; c < kLanes; ++c) by[c] = static_cast<float>(beta.v[c]);
  for (std::size_t i = 0; i < p_.size(); ++i) {
    wide(p_[i].x) = wide(z_[i].x) + by * wide(p_[i].x);
    wide(p_[i].y) = wide(z_[i].y) + by * wide(p_[i].y);
    wide(p_[i].z) = wide(z_[i].z) + by * wide(p_[i].z);
  }
}

int BatchConjugateGradients::solve(std::span<const SolveColumn> columns, double tolerance, bool& positive_definite) {
  struct Lane {
    const SolveColumn* column = nullptr;  // null: nothing to do
    int steps = 0;
    double scale = 0;
  };
  std::array<Lane, kColumns> lanes;
  Lanes alpha, beta, rr, rz;
  tolerance = std::max(tolerance, kTightest);
  const int limit = 3 * static_cast<int>(r_.size()) + 50;
  int iterations = 0;
  for (std::size_t next = 0;;) {
    // A column takes the lane of one that is done.
    for (int c = 0; c < kColumns; ++c)
      for (Lane& lane = lanes[static_cast<std::size_t>(c)]; !lane.column && next < columns.size(); ++next)
        if (load(columns[next], c, lane.scale, rz)) {
          lane.column = &columns[next];
          lane.steps = 0;
        }
    if (std::none_of(lanes.begin(), lanes.end(), [](const Lane& lane) { return lane.column; })) return iterations;
    multiply(p_, ap_);
    const Lanes curvature = dot(p_, ap_);
    for (std::size_t c = 0; c < lanes.size(); ++c) {
      const bool curves = curvature.v[c] > 0;
      if (lanes[c].column && lanes[c].steps > 0) positive_definite &= curves;
      alpha.v[c] = lanes[c].column && curves ? rz.v[c] / curvature.v[c] : 0;
    }
    const Lanes before = rz;
    if (positive_definite) advance(alpha, rr, rz);
    for (std::size_t c = 0; c < lanes.size(); ++c) {
      Lane& lane = lanes[c];
      beta.v[c] = 0;
      if (!lane.column) continue;
      if (lane.steps > 0) {
        beta.v[c] = rz.v[c] / before.v[c];
        ++iterations;
      }
      ++lane.steps;
      if (positive_definite && std::sqrt(rr.v[c]) > lane.column->looser * tolerance && lane.steps <= limit) continue;
      unload(*lane.column, static_cast<int>(c), lane.scale);
      lane.column = nullptr;
      beta.v[c] = 0;
    }
    if (!positive_definite) return iterations;
    turn(beta);
  }
}

}  // namespace palpate
