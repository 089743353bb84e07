#include "server/body/batch_cg.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

#include "server/solve/fused.hpp"
#include "server/solve/node_sum.hpp"

namespace palpate {
namespace {

constexpr int kLanes = BatchConjugateGradients::kColumns;

// Eight floats as one value; where the processor is narrower the compiler makes two of it. Passed to no function that is not
// inlined: how that is done depends on the processor that is compiled for.
using Wide = EightFloats;
static_assert(sizeof(Wide) == kLanes * sizeof(float));

[[gnu::always_inline]] inline Wide& wide(float (&lanes)[kLanes]) { return *reinterpret_cast<Wide*>(lanes); }
[[gnu::always_inline]] inline const Wide& wide(const float (&lanes)[kLanes]) { return *reinterpret_cast<const Wide*>(lanes); }

struct EightLanes {
  using Term = Wide;
};
using Sum = NodeSum<EightLanes>;
BatchConjugateGradients::Lanes total(Sum& sum) {
  BatchConjugateGradients::Lanes lanes;
  std::ranges::copy(sum.total(), lanes.v);
  return lanes;
}

[[gnu::always_inline]] inline void narrow(const BatchConjugateGradients::Lanes& numbers, Wide& to) {
  for (int c = 0; c < kLanes; ++c) to[c] = static_cast<float>(numbers.v[c]);
}

}  // namespace

BatchConjugateGradients::Symmetric::Symmetric(const Mat3& m)
    : xx(static_cast<float>(m(0, 0))),
      xy(static_cast<float>(m(0, 1))),
      xz(static_cast<float>(m(0, 2))),
      yy(static_cast<float>(m(1, 1))),
      yz(static_cast<float>(m(1, 2))),
      zz(static_cast<float>(m(2, 2))) {}

void BatchConjugateGradients::prepare(const std::vector<std::uint8_t>& held, CoarseCorrection coarse) {
  coarse_ = std::move(coarse);
  const std::size_t nodes = a_.diagonal.size();
  diagonal_.resize(nodes);
  inverse_.resize(nodes);
  free_.resize(nodes);
  for (std::size_t i = 0; i < nodes; ++i) {
    diagonal_[i] = Symmetric(a_.diagonal[i]);
    inverse_[i] = Symmetric(held[i] ? Mat3(Mat3::Zero()) : Mat3(a_.diagonal[i].inverse()));
    free_[i] = held[i] ? 0.0F : 1.0F;
  }
  for (auto* rows : {&x_, &r_, &z_, &p_, &ap_}) rows->resize(nodes);
}

/// A p, and p . A p. A row is complete when its own pairs are done: those of earlier ones have been added to it by then.
BatchConjugateGradients::Lanes BatchConjugateGradients::multiply() {
  const Rows* const in = p_.data();
  Rows* const out = ap_.data();
  std::fill(ap_.begin(), ap_.end(), Rows{});
  Sum sum;
  const UpperBlocks::Pair* pair = a_.pairs.data();
  for (std::size_t i = 0; i < p_.size(); ++i) {
    const Symmetric& d = diagonal_[i];
    const Wide px = wide(in[i].x), py = wide(in[i].y), pz = wide(in[i].z);
    Wide sx = d.xx * px, sy = d.xy * px, sz = d.xz * px;
    add_product(d.xy, py, sx), add_product(d.xz, pz, sx);
    add_product(d.yy, py, sy), add_product(d.yz, pz, sy);
    add_product(d.yz, py, sz), add_product(d.zz, pz, sz);
    for (const auto* const end = a_.pairs.data() + a_.first[i + 1]; pair != end; ++pair) {
      const float(&b)[9] = pair->block;
      const Rows& q = in[pair->column];
      const Wide qx = wide(q.x), qy = wide(q.y), qz = wide(q.z);
      add_product(b[0], qx, sx), add_product(b[1], qy, sx), add_product(b[2], qz, sx);
      add_product(b[3], qx, sy), add_product(b[4], qy, sy), add_product(b[5], qz, sy);
      add_product(b[6], qx, sz), add_product(b[7], qy, sz), add_product(b[8], qz, sz);
      Rows& to = out[pair->column];
      Wide tx = wide(to.x), ty = wide(to.y), tz = wide(to.z);
      add_product(b[0], px, tx), add_product(b[3], py, tx), add_product(b[6], pz, tx);
      add_product(b[1], px, ty), add_product(b[4], py, ty), add_product(b[7], pz, ty);
      add_product(b[2], px, tz), add_product(b[5], py, tz), add_product(b[8], pz, tz);
      wide(to.x) = tx, wide(to.y) = ty, wide(to.z) = tz;
    }
    wide(out[i].x) += sx, wide(out[i].y) += sy, wide(out[i].z) += sz;
    sum.add(px * wide(out[i].x) + py * wide(out[i].y) + pz * wide(out[i].z));
  }
  return total(sum);
}

/// x += alpha p, r -= alpha A p, z = what the nodes' blocks make of r, and P^T r.
void BatchConjugateGradients::advance(const Lanes& alpha, Lanes& rr, Lanes& rz) {
  Wide by;
  narrow(alpha, by);
  Sum sum_rr, sum_rz;
  coarse_r_.assign(coarse_.inverse ? coarse_.inverse->size : 0, Row{});
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
    if (coarse_r_.empty() || coarse_.nodes[i].piece == CoarseSpace::kNone) continue;
    const float(&a)[3] = coarse_.nodes[i].arm;
    Row* const to = &coarse_r_[CoarseSpace::kMotions * coarse_.nodes[i].piece];
    wide(to[0].v) += rx, wide(to[1].v) += ry, wide(to[2].v) += rz_i;
    wide(to[3].v) += a[1] * rz_i - a[2] * ry;
    wide(to[4].v) += a[2] * rx - a[0] * rz_i;
    wide(to[5].v) += a[0] * ry - a[1] * rx;
  }
  rr = total(sum_rr);
  rz = total(sum_rz);
  if (!coarse_r_.empty()) add_coarse(rz);
}

