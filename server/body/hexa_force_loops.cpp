#include "server/body/hexa_forces.hpp"
#include "server/elements/generalised_stress.hpp"
#include "server/elements/law_loops.hpp"

namespace palpate {
namespace {

using Eight = Lanes<float, 8>;
constexpr std::size_t kEight = HexaCells::kLanes;
constexpr int kColumns = HexaShape::kColumns;
/// (F - 1, q) of eight cells, or a stress or rate of the same shape.
using EightGradient = LaneGradient<Eight, kColumns>;

/// Loads one component at the corners.
PALPATE_INLINE void load_corners(const HexaCells& cells, const float* y, Eight (&at)[8]) {
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

  PALPATE_INLINE void number(std::size_t k, Eight& of) const { load_lanes(cells.own[k].of, of); }
  PALPATE_INLINE void add_product_with_g(std::size_t node, int m, const Eight& by, Eight& to) const {
    Eight g;
    number(ShapeNumbers<HexaShape>::gradient_at(node, static_cast<std::size_t>(m)), g);
    to += by * g;
  }
  /// Since the g_i sum to zero, values relative to the first corner are enough.
  PALPATE_INLINE void gradient(Eight (&at)[8], Eight (&sum)[kColumns]) const {
    for (std::size_t i = 1; i < 8; ++i) at[i] -= at[0];
    for (int m = 0; m < kColumns; ++m) {
      sum[m] = Eight{};
      for (std::size_t i = 1; i < 8; ++i) add_product_with_g(i, m, at[i], sum[m]);
    }
  }
  PALPATE_INLINE void forces(const Eight (&p)[kColumns], Eight (&at)[8]) const {
    at[0] = Eight{};
    for (std::size_t i = 1; i < 8; ++i) {
      Eight sum{};
      for (int m = 0; m < kColumns; ++m) add_product_with_g(i, m, p[m], sum);
      at[i] = -sum;
      at[0] += sum;
    }
  }
  PALPATE_INLINE void volume(Eight& v) const { number(0, v); }
  PALPATE_INLINE void k(int mode, Eight& of) const {
    number(ShapeNumbers<HexaShape>::kModesAt + static_cast<std::size_t>(mode), of);
  }
};

template <typename Shape>
PALPATE_INLINE void gradients(const Shape& shape, const NodeArrays& y, EightGradient& sum) {
  const float* const axes[3] = {y.x.data(), y.y.data(), y.z.data()};
  for (int r = 0; r < 3; ++r) {
    Eight at[8];
    load_corners(shape.cells, axes[r], at);
    shape.gradient(at, sum.of[r]);
  }
}

/// Adds the elastic stress in double precision, N lanes at a time.
template <std::size_t N>
PALPATE_INLINE void add_stress_in_doubles(const ElementMaterial& m, const Eight& volume, const LaneMatrix<Eight>& of,
                                          LaneMatrix<Eight>& p) {
  using L = Lanes<double, N>;
  for (std::size_t lane = 0; lane < kEight; lane += N) {
    const auto widen = [&](const Eight& from, L& to) __attribute__((always_inline)) {
      for (std::size_t l = 0; l < N; ++l) to[l] = static_cast<double>(from[lane + l]);
    };
    LaneMatrix<L> h, sum{};
    L much;
    for (int k = 0; k < 9; ++k) widen(of.of[k / 3][k % 3], h.of[k / 3][k % 3]);
    widen(volume, much);
    const LaneModuli<L> moduli{m.mu * much, m.lambda * much};
    Variants<StressLoop>::at<N>(*m.law, moduli, h, sum);
    for (int k = 0; k < 9; ++k)
      for (std::size_t l = 0; l < N; ++l) p.of[k / 3][k % 3][lane + l] += static_cast<float>(sum.of[k / 3][k % 3][l]);
  }
}

template <std::size_t N, typename Shape>
PALPATE_INLINE void add_forces_of(const ElementMaterial& m, const Shape& shape, const NodeArrays& u, const NodeArrays& v,
                                  NodeArrays& f) {
  EightGradient at, p;
  LaneMatrix<Eight> h, stress{};
  Eight volume;
  gradients(shape, u, at);
  at.mean(h);
  shape.volume(volume);
  const LaneModuli<Eight> moduli{static_cast<float>(m.mu) * volume, static_cast<float>(m.lambda) * volume};
  if (m.law->is_single_precision())
    m.law->add_stress(moduli, h, stress);
  else
    add_stress_in_doubles<N>(m, volume, h, stress);
  p.set_mean(stress);
  LaneDamping<Eight, kModesOfHexa> damping;
  for (int a = 0; a < kModesOfHexa; ++a) {
    shape.k(a, damping.k[a]);
    for (int r = 0; r < 3; ++r) p.of[r][3 + a] = damping.k[a] * at.of[r][3 + a];
  }
  if (m.is_viscous()) {
    EightGradient rate;
    gradients(shape, v, rate);
    const auto damping_s = static_cast<float>(m.damping_s);
    damping.moduli = {damping_s * moduli.mu, damping_s * moduli.lambda};
    for (Eight& k : damping.k) k *= damping_s;
    deformation_gradient(h, stress);
    add_generalised_viscous_stress(damping, stress, at, rate, p);
  }
  LaneTruths<Eight> lane = {0, 1, 2, 3, 4, 5, 6, 7};
  const LaneTruths<Eight> used = lane < static_cast<std::int32_t>(shape.cells.used);
  float* const axes[3] = {f.x.data(), f.y.data(), f.z.data()};
  for (int r = 0; r < 3; ++r) {
    if (shape.cells.in_a_row && shape.cells.used < kEight)  // lanes past the end of the row hold other nodes
      for (Eight& entry : p.of[r]) entry = used ? entry : Eight{};
    Eight force[8];
    shape.forces(p.of[r], force);
    add_to_corners(shape.cells, force, axes[r]);
  }
}

struct HexaForceLoop {
  template <std::size_t N>
  PALPATE_INLINE static void run(std::span<const ElementMaterial> materials, std::span<const HexaCells> all, const NodeArrays& u,
                                 const NodeArrays& v, NodeArrays& f) {
    for (const HexaCells& cells : all) {
      if (cells.own.empty())
        add_forces_of<N>(materials[cells.material], Box{cells}, u, v, f);
      else
        add_forces_of<N>(materials[cells.material], Own{cells}, u, v, f);
    }
  }
};

struct StrainLoop {
  template <std::size_t N>
  PALPATE_INLINE static void run(std::span<const HexaCells> all, const NodeArrays& u, std::span<HexaStrains> strains) {
    for (std::size_t k = 0; k < all.size(); ++k) {
      if (all[k].own.empty())
        strains_of(Box{all[k]}, u, strains[k]);
      else
        strains_of(Own{all[k]}, u, strains[k]);
    }
  }

