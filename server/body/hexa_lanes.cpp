#include "server/body/hexa_lanes.hpp"

#include <algorithm>

#include "server/body/solid_lanes.hpp"
#include "server/body/tetra_lanes.hpp"

namespace palpate {
namespace {

/// (F, q), or a stress or rate of the same shape, side by side.
template <std::size_t N>
struct Mat37Lanes {
  Doubles<N> of[3][7];
};

/// Numbers of elements that share a shape.
template <std::size_t N>
struct SharedShape {
  const HexaShape& shape;

  PALPATE_INLINE double g(int node, int m) const { return shape.rest.g(m, node); }
  PALPATE_INLINE void volume(Doubles<N>& v) const { v = Doubles<N>{} + shape.rest.volume_m3; }
  PALPATE_INLINE double k(int mode) const { return shape.modes.k[mode]; }
};

/// Numbers of elements with their own shapes.
template <std::size_t N>
struct OwnShapes {
  const EightNumbers* numbers;
  std::size_t from;

  PALPATE_INLINE const Doubles<N>& at(std::size_t k) const { return doubles<N>(numbers[k].of + from); }
  PALPATE_INLINE const Doubles<N>& g(int node, int m) const {
    return at(hexa_gradient_at(static_cast<std::size_t>(node), static_cast<std::size_t>(m)));
  }
  PALPATE_INLINE void volume(Doubles<N>& v) const { v = at(kHexaVolumeAt); }
  PALPATE_INLINE const Doubles<N>& k(int mode) const { return at(kHexaModesAt + static_cast<std::size_t>(mode)); }
};

/// Computes sum over the nodes of y_i g_i^T; as the g_i sum to zero, values relative to the first node are enough.
template <std::size_t N, typename Shape>
PALPATE_INLINE void generalised_gradient(const HexaGroup& group, std::size_t from, const Shape& shape, const double* y,
                                         Mat37Lanes<N>& sum) {
  alignas(64) double way[7][3][N];
  for (std::size_t l = 0; l < N; ++l) {
    const double* y0 = y + 3 * std::size_t{group.nodes[0][from + l]};
    for (std::size_t i = 0; i < 7; ++i) {
      const double* yi = y + 3 * std::size_t{group.nodes[i + 1][from + l]};
      for (std::size_t r = 0; r < 3; ++r) way[i][r][l] = yi[r] - y0[r];
    }
  }
  for (int r = 0; r < 3; ++r)
    for (int m = 0; m < 7; ++m) {
      sum.of[r][m] = doubles<N>(way[0][r]) * shape.g(1, m);
      for (int i = 1; i < 7; ++i) sum.of[r][m] += doubles<N>(way[i][r]) * shape.g(i + 1, m);
    }
}

template <std::size_t N>
PALPATE_INLINE void mean_gradient(const Mat37Lanes<N>& all, Mat<N>& f) {
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) f.of[r][c] = all.of[r][c];
}

/// Adds the elastic stress of the modes.
template <std::size_t N, typename Shape>
PALPATE_INLINE void add_modes(const Shape& shape, const Mat37Lanes<N>& at, Mat37Lanes<N>& p) {
  for (int a = 0; a < kModesOfHexa; ++a)
    for (int r = 0; r < 3; ++r) p.of[r][3 + a] += shape.k(a) * at.of[r][3 + a];
}

/// Adds the viscous stress of the modes.
template <std::size_t N, typename Shape>
PALPATE_INLINE void add_braked_modes(const Shape& shape, const Mat37Lanes<N>& at, const Mat37Lanes<N>& rate, double damping_s,
                                     Mat37Lanes<N>& p) {
  for (int a = 0; a < kModesOfHexa; ++a)
    for (int m = 0; m < 3; ++m) {
      Doubles<N> s = rate.of[0][m] * at.of[0][3 + a] + at.of[0][m] * rate.of[0][3 + a];
      for (int r = 1; r < 3; ++r) s += rate.of[r][m] * at.of[r][3 + a] + at.of[r][m] * rate.of[r][3 + a];
      s *= damping_s * shape.k(a);
      for (int r = 0; r < 3; ++r) {
        p.of[r][m] += at.of[r][3 + a] * s;
        p.of[r][3 + a] += at.of[r][m] * s;
      }
    }
}

template <std::size_t N, typename Shape>
PALPATE_INLINE void scatter_hexa(const HexaGroup& group, std::size_t from, const Shape& shape, const Mat37Lanes<N>& p,
                                 double* f) {
  alignas(64) double force[7][3][N];
  for (int i = 0; i < 7; ++i)
    for (int r = 0; r < 3; ++r) {
      Doubles<N> sum = p.of[r][0] * shape.g(i + 1, 0);
      for (int m = 1; m < 7; ++m) sum += p.of[r][m] * shape.g(i + 1, m);
      doubles<N>(force[i][r]) = -sum;
    }
  const std::size_t used = std::min(N, group.count - from);
  for (std::size_t l = 0; l < used; ++l) {
    double* f0 = f + 3 * std::size_t{group.nodes[0][from + l]};
    for (std::size_t i = 0; i < 7; ++i) {
      double* fi = f + 3 * std::size_t{group.nodes[i + 1][from + l]};
      for (std::size_t r = 0; r < 3; ++r) {
        fi[r] += force[i][r][l];
        f0[r] -= force[i][r][l];
      }
    }
  }
}

template <std::size_t N, typename Shape>
PALPATE_INLINE void add_forces_of(const TetraMaterial& m, const HexaGroup& group, std::size_t from, const Shape& shape,
                                  const double* x, const double* v, double* f) {
  Mat37Lanes<N> at, rate, p{};
  Mat<N> gradient, stress{};
  Doubles<N> volume;
  shape.volume(volume);
  generalised_gradient<N>(group, from, shape, x, at);
  mean_gradient(at, gradient);
  add_elastic(m, gradient, stress);
  if (m.is_viscous()) {
    Mat<N> mean_rate;
    generalised_gradient<N>(group, from, shape, v, rate);
    mean_gradient(rate, mean_rate);
    add_viscous(m.viscous_mu, m.viscous_lambda, gradient, mean_rate, stress);
  }
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) p.of[r][c] = volume * stress.of[r][c];
  add_modes<N>(shape, at, p);
  if (m.is_viscous()) add_braked_modes<N>(shape, at, rate, group.damping_s, p);
  scatter_hexa<N>(group, from, shape, p, f);
}