/// w = A_c^-1 P^T r; rz += w . P^T r.
void BatchConjugateGradients::add_coarse(Lanes& rz) {
  constexpr std::size_t kMotions = CoarseSpace::kMotions;
  const std::size_t size = coarse_r_.size();
  coarse_z_.resize(size);
  Sum sum;
  for (std::size_t k = 0; k < size; k += kMotions) {
    Wide total[kMotions] = {};
    const float* const rows = coarse_.inverse->rows.data() + k * size;
    for (std::size_t l = 0; l < size; ++l) {
      const Wide r = wide(coarse_r_[l].v);
      for (std::size_t m = 0; m < kMotions; ++m) add_product(rows[m * size + l], r, total[m]);
    }
    for (std::size_t m = 0; m < kMotions; ++m) {
      wide(coarse_z_[k + m].v) = total[m];
      sum.add(total[m] * wide(coarse_r_[k + m].v));
    }
  }
  const Lanes more = total(sum);
  for (int c = 0; c < kColumns; ++c) rz.v[c] += more.v[c];
}

/// p = z + P w + beta p.
void BatchConjugateGradients::turn(const Lanes& beta) {
  Wide by;
  narrow(beta, by);
  for (std::size_t i = 0; i < p_.size(); ++i) {
    Wide x = wide(z_[i].x) + by * wide(p_[i].x), y = wide(z_[i].y) + by * wide(p_[i].y), z = wide(z_[i].z) + by * wide(p_[i].z);
    if (!coarse_r_.empty() && coarse_.nodes[i].piece != CoarseSpace::kNone) {
      const float(&a)[3] = coarse_.nodes[i].arm;
      const Row* const from = &coarse_z_[CoarseSpace::kMotions * coarse_.nodes[i].piece];
      const Wide wx = wide(from[3].v), wy = wide(from[4].v), wz = wide(from[5].v);
      x += free_[i] * (wide(from[0].v) + wy * a[2] - wz * a[1]);
      y += free_[i] * (wide(from[1].v) + wz * a[0] - wx * a[2]);
      z += free_[i] * (wide(from[2].v) + wx * a[1] - wy * a[0]);
    }
    wide(p_[i].x) = x, wide(p_[i].y) = y, wide(p_[i].z) = z;
  }
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
    const Lanes curvature = multiply();
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
      if (positive_definite && std::sqrt(rr.v[c]) > lane.column->tolerance_factor * tolerance && lane.steps <= limit) continue;
      unload(*lane.column, static_cast<int>(c), lane.scale);
      lane.column = nullptr;
      beta.v[c] = 0;
    }
    if (!positive_definite) return iterations;
    turn(beta);
  }
}

}  // namespace palpate
