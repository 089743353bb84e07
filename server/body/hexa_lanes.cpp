#include "server/body/hexa_lanes.hpp"

#include <algorithm>

#include "server/body/solid_lanes.hpp"
#include "server/body/tetra_lanes.hpp"

namespace palpate {
namespace {

// Where in HexaGroup::numbers things are. Of C the linear modes among each other, 9 x 9, and h_4 with itself, 3 x 3: no more is
// not zero.
constexpr std::size_t kVolumeAt = 0, kIsotropicAt = 1, kGradientsAt = 2, kLinearAt = kGradientsAt + 56,
                      kTrilinearAt = kLinearAt + 81, kNumbersOfHexa = kTrilinearAt + 9;

std::size_t gradient_at(int node, int m) {
  return kGradientsAt + 7 * static_cast<std::size_t>(node) + static_cast<std::size_t>(m);
}

/// (F, q) or what goes with it, side by side.
template <std::size_t N>
struct Mat37Lanes {
  Doubles<N> of[3][7];
};

/// F^T q or what goes with it: [3 mode + component].
template <std::size_t N>
struct ModeLanes {
  Doubles<N> of[12];
};

/// The numbers of elements that share a shape.
template <std::size_t N>
struct SharedShape {
  const HexaShape& shape;

  PALPATE_INLINE double g(int node, int m) const { return shape.rest.g(m, node); }
  PALPATE_INLINE void volume(Doubles<N>& v) const { v = Doubles<N>{} + shape.rest.volume_m3; }
  PALPATE_INLINE double k0() const { return shape.modes.k0; }
  /// s = C q
  PALPATE_INLINE void times_c(const ModeLanes<N>& q, ModeLanes<N>& s) const {
    s = {};
    for (const HexaShape::Entry& e : shape.entries) s.of[e.row] += e.value * q.of[e.column];
  }
};

/// Those of elements of their own.
template <std::size_t N>
struct OwnShapes {
  const EightNumbers* numbers;
  std::size_t from;

