#include "server/body/spring_runs.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

// The widest vectors that the processor has, found when the program starts.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define PALPATE_WIDEST __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define PALPATE_WIDEST
#endif

namespace palpate {
namespace {

constexpr std::size_t kPiece = 256;  // springs whose forces wait in the first-level cache
constexpr std::size_t kGapMost = 16;

/// What the springs of a run have in common, to a nanometre.
using Alike = std::array<std::int64_t, 5>;

struct Placed {
  Alike alike;
  std::size_t a = 0;
  const Element* element = nullptr;
  Vec3 d = Vec3::Zero();
};

Placed place(const LumpedBody& body, const Element& e) {
  constexpr double kNanometres = 1e9;
  const std::uint32_t a = std::min(e.a, e.b), b = std::max(e.a, e.b);
  Placed p;
  p.a = a;
  p.element = &e;
  p.d = body.nodes[b] - body.nodes[a];
  p.alike = {b - a, std::llround(kNanometres * p.d.x()), std::llround(kNanometres * p.d.y()), std::llround(kNanometres * p.d.z()),
             std::llround(kNanometres * e.rest_length_m)};
  return p;
}

struct Arrays {
  const float *x, *y, *z;
};
struct Forces {
  float *x, *y, *z;
};

void add(const float* __restrict t, std::size_t n, float* __restrict f) {
  for (std::size_t i = 0; i < n; ++i) f[i] += t[i];
}
void subtract(const float* __restrict t, std::size_t n, float* __restrict f) {
  for (std::size_t i = 0; i < n; ++i) f[i] -= t[i];
}

/// `growth`: stiffening / L0^2.
PALPATE_WIDEST void add_run(const SpringRuns::Run& r, const float* __restrict k, const float* __restrict c, float growth,
                            Arrays u, Arrays v, Forces f) {
  alignas(64) float tx[kPiece], ty[kPiece], tz[kPiece];
  for (std::size_t s = 0; s < r.count; s += kPiece) {
    const std::size_t n = std::min(kPiece, r.count - s), a = r.a + s, b = r.b + s;
    const float* __restrict xa = u.x + a, * __restrict ya = u.y + a, * __restrict za = u.z + a;
    const float* __restrict xb = u.x + b, * __restrict yb = u.y + b, * __restrict zb = u.z + b;
    const float* __restrict pa = v.x + a, * __restrict qa = v.y + a, * __restrict ra = v.z + a;
    const float* __restrict pb = v.x + b, * __restrict qb = v.y + b, * __restrict rb = v.z + b;
    const float* __restrict ks = k + s, * __restrict cs = c + s;
    const float at_x = r.d[0], at_y = r.d[1], at_z = r.d[2], rest = r.rest, excess = r.excess;
    for (std::size_t i = 0; i < n; ++i) {
      const float ex = xb[i] - xa[i], ey = yb[i] - ya[i], ez = zb[i] - za[i];
      const float dx = at_x + ex, dy = at_y + ey, dz = at_z + ez;
      const float length = std::sqrt(dx * dx + dy * dy + dz * dz);
      const float elongation = (ex * (dx + at_x) + ey * (dy + at_y) + ez * (dz + at_z) + excess) / (length + rest);
      const float inverse = length > 1e-12F ? 1 / length : 0;
      const float rate = (dx * (pb[i] - pa[i]) + dy * (qb[i] - qa[i]) + dz * (rb[i] - ra[i])) * inverse;
      const float axial = ks[i] * elongation * (1 + growth * elongation * elongation) + cs[i] * rate;
      const float per_length = axial * inverse;
      tx[i] = per_length * dx;
      ty[i] = per_length * dy;
      tz[i] = per_length * dz;
    }
    add(tx, n, f.x + a);
    add(ty, n, f.y + a);
    add(tz, n, f.z + a);
    subtract(tx, n, f.x + b);
    subtract(ty, n, f.y + b);
    subtract(tz, n, f.z + b);
  }
}

}  // namespace

bool SpringRuns::covers(const LumpedBody& body) {
  return !body.elements.empty() && body.tetrahedra.empty() && body.law != SpringLaw::thigh_skin;
}

SpringRuns::SpringRuns(const LumpedBody& body)
    : stiffening_(body.law == SpringLaw::stiffening ? static_cast<float>(body.stiffening) : 0.0F) {
  std::vector<Placed> springs;
  for (const Element& e : body.elements) springs.push_back(place(body, e));
  std::stable_sort(springs.begin(), springs.end(),
                   [](const Placed& p, const Placed& q) { return std::tie(p.alike, p.a) < std::tie(q.alike, q.a); });
  const Placed* before = nullptr;
  for (const Placed& p : springs) {
    const bool goes_on = before && before->alike == p.alike && p.a > before->a && p.a - before->a <= kGapMost;
    if (!goes_on) {
      Run run;
      run.a = p.a;
      run.b = p.a + static_cast<std::size_t>(p.alike[0]);
      run.first = stiffness_.size();
      for (int k = 0; k < 3; ++k) run.d[k] = static_cast<float>(p.d[k]);
      run.rest = static_cast<float>(p.element->rest_length_m);
      run.excess = static_cast<float>(p.d.squaredNorm() - p.element->rest_length_m * p.element->rest_length_m);
      runs_.push_back(run);
    }
    Run& run = runs_.back();
    run.count = p.a - run.a + 1;
    stiffness_.resize(run.first + run.count, 0.0F);
    damping_.resize(run.first + run.count, 0.0F);
    stiffness_.back() = static_cast<float>(p.element->stiffness_n_m);
    damping_.back() = static_cast<float>(p.element->damping_n_s_m);
    before = &p;
  }
}

void SpringRuns::add_forces(const NodeArrays& u, const NodeArrays& v, NodeArrays& f) const {
  const Arrays at{u.x.data(), u.y.data(), u.z.data()}, rate{v.x.data(), v.y.data(), v.z.data()};
  for (const Run& r : runs_)
    add_run(r, stiffness_.data() + r.first, damping_.data() + r.first, stiffening_ / (r.rest * r.rest), at, rate,
            {f.x.data(), f.y.data(), f.z.data()});
}

double SpringRuns::stiffest(const NodeArrays& u) const {
  if (stiffening_ == 0) return 1;
  double most = 0;  // of (e / L0)^2
  for (const Run& r : runs_)
    for (std::size_t i = 0; i < r.count; ++i) {
      if (stiffness_[r.first + i] == 0) continue;
      const auto a = static_cast<std::uint32_t>(r.a + i), b = static_cast<std::uint32_t>(r.b + i);
      const Vec3 d = Vec3(r.d[0], r.d[1], r.d[2]) + u.at(b) - u.at(a);
      const double strain = d.norm() / static_cast<double>(r.rest) - 1;
      most = std::max(most, strain * strain);
    }
  return 1 + 3 * static_cast<double>(stiffening_) * most;
}

}  // namespace palpate