template <std::size_t N>
PALPATE_INLINE void add_hexa_forces(const TetraMaterial& m, const HexaGroup& group, const double* x, const double* v, double* f) {
  for (std::size_t from = 0; from < group.count; from += N) {
    if (group.shape)
      add_forces_of<N>(m, group, from, SharedShape<N>{*group.shape}, x, v, f);
    else
      add_forces_of<N>(m, group, from, OwnShapes<N>{group.numbers.data(), from}, x, v, f);
  }
}

template <std::size_t N, typename Shape>
PALPATE_INLINE std::uint32_t blocks_of(const TetraMaterial& m, const HexaGroup& group, std::size_t from, const Shape& shape,
                                       const double* x, double c_d, double c_k, HexaBlocks& out) {
  Mat37Lanes<N> at;
  generalised_gradient<N>(group, from, shape, x, at);
  Linearised<N, 8> law;
  mean_gradient(at, law.f);
  for (int i = 0; i < 8; ++i)
    for (int c = 0; c < 3; ++c) law.b[i][c] = Doubles<N>{} + shape.g(i, c);
  Doubles<N> volume;
  shape.volume(volume);
  linearise(m, volume, c_d, c_k, law);
  Doubles<N> stiff[8][kModesOfHexa], moved[8][3], q_q[3][3];  // k_a gamma_ai, sum_a of that times q_a, sum_a k_a q_a q_a^T
  for (int i = 0; i < 8; ++i) {
    for (int a = 0; a < kModesOfHexa; ++a) stiff[i][a] = Doubles<N>{} + shape.k(a) * shape.g(i, 3 + a);
    for (int r = 0; r < 3; ++r) {
      moved[i][r] = stiff[i][0] * at.of[r][3];
      for (int a = 1; a < kModesOfHexa; ++a) moved[i][r] += stiff[i][a] * at.of[r][3 + a];
    }
  }
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) {
      q_q[r][c] = shape.k(0) * (at.of[r][3] * at.of[c][3]);
      for (int a = 1; a < kModesOfHexa; ++a) q_q[r][c] += shape.k(a) * (at.of[r][3 + a] * at.of[c][3 + a]);
    }
  const double viscous = c_d * group.damping_s;
  for (int j = 0; j < 8; ++j)
    for (int i = j; i < 8; ++i) {
      Mat<N> k;
      tangent_block(law, m.law, i, j, k);
      Doubles<N> straight = stiff[i][0] * shape.g(j, 3);
      for (int a = 1; a < kModesOfHexa; ++a) straight += stiff[i][a] * shape.g(j, 3 + a);
      const Doubles<N> dot = law.b[i][0] * law.b[j][0] + law.b[i][1] * law.b[j][1] + law.b[i][2] * law.b[j][2];
      auto& numbers = out.at[pair_index(static_cast<std::size_t>(i), static_cast<std::size_t>(j))];
      for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) {
          Doubles<N> sum = k.of[r][c] + viscous * (dot * q_q[r][c] + moved[j][r] * law.fb[i][c] + law.fb[j][r] * moved[i][c] +
                                                   straight * law.square.of[r][c]);
          if (r == c) sum += c_k * straight;
          doubles<N>(numbers[static_cast<std::size_t>(3 * r + c)].of + from) = sum;
        }
    }
  std::uint32_t good = 0;
  for (std::size_t l = 0; l < N; ++l)
    if (law.good[l]) good |= 1U << (from + l);
  return good;
}