 private:
  template <typename Shape>
  PALPATE_INLINE static void strains_of(const Shape& shape, const NodeArrays& u, HexaStrains& out) {
    EightGradient at;
    LaneMatrix<Eight> h, f, square;
    gradients(shape, u, at);
    at.mean(h);
    deformation_gradient(h, f);
    product_with_transposed(f, f, square);
    Eight strain{}, most{};
    for (int r = 0; r < 3; ++r) {
      Eight row{};
      for (int s = 0; s < 3; ++s) {
        const Eight one = square.of[r][s], beyond = one - (r == s ? 1.0F : 0.0F);
        strain += beyond * beyond;
        row += one < 0.0F ? -one : one;
      }
      most = row > most ? row : most;
    }
    lane_roots(strain, strain);
    store_lanes(strain, out.strain.of);
    store_lanes(most, out.square.of);
  }
};

}  // namespace

std::span<const Variant<std::span<const ElementMaterial>, std::span<const HexaCells>, const NodeArrays&, const NodeArrays&,
                        NodeArrays&>>
hexa_force_loops() {
  return Variants<HexaForceLoop>::all<std::span<const ElementMaterial>, std::span<const HexaCells>, const NodeArrays&,
                                      const NodeArrays&, NodeArrays&>();
}

void find_strains(std::span<const HexaCells> cells, const NodeArrays& u, std::span<HexaStrains> strains) {
  static const auto run = Variants<StrainLoop>::widest<std::span<const HexaCells>, const NodeArrays&, std::span<HexaStrains>>();
  run(cells, u, strains);
}

}  // namespace palpate
