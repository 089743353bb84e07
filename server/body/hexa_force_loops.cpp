#include "server/body/fused.hpp"
#include "server/body/hexa_forces.hpp"
#include "server/body/hexa_lanes.hpp"
#include "server/body/solid_lanes.hpp"

namespace palpate {
namespace {

using Eight = EightFloats;
using EightTruths = std::int32_t __attribute__((vector_size(32)));
constexpr std::size_t kEight = HexaCells::kLanes;
constexpr int kColumns = 7;

/// (F - 1, q) of eight cells, or a stress or rate of the same shape.
struct EightMat37 {
  Eight of[3][kColumns];
};

struct EightMat {
  using Lanes = Eight;
  Lanes of[3][3];
};

PALPATE_INLINE const Eight& eight(const HexaCells::Lanes& lanes) { return *reinterpret_cast<const Eight*>(lanes.of); }

/// Loads one component at the corners.
PALPATE_INLINE void take_corners(const HexaCells& cells, const float* y, Eight (&at)[8]) {
  for (std::size_t i = 0; i < 8; ++i) {
    if (cells.in_a_row) {
      __builtin_memcpy(&at[i], y + cells.nodes[i][0], sizeof(at[i]));
    } else {
      alignas(32) float lanes[kEight];
      for (std::size_t l = 0; l < kEight; ++l) lanes[l] = y[cells.nodes[i][l]];
      __builtin_memcpy(&at[i], lanes, sizeof(at[i]));
    }
  }
}

/// Adds to one component at the corners. In a row the nodes of corner i + 1 are those of i shifted by one: both are summed first,
/// so that no value is read right after it was written.
PALPATE_INLINE void add_to_corners(const HexaCells& cells, const Eight (&more)[8], float* y) {
  if (cells.in_a_row) {
    for (std::size_t i = 0; i < 8; i += 2) {
      float* const at = y + cells.nodes[i][0];
      Eight sum;
      __builtin_memcpy(&sum, at, sizeof(sum));
      sum += more[i] + __builtin_shufflevector(more[i + 1], Eight{}, 8, 0, 1, 2, 3, 4, 5, 6);
      __builtin_memcpy(at, &sum, sizeof(sum));
      at[kEight] += more[i + 1][kEight - 1];
    }
    return;
  }
  for (std::size_t i = 0; i < 8; ++i) {
    alignas(32) float lanes[kEight];
    __builtin_memcpy(lanes, &more[i], sizeof(lanes));
    for (std::size_t l = 0; l < cells.used; ++l) y[cells.nodes[i][l]] += lanes[l];
  }
}

/// Replaces at[s] by the sum over i of at[i] times (-1)^(number of bits that s has and i lacks).
PALPATE_INLINE void transform(Eight (&at)[8]) {
  for (std::size_t bit = 1; bit < 8; bit *= 2)
    for (std::size_t i = 0; i < 8; ++i) {
      if (i & bit) continue;
      const Eight low = at[i], high = at[i | bit];
      at[i] = high + low;
      at[i | bit] = high - low;
    }
}
/// Transposed transform: replaces at[i] by the sum over s of at[s] times the same signs.
PALPATE_INLINE void transform_back(Eight (&at)[8]) {
  for (std::size_t bit = 1; bit < 8; bit *= 2)
    for (std::size_t i = 0; i < 8; ++i) {
      if (i & bit) continue;
      const Eight sum = at[i], difference = at[i | bit];
      at[i] = sum - difference;
      at[i | bit] = sum + difference;
    }
}

struct Box {
  const HexaCells& cells;

  PALPATE_INLINE void gradient(Eight (&at)[8], Eight (&sum)[kColumns]) const {
    transform(at);
    for (int m = 0; m < kColumns; ++m) sum[m] = cells.times[m] * at[HexaCells::kBoxBits[m]];
  }
  PALPATE_INLINE void forces(const Eight (&p)[kColumns], Eight (&at)[8]) const {
    at[0] = Eight{};
    for (int m = 0; m < kColumns; ++m) at[HexaCells::kBoxBits[m]] = -(cells.times[m] * p[m]);
    transform_back(at);
  }
  PALPATE_INLINE void volume(Eight& v) const { v = Eight{} + cells.volume_m3; }
  PALPATE_INLINE void k(int mode, Eight& of) const { of = Eight{} + cells.k[mode]; }
};

struct Own {
  const HexaCells& cells;