  PALPATE_INLINE const Doubles<N>& at(std::size_t k) const { return doubles<N>(numbers[k].of + from); }
  PALPATE_INLINE const Doubles<N>& g(int node, int m) const { return at(gradient_at(node, m)); }
  PALPATE_INLINE void volume(Doubles<N>& v) const { v = at(kVolumeAt); }
  PALPATE_INLINE const Doubles<N>& k0() const { return at(kIsotropicAt); }
  PALPATE_INLINE void times_c(const ModeLanes<N>& q, ModeLanes<N>& s) const {
    for (std::size_t r = 0; r < 9; ++r) {
      s.of[r] = at(kLinearAt + 9 * r) * q.of[0];
      for (std::size_t c = 1; c < 9; ++c) s.of[r] += at(kLinearAt + 9 * r + c) * q.of[c];
    }
    for (std::size_t r = 0; r < 3; ++r)
      s.of[9 + r] =
          at(kTrilinearAt + 3 * r) * q.of[9] + at(kTrilinearAt + 3 * r + 1) * q.of[10] + at(kTrilinearAt + 3 * r + 2) * q.of[11];
  }
};

/// sum over the nodes of y_i g_i^T; the sum of g_i is zero, so what counts is how far they are from the first.
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

/// to += the first derivative of F^T q at `at` along `change`, or F^T q itself with `change` = (F, 0).
template <std::size_t N>
PALPATE_INLINE void add_turned_back(const Mat37Lanes<N>& f, const Mat37Lanes<N>& q, ModeLanes<N>& to) {
  for (int a = 0; a < kModesOfHexa; ++a)
    for (int m = 0; m < 3; ++m)
      to.of[3 * a + m] += f.of[0][m] * q.of[0][3 + a] + f.of[1][m] * q.of[1][3 + a] + f.of[2][m] * q.of[2][3 + a];
}

/// What the modes push with: s conjugate to F^T q, the viscous part included, and k_0 q.
template <std::size_t N, typename Shape>
PALPATE_INLINE void add_modes(const Shape& shape, const Mat37Lanes<N>& at, const Mat37Lanes<N>* rate, double damping_s,
                              Mat37Lanes<N>& p) {
  ModeLanes<N> back{}, s;
  add_turned_back(at, at, back);
  if (rate) {
    ModeLanes<N> change{};
    add_turned_back(*rate, at, change);
    add_turned_back(at, *rate, change);
    for (int k = 0; k < 12; ++k) back.of[k] += damping_s * change.of[k];
    shape.times_c(back, s);
    for (int k = 0; k < 12; ++k) s.of[k] += damping_s * (shape.k0() * change.of[k]);
  } else {
    shape.times_c(back, s);
  }
  for (int r = 0; r < 3; ++r) {
    for (int m = 0; m < 3; ++m)
      for (int a = 0; a < kModesOfHexa; ++a) p.of[r][m] += at.of[r][3 + a] * s.of[3 * a + m];
    for (int a = 0; a < kModesOfHexa; ++a) {
      p.of[r][3 + a] += shape.k0() * at.of[r][3 + a];
      for (int m = 0; m < 3; ++m) p.of[r][3 + a] += at.of[r][m] * s.of[3 * a + m];
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
    add_viscous(m, gradient, mean_rate, stress);
  }
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) p.of[r][c] = volume * stress.of[r][c];
  add_modes<N>(shape, at, m.is_viscous() ? &rate : nullptr, group.damping_s, p);
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

/// How F^T q changes with one node's motion: [3 mode + component][coordinate].
template <std::size_t N>
struct ModesMoved {
  Doubles<N> of[12][3];
};

template <std::size_t N, typename Shape>
PALPATE_INLINE void modes_moved(const Shape& shape, const Mat37Lanes<N>& at, int node, ModesMoved<N>& moved) {
  for (int a = 0; a < kModesOfHexa; ++a)
    for (int m = 0; m < 3; ++m)
      for (int r = 0; r < 3; ++r)
        moved.of[3 * a + m][r] = at.of[r][3 + a] * shape.g(node, m) + at.of[r][m] * shape.g(node, 3 + a);
}

/// ((c_k + t c_d) C + t c_d k_0) times that.
template <std::size_t N, typename Shape>
PALPATE_INLINE void stiffened(const Shape& shape, const ModesMoved<N>& moved, double much, double isotropic, ModesMoved<N>& to) {
  for (int r = 0; r < 3; ++r) {
    ModeLanes<N> column, s;
    for (int k = 0; k < 12; ++k) column.of[k] = moved.of[k][r];
    shape.times_c(column, s);
    for (int k = 0; k < 12; ++k) to.of[k][r] = much * s.of[k] + isotropic * (shape.k0() * column.of[k]);
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
  ModeLanes<N> back{}, s;
  add_turned_back(at, at, back);
  shape.times_c(back, s);
  ModesMoved<N> moved[8];
  Doubles<N> along[8][kModesOfHexa];  // c_k b_i . s_a
  for (int i = 0; i < 8; ++i) {
    modes_moved<N>(shape, at, i, moved[i]);
    for (int a = 0; a < kModesOfHexa; ++a)
      along[i][a] = c_k * (law.b[i][0] * s.of[3 * a] + law.b[i][1] * s.of[3 * a + 1] + law.b[i][2] * s.of[3 * a + 2]);
  }
  const double viscous = c_d * group.damping_s;
  for (int j = 0; j < 8; ++j) {
    ModesMoved<N> stiff;
    stiffened<N>(shape, moved[j], c_k + viscous, viscous, stiff);
    for (int i = j; i < 8; ++i) {
      Mat<N> k;
      tangent_block(law, m.law, i, j, k);
      Doubles<N> straight{};
      for (int a = 0; a < kModesOfHexa; ++a)
        straight += along[i][a] * shape.g(j, 3 + a) + along[j][a] * shape.g(i, 3 + a) +
                    c_k * (shape.k0() * (shape.g(i, 3 + a) * shape.g(j, 3 + a)));
      auto& numbers = out.at[pair_index(static_cast<std::size_t>(i), static_cast<std::size_t>(j))];
      for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) {
          Doubles<N> sum = k.of[r][c];
          for (int n = 0; n < 12; ++n) sum += moved[i].of[n][r] * stiff.of[n][c];
          if (r == c) sum += straight;
          doubles<N>(numbers[static_cast<std::size_t>(3 * r + c)].of + from) = sum;
        }
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
    : rest(at), modes(of, at), material(material_index) {
  for (std::uint32_t r = 0; r < 12; ++r)
    for (std::uint32_t c = 0; c < 12; ++c) {
      const bool coupled = (r < 9) == (c < 9);
      if (coupled && modes.c(r, c) != 0) entries.push_back({r, c, modes.c(r, c)});
    }
}

std::vector<EightNumbers> numbers_of(std::span<const HexaShape* const> shapes) {
  std::vector<EightNumbers> numbers(kNumbersOfHexa, EightNumbers{});
  for (std::size_t l = 0; l < shapes.size(); ++l) {
    const HexaShape& shape = *shapes[l];
    numbers[kVolumeAt].of[l] = shape.rest.volume_m3;
    numbers[kIsotropicAt].of[l] = shape.modes.k0;
    for (int i = 0; i < 8; ++i)
      for (int m = 0; m < 7; ++m) numbers[gradient_at(i, m)].of[l] = shape.rest.g(m, i);
    for (std::size_t k = 0; k < 81; ++k)
      numbers[kLinearAt + k].of[l] = shape.modes.c(static_cast<int>(k / 9), static_cast<int>(k % 9));
    for (std::size_t k = 0; k < 9; ++k)
      numbers[kTrilinearAt + k].of[l] = shape.modes.c(9 + static_cast<int>(k / 3), 9 + static_cast<int>(k % 3));
  }
  return numbers;
}

std::span<const HexaLoops> hexa_loops() {
  static const std::vector<HexaLoops> loops = hexa_loops_here();
  return loops;
}

}  // namespace palpate