template <std::size_t N>
PALPATE_INLINE std::uint32_t hexa_blocks(const TetraMaterial& m, const HexaGroup& group, const double* x, double c_d, double c_k,
                                         HexaBlocks& out) {
  std::uint32_t good = 0;
  for (std::size_t from = 0; from < group.count; from += N)
    good |= group.shape ? blocks_of<N>(m, group, from, SharedShape<N>{*group.shape}, x, c_d, c_k, out)
                        : blocks_of<N>(m, group, from, OwnShapes<N>{group.numbers.data(), from}, x, c_d, c_k, out);
  return good;
}

#define PALPATE_HEXA_LOOPS(N, TARGET)                                                                                    \
  TARGET void hexa_forces_##N(const TetraMaterial& m, const HexaGroup& g, const double* x, const double* v, double* f) { \
    add_hexa_forces<N>(m, g, x, v, f);                                                                                   \
  }                                                                                                                      \
  TARGET std::uint32_t hexa_blocks_##N(const TetraMaterial& m, const HexaGroup& g, const double* x, double d, double k,  \
                                       HexaBlocks& b) {                                                                  \
    return hexa_blocks<N>(m, g, x, d, k, b);                                                                             \
  }

PALPATE_HEXA_LOOPS(2, )
#if defined(__x86_64__)
PALPATE_HEXA_LOOPS(4, __attribute__((target("avx2"))))
PALPATE_HEXA_LOOPS(8, __attribute__((target("avx512f"))))
#endif

std::vector<HexaLoops> hexa_loops_here() {
  std::vector<HexaLoops> loops{{2, &hexa_forces_2, &hexa_blocks_2}};
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx2")) loops.push_back({4, &hexa_forces_4, &hexa_blocks_4});
  if (__builtin_cpu_supports("avx512f")) loops.push_back({8, &hexa_forces_8, &hexa_blocks_8});
#endif
  return loops;
}

}  // namespace

HexaShape::HexaShape(const SolidMaterial& of, std::uint32_t material_index, const HexaRest& at)
    : rest(at), modes(of, at), material(material_index) {}

std::vector<EightNumbers> numbers_of(std::span<const HexaShape* const> shapes) {
  std::vector<EightNumbers> numbers(kNumbersOfHexa, EightNumbers{});
  for (std::size_t l = 0; l < shapes.size(); ++l) {
    const HexaShape& shape = *shapes[l];
    numbers[kHexaVolumeAt].of[l] = shape.rest.volume_m3;
    for (std::size_t a = 0; a < kModesOfHexa; ++a) numbers[kHexaModesAt + a].of[l] = shape.modes.k[a];
    for (std::size_t i = 0; i < 8; ++i)
      for (std::size_t m = 0; m < 7; ++m)
        numbers[hexa_gradient_at(i, m)].of[l] = shape.rest.g(static_cast<Eigen::Index>(m), static_cast<Eigen::Index>(i));
  }
  return numbers;
}

std::span<const HexaLoops> hexa_loops() {
  static const std::vector<HexaLoops> loops = hexa_loops_here();
  return loops;
}

}  // namespace palpate