  PALPATE_INLINE const Eight& g(std::size_t node, int m) const {
    return eight(cells.own[hexa_gradient_at(node, static_cast<std::size_t>(m))]);
  }
  /// Since the g_i sum to zero, values relative to the first corner are enough.
  PALPATE_INLINE void gradient(Eight (&at)[8], Eight (&sum)[kColumns]) const {
    for (std::size_t i = 1; i < 8; ++i) at[i] -= at[0];
    for (int m = 0; m < kColumns; ++m) {
      sum[m] = at[1] * g(1, m);
      for (std::size_t i = 2; i < 8; ++i) sum[m] += at[i] * g(i, m);
    }
  }
  PALPATE_INLINE void forces(const Eight (&p)[kColumns], Eight (&at)[8]) const {
    at[0] = Eight{};
    for (std::size_t i = 1; i < 8; ++i) {
      at[i] = -(p[0] * g(i, 0));
      for (int m = 1; m < kColumns; ++m) at[i] -= p[m] * g(i, m);
      at[0] -= at[i];
    }
  }
  PALPATE_INLINE void volume(Eight& v) const { v = eight(cells.own[kHexaVolumeAt]); }
  PALPATE_INLINE void k(int mode, Eight& of) const { of = eight(cells.own[kHexaModesAt + static_cast<std::size_t>(mode)]); }
};

template <typename Shape>
PALPATE_INLINE void gradients(const Shape& shape, const NodeArrays& y, EightMat37& sum) {
  const float* const axes[3] = {y.x.data(), y.y.data(), y.z.data()};
  for (int r = 0; r < 3; ++r) {
    Eight at[8];
    take_corners(shape.cells, axes[r], at);
    shape.gradient(at, sum.of[r]);
  }
}

/// Converts lanes `lane` to lane + N - 1 to double precision.
template <std::size_t N>
PALPATE_INLINE void widen(const Eight& from, std::size_t lane, Doubles<N>& to) {
  alignas(32) float lanes[kEight];
  __builtin_memcpy(lanes, &from, sizeof(lanes));
  alignas(64) double wide[N];
  for (std::size_t l = 0; l < N; ++l) wide[l] = static_cast<double>(lanes[lane + l]);
  to = doubles<N>(wide);
}

/// Computes the elastic P, N lanes at a time.
template <std::size_t N>
PALPATE_INLINE void find_elastic(const TetraMaterial& m, const EightMat37& at, EightMat& p) {
  alignas(32) float stress[9][kEight];
  for (std::size_t lane = 0; lane < kEight; lane += N) {
    Mat<N> f, sum{};
    for (int k = 0; k < 9; ++k) widen<N>(at.of[k / 3][k % 3], lane, f.of[k / 3][k % 3]);
    for (int r = 0; r < 3; ++r) f.of[r][r] += 1.0;
    add_elastic(m, f, sum);
    for (int k = 0; k < 9; ++k)
      for (std::size_t l = 0; l < N; ++l) stress[k][lane + l] = static_cast<float>(sum.of[k / 3][k % 3][l]);
  }
  for (int k = 0; k < 9; ++k) __builtin_memcpy(&p.of[k / 3][k % 3], stress[k], sizeof(Eight));
}

/// Computes the elastic P of the neo-Hookean law without fibres, in single precision, from H = F - 1 without cancellation.
///     J - 1 = tr H + tr cof H + det H,   I - 3 = x = 2 tr H + |H|^2,   G = (1 + tr H) 1 - H^T + cof H
///     P = (3/4 mu + d) H + (3/4 mu - l) (H^T - cof H) + (d + l - (3/4 mu - l) tr H) 1,
///     d = mu x / (4 (4 + x)), l = lambda (J - 1)
PALPATE_INLINE void find_neo_hookean(const TetraMaterial& m, const EightMat37& at, EightMat& p) {
  const auto mu = static_cast<float>(m.mu), lambda = static_cast<float>(m.lambda);
  const auto& h = at.of;
  Eight cof[3][3], x{};
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) {
      const int r1 = (r + 1) % 3, r2 = (r + 2) % 3, c1 = (c + 1) % 3, c2 = (c + 2) % 3;
      cof[r][c] = h[r1][c1] * h[r2][c2] - h[r1][c2] * h[r2][c1];
      x += h[r][c] * h[r][c];
    }
  const Eight trace = h[0][0] + h[1][1] + h[2][2];
  const Eight det = h[0][0] * cof[0][0] + h[0][1] * cof[0][1] + h[0][2] * cof[0][2];
  x += 2.0F * trace;
  const Eight of_volume = lambda * (trace + (cof[0][0] + cof[1][1] + cof[2][2] + det));
  const Eight d = mu * x / (4.0F * (4.0F + x)), by_h = 0.75F * mu + d, by_rest = 0.75F * mu - of_volume;
  const Eight diagonal = d + of_volume - by_rest * trace;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) p.of[r][c] = by_h * h[r][c] + by_rest * (h[c][r] - cof[r][c]);
  for (int r = 0; r < 3; ++r) p.of[r][r] += diagonal;
}

