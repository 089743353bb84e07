#include "server/body/tetra_lanes.hpp"

#include <vector>

#include "server/body/solid_lanes.hpp"

namespace palpate {
namespace {

/// The elements of a group from one lane on, as many as fit into a vector.
template <std::size_t N>
struct Part {
  const TetraGroup& group;
  std::size_t from;

  PALPATE_INLINE const Doubles<N>& b(int i, int c) const {
    return doubles<N>(group.b[static_cast<std::size_t>(i)][static_cast<std::size_t>(c)].of + from);
  }
  PALPATE_INLINE const Doubles<N>& volume() const { return doubles<N>(group.volume_m3.of + from); }
  PALPATE_INLINE std::size_t used() const { return group.count > from ? std::min(N, group.count - from) : 0; }

  /// Computes sum over the nodes of y_i b_i^T.
  PALPATE_INLINE void gradient(const double* y, Mat<N>& f) const {
    alignas(64) double edge[3][3][N];
    for (std::size_t l = 0; l < N; ++l) {
      const double* y0 = y + 3 * std::size_t{group.nodes[0][from + l]};
      for (std::size_t i = 0; i < 3; ++i) {
        const double* yi = y + 3 * std::size_t{group.nodes[i + 1][from + l]};
        for (std::size_t r = 0; r < 3; ++r) edge[i][r][l] = yi[r] - y0[r];
      }
    }
    for (int r = 0; r < 3; ++r) {
      const Doubles<N>&e1 = doubles<N>(edge[0][r]), &e2 = doubles<N>(edge[1][r]), &e3 = doubles<N>(edge[2][r]);
      for (int c = 0; c < 3; ++c) f.of[r][c] = e1 * b(0, c) + e2 * b(1, c) + e3 * b(2, c);
    }
  }
};

template <std::size_t N>
PALPATE_INLINE void scatter(const Part<N>& part, const Mat<N>& stress, double* f) {
  alignas(64) double force[3][3][N];
  for (int i = 0; i < 3; ++i)
    for (int r = 0; r < 3; ++r) {
      const Doubles<N> sum = stress.of[r][0] * part.b(i, 0) + stress.of[r][1] * part.b(i, 1) + stress.of[r][2] * part.b(i, 2);
      doubles<N>(force[i][r]) = -part.volume() * sum;
    }
  for (std::size_t l = 0; l < part.used(); ++l) {
    double* f0 = f + 3 * std::size_t{part.group.nodes[0][part.from + l]};
    for (std::size_t i = 0; i < 3; ++i) {
      double* fi = f + 3 * std::size_t{part.group.nodes[i + 1][part.from + l]};
      for (std::size_t r = 0; r < 3; ++r) {
        fi[r] += force[i][r][l];
        f0[r] -= force[i][r][l];
      }
    }
  }
}

template <std::size_t N>
PALPATE_INLINE void add_forces(const TetraMaterial& m, const TetraGroup& group, const double* x, const double* v, double* f) {
  for (std::size_t from = 0; from < group.count; from += N) {
    const Part<N> part{group, from};
    Mat<N> gradient, stress{};
    part.gradient(x, gradient);
    add_elastic(m, gradient, stress);
    if (m.is_viscous()) {
      Mat<N> rate;
      part.gradient(v, rate);
      add_viscous(m.viscous_mu, m.viscous_lambda, gradient, rate, stress);
    }
    scatter(part, stress, f);
  }
}

template <std::size_t N>
PALPATE_INLINE std::uint32_t blocks(const TetraMaterial& m, const TetraGroup& group, const double* x, double c_d, double c_k,
                                    TetraBlocks& out) {
  std::uint32_t good = 0;
  for (std::size_t from = 0; from < group.count; from += N) {
    Linearised<N, 4> at;
    const Part<N> part{group, from};
    part.gradient(x, at.f);
    for (int c = 0; c < 3; ++c) {
      for (int k = 0; k < 3; ++k) at.b[k + 1][c] = part.b(k, c);
      at.b[0][c] = -(at.b[1][c] + at.b[2][c] + at.b[3][c]);
    }
    linearise(m, part.volume(), c_d, c_k, at);
    for (std::size_t l = 0; l < N; ++l)
      if (at.good[l]) good |= 1U << (from + l);
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j <= i; ++j) {
        Mat<N> k;
        tangent_block(at, m.law, i, j, k);
        auto& numbers = out.at[pair_index(static_cast<std::size_t>(i), static_cast<std::size_t>(j))];
        for (std::size_t n = 0; n < 9; ++n) doubles<N>(numbers[n].of + from) = k.of[n / 3][n % 3];
      }
  }
  return good;
}

#define PALPATE_TETRA_LOOPS(N, TARGET)                                                                               \
  TARGET void forces_##N(const TetraMaterial& m, const TetraGroup& g, const double* x, const double* v, double* f) { \
    add_forces<N>(m, g, x, v, f);                                                                                    \
  }                                                                                                                  \
  TARGET std::uint32_t blocks_##N(const TetraMaterial& m, const TetraGroup& g, const double* x, double d, double k,  \
                                  TetraBlocks& b) {                                                                  \
    return blocks<N>(m, g, x, d, k, b);                                                                              \
  }

PALPATE_TETRA_LOOPS(2, )
#if defined(__x86_64__)
PALPATE_TETRA_LOOPS(4, __attribute__((target("avx2"))))
PALPATE_TETRA_LOOPS(8, __attribute__((target("avx512f"))))
#endif

std::vector<TetraLoops> found() {
  std::vector<TetraLoops> loops{{2, &forces_2, &blocks_2}};
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx2")) loops.push_back({4, &forces_4, &blocks_4});
  if (__builtin_cpu_supports("avx512f")) loops.push_back({8, &forces_8, &blocks_8});
#endif
  return loops;
}

}  // namespace

std::span<const TetraLoops> tetra_loops() {
  static const std::vector<TetraLoops> loops = found();
  return loops;
}

}  // namespace palpate
