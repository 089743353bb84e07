#include "server/body/batch_cg.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

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

void BatchConjugateGradients::prepare(const Tangents& tangents, double c_m, double c_d, double c_k,
                                      const std::vector<std::uint8_t>& held, bool clamp) {
  const Dynamics& dynamics = tangents.dynamics();
  const std::uint32_t nodes = dynamics.nodes();
  const bool planar = dynamics.body().planar;
  spatial_ = planar ? 0.0F : 1.0F;
  first_.resize(nodes + 1);
  for (std::uint32_t i = 0; i <= nodes; ++i) first_[i] = tangents.first(i);
  elements_.resize(tangents.elements().size());
  std::vector<Mat3> diagonal(nodes, Mat3::Zero());
  for (std::size_t k = 0; k < elements_.size(); ++k) {
    const ElementTangent& e = tangents.elements()[k];
    const double t = c_k * across(e, clamp), axial = c_k * e.slope_n_m - t + c_d * e.damping_n_s_m;
    const Eigen::Vector3f n = e.direction.cast<float>();
    elements_[k] = {{n[0], n[1], n[2]}, static_cast<float>(axial), static_cast<float>(t), e.b};
    Mat3 block = axial * e.direction * e.direction.transpose();
    block.diagonal() += Vec3(t, t, planar ? 0 : t);
    diagonal[e.a] += block;
    diagonal[e.b] += block;
  }
  mass_.resize(nodes);
  free_.resize(nodes);
  inverse_.resize(nodes);
  for (std::uint32_t i = 0; i < nodes; ++i) {
    const double mass = c_m * dynamics.masses()[3 * static_cast<Eigen::Index>(i)];
    mass_[i] = static_cast<float>(mass);
    free_[i] = held[i] ? 0.0F : 1.0F;
    diagonal[i].diagonal().array() += mass;
    if (planar && !(diagonal[i](2, 2) > 0)) diagonal[i](2, 2) = 1;
    const Eigen::Matrix3f inverse = held[i] ? Eigen::Matrix3f::Zero().eval() : Mat3(diagonal[i].inverse()).cast<float>().eval();
    inverse_[i] = {inverse(0, 0), inverse(0, 1), inverse(0, 2), inverse(1, 1), inverse(1, 2), inverse(2, 2)};
  }
  for (auto* rows : {&x_, &r_, &z_, &p_, &ap_}) rows->resize(nodes);
}

void BatchConjugateGradients::multiply(const std::vector<Rows>& p, std::vector<Rows>& y) const {
  for (std::size_t i = 0; i < p.size(); ++i) {
    wide(y[i].x) = mass_[i] * wide(p[i].x);
    wide(y[i].y) = mass_[i] * wide(p[i].y);
    wide(y[i].z) = mass_[i] * wide(p[i].z);
  }
  for (std::size_t i = 0; i < p.size(); ++i) {
    const Wide px = wide(p[i].x), py = wide(p[i].y), pz = wide(p[i].z);
    Wide sx{}, sy{}, sz{};
    for (std::uint32_t at = first_[i]; at < first_[i + 1]; ++at) {
      const Element& e = elements_[at];
      const Rows& other = p[e.b];
      const Wide ux = px - wide(other.x), uy = py - wide(other.y), uz = spatial_ * (pz - wide(other.z));
      const Wide pull = e.axial * (e.n[0] * ux + e.n[1] * uy + e.n[2] * uz);
      const Wide fx = e.n[0] * pull + e.across * ux, fy = e.n[1] * pull + e.across * uy, fz = e.n[2] * pull + e.across * uz;
      sx += fx, sy += fy, sz += fz;
      wide(y[e.b].x) -= fx, wide(y[e.b].y) -= fy, wide(y[e.b].z) -= fz;
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
    const Block& b = inverse_[i];
    const Wide zx = b.xx * rx + b.xy * ry + b.xz * rz_i, zy = b.xy * rx + b.yy * ry + b.yz * rz_i,
               zz = b.xz * rx + b.yz * ry + b.zz * rz_i;
    wide(z_[i].x) = zx, wide(z_[i].y) = zy, wide(z_[i].z) = zz;
    sum_rr.add(rx * rx + ry * ry + rz_i * rz_i);
    sum_rz.add(rx * zx + ry * zy + rz_i * zz);
  }
  sum_rr.take(rr.v);
  sum_rz.take(rz.v);
}

/// Puts a column into a lane, scaled so that b has unit length: nothing small is lost below the smallest float. The first guess
/// becomes the first direction, whose step is 1. False where b is zero, and then x is.
bool BatchConjugateGradients::load(const SolveColumn& column, int lane, double& scale) {
  double square = 0;
  for (std::size_t i = 0; i < r_.size(); ++i)
    if (free_[i] > 0) square += column.b->segment<3>(3 * static_cast<Eigen::Index>(i)).squaredNorm();
  scale = std::sqrt(square);
  if (!(scale > 0)) {
    column.x->setZero(column.b->size());
    return false;
  }
  const bool guessed = column.x->size() == column.b->size();
  for (std::size_t i = 0; i < r_.size(); ++i) {
    const double by = free_[i] > 0 ? 1 / scale : 0;
    const double* b = column.b->data() + 3 * i;
    const double* x = guessed ? column.x->data() + 3 * i : nullptr;
    r_[i].x[lane] = static_cast<float>(by * b[0]);
    r_[i].y[lane] = static_cast<float>(by * b[1]);
    r_[i].z[lane] = static_cast<float>(by * b[2]);
    p_[i].x[lane] = x ? static_cast<float>(by * x[0]) : 0;
    p_[i].y[lane] = x ? static_cast<float>(by * x[1]) : 0;
    p_[i].z[lane] = x ? static_cast<float>(by * x[2]) : 0;
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
        if (load(columns[next], c, lane.scale)) {
          lane.column = &columns[next];
          lane.steps = 0;
        }
    if (std::none_of(lanes.begin(), lanes.end(), [](const Lane& lane) { return lane.column; })) return iterations;
    multiply(p_, ap_);
    const Lanes curvature = dot(p_, ap_);
    for (std::size_t c = 0; c < lanes.size(); ++c) {
      const bool first = lanes[c].steps == 0;
      if (lanes[c].column && !first) positive_definite &= curvature.v[c] > 0;
      alpha.v[c] = !lanes[c].column ? 0 : (first ? 1 : rz.v[c] / curvature.v[c]);
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
      if (positive_definite && std::sqrt(rr.v[c]) > tolerance && lane.steps <= limit) continue;
      unload(*lane.column, static_cast<int>(c), lane.scale);
      lane.column = nullptr;
      beta.v[c] = 0;
    }
    if (!positive_definite) return iterations;
    turn(beta);
  }
}

}  // namespace palpate