/// Adds the elastic stress of the modes.
template <typename Shape>
PALPATE_INLINE void add_modes(const Shape& shape, const EightMat37& at, EightMat37& p) {
  for (int a = 0; a < kModesOfHexa; ++a) {
    Eight k;
    shape.k(a, k);
    for (int r = 0; r < 3; ++r) p.of[r][3 + a] = k * at.of[r][3 + a];
  }
}

/// Adds the viscous stress of the modes: t k_a times the rate of F^T q_a.
template <typename Shape>
PALPATE_INLINE void add_brakes(const Shape& shape, const EightMat& f, const EightMat37& at, const EightMat37& rate,
                               EightMat37& p) {
  for (int a = 0; a < kModesOfHexa; ++a) {
    Eight brake;
    shape.k(a, brake);
    brake *= shape.cells.damping_s;
    for (int m = 0; m < 3; ++m) {
      Eight s = rate.of[0][m] * at.of[0][3 + a] + f.of[0][m] * rate.of[0][3 + a];
      for (int r = 1; r < 3; ++r) s += rate.of[r][m] * at.of[r][3 + a] + f.of[r][m] * rate.of[r][3 + a];
      s *= brake;
      for (int r = 0; r < 3; ++r) {
        p.of[r][m] += at.of[r][3 + a] * s;
        p.of[r][3 + a] += f.of[r][m] * s;
      }
    }
  }
}

template <std::size_t N, typename Shape>
PALPATE_INLINE void add_forces_of(const TetraMaterial& m, const Shape& shape, const NodeArrays& u, const NodeArrays& v,
                                  NodeArrays& f) {
  EightMat37 at, rate, p;
  gradients(shape, u, at);
  EightMat stress, deformation, mean_rate;
  if (m.law == SolidLaw::neo_hookean && m.fibre_k == 0)
    find_neo_hookean(m, at, stress);
  else
    find_elastic<N>(m, at, stress);
  if (m.is_viscous()) {
    gradients(shape, v, rate);
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) {
        deformation.of[r][c] = at.of[r][c] + (r == c ? 1.0F : 0.0F);
        mean_rate.of[r][c] = rate.of[r][c];
      }
    add_viscous(static_cast<float>(m.viscous_mu), static_cast<float>(m.viscous_lambda), deformation, mean_rate, stress);
  }
  Eight volume;
  shape.volume(volume);
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) p.of[r][c] = volume * stress.of[r][c];
  add_modes(shape, at, p);
  if (m.is_viscous()) add_brakes(shape, deformation, at, rate, p);
  EightTruths lane = {0, 1, 2, 3, 4, 5, 6, 7};
  const EightTruths used = lane < static_cast<std::int32_t>(shape.cells.used);
  float* const axes[3] = {f.x.data(), f.y.data(), f.z.data()};
  for (int r = 0; r < 3; ++r) {
    if (shape.cells.in_a_row && shape.cells.used < kEight)  // lanes past the end of the row hold other nodes
      for (Eight& entry : p.of[r]) entry = used ? entry : Eight{};
    Eight force[8];
    shape.forces(p.of[r], force);
    add_to_corners(shape.cells, force, axes[r]);
  }
}

