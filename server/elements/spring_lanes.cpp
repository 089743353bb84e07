#include "server/elements/spring_lanes.hpp"

#include <algorithm>

namespace palpate {
namespace {

template <std::size_t N>
using Vec = Doubles<N>[3];

/// Computes y_b - y_a.
template <std::size_t N>
PALPATE_INLINE void differences(const SpringGroup& group, std::size_t from, const double* y, Vec<N>& d) {
  alignas(64) double apart[3][N];
  for (std::size_t l = 0; l < N; ++l) {
    const double* const a = y + 3 * std::size_t{group.a[from + l]};
    const double* const b = y + 3 * std::size_t{group.b[from + l]};
    for (std::size_t r = 0; r < 3; ++r) apart[r][l] = b[r] - a[r];
  }
  for (std::size_t r = 0; r < 3; ++r) d[r] = doubles<N>(apart[r]);
}

template <std::size_t N>
PALPATE_INLINE void inner(const Vec<N>& a, const Vec<N>& b, Doubles<N>& sum) {
  sum = a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/// Combines SpringKernel::evaluate and force_on_a.
template <std::size_t N>
PALPATE_INLINE void forces(const SpringGroup& group, std::size_t from, double stiffening, const double* x, const double* v,
                           Vec<N>& force) {
  constexpr double kMinLength = 1e-12;
  Vec<N> d, w;
  differences<N>(group, from, x, d);
  differences<N>(group, from, v, w);
  Doubles<N> square, length, rate;
  inner<N>(d, d, square);
  roots<N>(square, length);
  const Doubles<N> none{};
  const Doubles<N> inverse = length > kMinLength ? 1.0 / length : none;
  const Doubles<N>& rest = doubles<N>(group.rest_length_m.of + from);
  const Doubles<N> elongation = length - rest, strain = elongation / rest, growth = stiffening * strain * strain;
  for (int r = 0; r < 3; ++r) d[r] = d[r] * inverse;
  inner<N>(d, w, rate);
  const Doubles<N> axial =
      doubles<N>(group.stiffness_n_m.of + from) * elongation * (1.0 + growth) + doubles<N>(group.damping_n_s_m.of + from) * rate;
  for (int r = 0; r < 3; ++r) force[r] = axial * d[r];
}

/// In most bodies the springs of one node follow each other: their forces on it are summed before they are stored.
template <std::size_t N>
PALPATE_INLINE void scatter(const SpringGroup& group, std::size_t from, const double (&force)[3][N], double* f) {
  const std::size_t used = std::min(N, group.count - from);
  for (std::size_t l = 0; l < used;) {
    const std::uint32_t node = group.a[from + l];
    double* const a = f + 3 * std::size_t{node};
    double sum[3] = {a[0], a[1], a[2]};
    for (; l < used && group.a[from + l] == node; ++l) {
      double* const b = f + 3 * std::size_t{group.b[from + l]};
      for (std::size_t r = 0; r < 3; ++r) {
        sum[r] += force[r][l];
        b[r] -= force[r][l];
      }
    }
    std::copy(std::begin(sum), std::end(sum), a);
  }
}

struct SpringForceLoop {
  template <std::size_t N>
  PALPATE_INLINE static void run(std::span<const SpringGroup> groups, double stiffening, const double* x, const double* v,
                                 double* f) {
    for (const SpringGroup& group : groups)
      for (std::size_t from = 0; from < group.count; from += N) {
        Vec<N> force;
        forces<N>(group, from, stiffening, x, v, force);
        alignas(64) double numbers[3][N];
        for (int r = 0; r < 3; ++r) doubles<N>(numbers[r]) = force[r];
        scatter<N>(group, from, numbers, f);
      }
  }
};

}  // namespace

std::vector<SpringGroup> spring_groups(const LumpedBody& body) {
  std::vector<SpringGroup> groups;
  if (body.law == SpringLaw::thigh_skin) return groups;
  for (const Element& e : body.elements) {
    if (groups.empty() || groups.back().count == SpringGroup::kSize) {
      groups.emplace_back();
      std::fill(std::begin(groups.back().rest_length_m.of), std::end(groups.back().rest_length_m.of), 1.0);
    }
    SpringGroup& group = groups.back();
    const std::size_t lane = group.count++;
    group.stiffness_n_m.of[lane] = e.stiffness_n_m;
    group.damping_n_s_m.of[lane] = e.damping_n_s_m;
    group.rest_length_m.of[lane] = e.rest_length_m;
    group.a[lane] = e.a;
    group.b[lane] = e.b;
  }
  return groups;
}

std::span<const Variant<std::span<const SpringGroup>, double, const double*, const double*, double*>> spring_loops() {
  return Variants<SpringForceLoop>::all<std::span<const SpringGroup>, double, const double*, const double*, double*>();
}

}  // namespace palpate