template <std::size_t N>
PALPATE_INLINE void add_hexa_forces_in_floats(std::span<const TetraMaterial> materials, std::span<const HexaCells> all,
                                              const NodeArrays& u, const NodeArrays& v, NodeArrays& f) {
  for (const HexaCells& cells : all) {
    if (cells.own.empty())
      add_forces_of<N>(materials[cells.material], Box{cells}, u, v, f);
    else
      add_forces_of<N>(materials[cells.material], Own{cells}, u, v, f);
  }
}

template <typename Shape>
PALPATE_INLINE void strains_of(const Shape& shape, const NodeArrays& u, HexaStrains& out) {
  EightMat37 f;
  gradients(shape, u, f);
  for (int r = 0; r < 3; ++r) f.of[r][r] += 1.0F;
  Eight strain{}, most{};
  for (int r = 0; r < 3; ++r) {
    Eight row{};
    for (int s = 0; s < 3; ++s) {
      const Eight square = f.of[r][0] * f.of[s][0] + f.of[r][1] * f.of[s][1] + f.of[r][2] * f.of[s][2];
      const Eight beyond = square - (r == s ? 1.0F : 0.0F);
      strain += beyond * beyond;
      row += square < 0.0F ? -square : square;
    }
    most = row > most ? row : most;
  }
  __builtin_memcpy(out.strain.of, &strain, sizeof(strain));
  __builtin_memcpy(out.square.of, &most, sizeof(most));
}

PALPATE_INLINE void find_strains(std::span<const HexaCells> all, const NodeArrays& u, std::span<HexaStrains> strains) {
  for (std::size_t k = 0; k < all.size(); ++k) {
    if (all[k].own.empty())
      strains_of(Box{all[k]}, u, strains[k]);
    else
      strains_of(Own{all[k]}, u, strains[k]);
    for (float& strain : strains[k].strain.of) strain = __builtin_sqrtf(strain);
  }
}

#define PALPATE_HEXA_FORCE_LOOPS(N, TARGET)                                                                                     \
  TARGET void float_forces_##N(std::span<const TetraMaterial> materials, std::span<const HexaCells> cells, const NodeArrays& u, \
                               const NodeArrays& v, NodeArrays& f) {                                                            \
    add_hexa_forces_in_floats<N>(materials, cells, u, v, f);                                                                    \
  }                                                                                                                             \
  TARGET void strains_##N(std::span<const HexaCells> cells, const NodeArrays& u, std::span<HexaStrains> strains) {              \
    find_strains(cells, u, strains);                                                                                            \
  }

PALPATE_HEXA_FORCE_LOOPS(2, )
#if defined(__x86_64__)
PALPATE_HEXA_FORCE_LOOPS(4, __attribute__((target("avx2"))))
PALPATE_HEXA_FORCE_LOOPS(8, __attribute__((target("avx512f"))))
#endif

std::vector<HexaForceLoops> float_loops_here() {
  std::vector<HexaForceLoops> loops{{2, &float_forces_2, &strains_2}};
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx2")) loops.push_back({4, &float_forces_4, &strains_4});
  if (__builtin_cpu_supports("avx512f")) loops.push_back({8, &float_forces_8, &strains_8});
#endif
  return loops;
}

}  // namespace

std::span<const HexaForceLoops> hexa_force_loops() {
  static const std::vector<HexaForceLoops> loops = float_loops_here();
  return loops;
}

}  // namespace palpate
