#include "server/elements/element_loops.hpp"

#include <algorithm>

#include "server/elements/generalised_stress.hpp"
#include "server/elements/law_loops.hpp"
#include "server/solve/fused.hpp"

namespace palpate {
namespace {

/// Numbers of elements that share a shape.
template <std::size_t N, class Shape>
struct SharedNumbers {
  const Shape& shape;

  PALPATE_INLINE double g(int node, int column) const {
    return column < 3 ? shape.b(column, node) : shape.gamma(column - 3, node);
  }
  PALPATE_INLINE double volume() const { return shape.volume_m3; }
  PALPATE_INLINE double k(int mode) const { return shape.k[static_cast<std::size_t>(mode)]; }
};

/// Numbers of elements with their own shapes, from one lane on.
template <std::size_t N, class Shape>
struct OwnNumbers {
  const EightNumbers* numbers;
  std::size_t from;

  PALPATE_INLINE const Doubles<N>& at(std::size_t k) const { return doubles<N>(numbers[k].of + from); }
  PALPATE_INLINE const Doubles<N>& g(int node, int column) const {
    return at(ShapeNumbers<Shape>::gradient_at(static_cast<std::size_t>(node), static_cast<std::size_t>(column)));
  }
  PALPATE_INLINE const Doubles<N>& volume() const { return at(0); }
  PALPATE_INLINE const Doubles<N>& k(int mode) const {
    return at(ShapeNumbers<Shape>::kModesAt + static_cast<std::size_t>(mode));
  }
};

template <std::size_t N>
struct OwnNumbers<N, TrussShape> {
  const EightNumbers* numbers;
  std::size_t from;

  PALPATE_INLINE static constexpr double g(int node, int) { return node == 0 ? -1 : 1; }
  PALPATE_INLINE void read(Lanes<double, N>& stiffness, Lanes<double, N>& rest, Lanes<double, N>& damper) const {
    load_lanes(numbers[0].of + from, stiffness);
    load_lanes(numbers[1].of + from, rest);
    load_lanes(numbers[2].of + from, damper);
  }
};

/// The elements of a group from one lane on, as many as fit into a vector.
template <std::size_t N, class Shape, class Numbers>
struct Part {
  using L = Lanes<double, N>;
  using Gradient = LaneGradient<L, Shape::kColumns>;
  const ElementGroup<Shape>& group;
  std::size_t from;
  Numbers numbers;

  PALPATE_INLINE std::size_t used() const { return std::min(N, group.count - from); }

  /// Computes sum over the nodes of y_i g_i^T; as the g_i sum to zero, values relative to the first node are enough.
  PALPATE_INLINE void gradient(const double* y, Gradient& sum) const {
    constexpr std::size_t kOthers = Shape::kNodes - 1;
    alignas(64) double way[kOthers][3][N];
    for (std::size_t l = 0; l < N; ++l) {
      const double* const y0 = y + 3 * std::size_t{group.nodes[0][from + l]};
      for (std::size_t i = 0; i < kOthers; ++i) {
        const double* const yi = y + 3 * std::size_t{group.nodes[i + 1][from + l]};
        for (std::size_t r = 0; r < 3; ++r) way[i][r][l] = yi[r] - y0[r];
      }
    }
    for (int r = 0; r < 3; ++r)
      for (int m = 0; m < Shape::kColumns; ++m) {
        sum.of[r][m] = doubles<N>(way[0][r]) * numbers.g(1, m);
        for (std::size_t i = 1; i < kOthers; ++i) sum.of[r][m] += doubles<N>(way[i][r]) * numbers.g(static_cast<int>(i) + 1, m);
      }
  }

  /// Adds the forces of a stress to f. In most bodies elements with the same first node follow each other: the forces on it are
  /// summed before they are stored.
  PALPATE_INLINE void scatter(const Gradient& p, double* f) const {
    constexpr std::size_t kOthers = Shape::kNodes - 1;
    alignas(64) double force[kOthers][3][N];
    for (std::size_t i = 0; i < kOthers; ++i)
      for (int r = 0; r < 3; ++r) {
        L sum = p.of[r][0] * numbers.g(static_cast<int>(i) + 1, 0);
        for (int m = 1; m < Shape::kColumns; ++m) sum += p.of[r][m] * numbers.g(static_cast<int>(i) + 1, m);
        store_lanes(sum, force[i][r]);
      }
    for (std::size_t l = 0; l < used();) {
      const std::uint32_t first = group.nodes[0][from + l];
      double* const f0 = f + 3 * std::size_t{first};
      double sum[3] = {f0[0], f0[1], f0[2]};
      for (; l < used() && group.nodes[0][from + l] == first; ++l)
        for (std::size_t i = 0; i < kOthers; ++i) {
          double* const fi = f + 3 * std::size_t{group.nodes[i + 1][from + l]};
          for (std::size_t r = 0; r < 3; ++r) {
            fi[r] -= force[i][r][l];
            sum[r] += force[i][r][l];
          }
        }
      for (std::size_t r = 0; r < 3; ++r) f0[r] = sum[r];
    }
  }

  PALPATE_INLINE void moduli(const ElementMaterial& m, double much, LaneModuli<L>& to) const {
    const L volume = L{} + numbers.volume();
    to = {much * m.mu * volume, much * m.lambda * volume};
  }
  PALPATE_INLINE void damping(const ElementMaterial& m, double much, LaneDamping<L, Shape::kModes>& to) const {
    moduli(m, much * m.damping_s, to.moduli);
    for (int a = 0; a < Shape::kModes; ++a) to.k[a] = L{} + much * m.damping_s * numbers.k(a);
  }
};

template <typename L, int Columns>
PALPATE_INLINE void displacement_gradient(const LaneGradient<L, Columns>& at, LaneMatrix<L>& h) {
  at.mean(h);
  for (int r = 0; r < 3; ++r) h.of[r][r] -= 1.0;
}

template <std::size_t N, class Shape, class Of>
PALPATE_INLINE void for_parts(const ElementGroup<Shape>& group, const Of& of) {
  for (std::size_t from = 0; from < group.count; from += N) {
    if constexpr (!kIsTruss<Shape>)
      if (group.shape) {
        of(Part<N, Shape, SharedNumbers<N, Shape>>{group, from, {*group.shape}});
        continue;
      }
    of(Part<N, Shape, OwnNumbers<N, Shape>>{group, from, {group.numbers.data(), from}});
  }
}

/// Springs at one state. One of no length has no direction, force or stiffness.
template <typename L>
struct LaneAxial {
  L n[3], across, axial, slope, damper;  ///< n, t, s, T', c

  template <class Of>
  PALPATE_INLINE LaneAxial(const SpringMaterial& m, const Of& part, const double* x, const double* v) {
    constexpr double kLeastLength = 1e-12;
    LaneGradient<L, 1> d, w;
    L stiffness, rest, length, tension;
    part.gradient(x, d);
    part.gradient(v, w);
    part.numbers.read(stiffness, rest, damper);
    const L square = d.of[0][0] * d.of[0][0] + d.of[1][0] * d.of[1][0] + d.of[2][0] * d.of[2][0], none{};
    lane_roots(square, length);
    const L elongation = length - rest, inverse = length > kLeastLength ? 1.0 / length : none;
    m.respond(stiffness, rest, elongation, tension, slope);
    for (int r = 0; r < 3; ++r) n[r] = d.of[r][0] * inverse;
    axial = tension + damper * (n[0] * w.of[0][0] + n[1] * w.of[1][0] + n[2] * w.of[2][0]);
    slope = length > kLeastLength ? slope : none;
    across = axial * inverse;
  }
};

template <class Shape>
struct ForceLoop {
  template <std::size_t N>
  PALPATE_INLINE static void run(const MaterialOf<Shape>& m, const ElementGroup<Shape>& group, const double* x, const double* v,
                                 double* f) {
    for_parts<N>(
        group, [&](const auto& part) __attribute__((always_inline)) {
          LaneGradient<Lanes<double, N>, Shape::kColumns> p;
          stress<N>(m, part, x, v, p);
          part.scatter(p, f);
        });
  }

 private:
  template <std::size_t N, class Of>
  PALPATE_INLINE static void stress(const SpringMaterial& m, const Of& part, const double* x, const double* v,
                                    LaneGradient<Lanes<double, N>, 1>& p) {
    const LaneAxial<Lanes<double, N>> at(m, part, x, v);
    for (int r = 0; r < 3; ++r) p.of[r][0] = at.axial * at.n[r];
  }
  template <std::size_t N, class Of>
  PALPATE_INLINE static void stress(const ElementMaterial& m, const Of& part, const double* x, const double* v,
                                    LaneGradient<Lanes<double, N>, Shape::kColumns>& p) {
    using L = Lanes<double, N>;
    LaneGradient<L, Shape::kColumns> at;
    LaneMatrix<L> h, stress{};
    LaneModuli<L> moduli;
    part.gradient(x, at);
    displacement_gradient(at, h);
    part.moduli(m, 1, moduli);
    Variants<StressLoop>::at<N>(*m.law, moduli, h, stress);
    p.set_mean(stress);
    for (int a = 0; a < Shape::kModes; ++a)
      for (int r = 0; r < 3; ++r) p.of[r][3 + a] = part.numbers.k(a) * at.of[r][3 + a];
    if (!m.is_viscous()) return;
    LaneGradient<L, Shape::kColumns> rate;
    LaneMatrix<L> deformation;
    LaneDamping<L, Shape::kModes> damping;
    part.gradient(v, rate);
    at.mean(deformation);
    part.damping(m, 1, damping);
    add_generalised_viscous_stress(damping, deformation, at, rate, p);
  }
};

/// What the hourglass modes add to the blocks:
///     K_ij += w_ij 1,   D_ij += t (b_i . b_j sum_a k_a q_a q_a^T + q_j (F b_i)^T + (F b_j) q_i^T + w_ij F F^T)
/// with w_ij = sum_a k_a gamma_ai gamma_aj and q_i = sum_a k_a gamma_ai q_a.
template <typename L, int Nodes, int Modes>
struct ModeBlocks {
  L stiff[Nodes][Modes], moved[Nodes][3], fb[Nodes][3];  ///< k_a gamma_ai, q_i, F b_i
  LaneMatrix<L> of_modes, square;                        ///< sum_a k_a q_a q_a^T, F F^T

  template <class Numbers>
  PALPATE_INLINE ModeBlocks(const Numbers& numbers, const LaneGradient<L, 3 + Modes>& at) {
    LaneMatrix<L> f;
    at.mean(f);
    product_with_transposed(f, f, square);
    for (int i = 0; i < Nodes; ++i) {
      for (int a = 0; a < Modes; ++a) stiff[i][a] = L{} + numbers.k(a) * numbers.g(i, 3 + a);
      for (int r = 0; r < 3; ++r) {
        fb[i][r] = f.of[r][0] * numbers.g(i, 0) + f.of[r][1] * numbers.g(i, 1) + f.of[r][2] * numbers.g(i, 2);
        moved[i][r] = stiff[i][0] * at.of[r][3];
        for (int a = 1; a < Modes; ++a) moved[i][r] += stiff[i][a] * at.of[r][3 + a];
      }
    }
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) {
        of_modes.of[r][c] = numbers.k(0) * (at.of[r][3] * at.of[c][3]);
        for (int a = 1; a < Modes; ++a) of_modes.of[r][c] += numbers.k(a) * (at.of[r][3 + a] * at.of[c][3 + a]);
      }
  }

  /// Adds c_k K_ij + viscous / t D_ij.
  template <class Numbers>
  PALPATE_INLINE void add(const Numbers& numbers, int i, int j, double c_k, double viscous, LaneMatrix<L>& block) const {
    L straight = stiff[i][0] * numbers.g(j, 3);
    for (int a = 1; a < Modes; ++a) straight += stiff[i][a] * numbers.g(j, 3 + a);
    for (int r = 0; r < 3; ++r) block.of[r][r] += c_k * straight;
    if (viscous == 0) return;
    const L dot =
        L{} + (numbers.g(i, 0) * numbers.g(j, 0) + numbers.g(i, 1) * numbers.g(j, 1) + numbers.g(i, 2) * numbers.g(j, 2));
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c)
        block.of[r][c] +=
            viscous * (dot * of_modes.of[r][c] + moved[j][r] * fb[i][c] + fb[j][r] * moved[i][c] + straight * square.of[r][c]);
  }
};

template <class Shape>
struct BlockLoop {
  template <std::size_t N>
  PALPATE_INLINE static void run(const MaterialOf<Shape>& m, const ElementGroup<Shape>& group, const double* x, const double* v,
                                 double c_d, double c_k, bool clamp, ElementBlocks<Shape>& out) {
    for_parts<N>(
        group, [&](const auto& part) __attribute__((always_inline)) { blocks_of<N>(m, part, x, v, c_d, c_k, clamp, out); });
  }

 private:
  template <std::size_t N, class Of>
  PALPATE_INLINE static void blocks_of(const SpringMaterial& m, const Of& part, const double* x, const double* v, double c_d,
                                       double c_k, bool clamp, ElementBlocks<Shape>& out) {
    using L = Lanes<double, N>;
    const LaneAxial<L> at(m, part, x, v);
    const int axes = m.planar ? 2 : 3;
    const L none{};
    L across = c_k * at.across;
    if (clamp) across = across > 0.0 ? across : none;
    const L along = c_k * at.slope - across + c_d * at.damper;
    for (int n = 0; n < 9; ++n) {
      const int r = n / 3, c = n % 3;
      L k{};
      if (r < axes && c < axes) k = along * at.n[r] * at.n[c] + (r == c ? across : none);
      const L minus = -k;
      store_lanes(k, out.at[pair_index(0, 0)][static_cast<std::size_t>(n)].of + part.from);
      store_lanes(minus, out.at[pair_index(1, 0)][static_cast<std::size_t>(n)].of + part.from);
      store_lanes(k, out.at[pair_index(1, 1)][static_cast<std::size_t>(n)].of + part.from);
    }
  }
  template <std::size_t N, class Of>
  PALPATE_INLINE static void blocks_of(const ElementMaterial& m, const Of& part, const double* x, const double*, double c_d,
                                       double c_k, bool clamp, ElementBlocks<Shape>& out) {
    using L = Lanes<double, N>;
    constexpr int kNodes = Shape::kNodes;
    const double viscous = c_d * m.damping_s;
    LaneGradient<L, Shape::kColumns> at;
    LaneMatrix<L> h;
    LaneModuli<L> moduli;
    Tangent<L> a;
    part.gradient(x, at);
    displacement_gradient(at, h);
    part.moduli(m, c_k, moduli);
    if (c_k == 0)
      a.clear();
    else
      Variants<TangentLoop>::at<N>(*m.law, moduli, h, clamp, a);
    if (viscous != 0) {
      at.mean(h);
      part.moduli(m, viscous, moduli);
      add_viscous_tangent(moduli.mu, moduli.lambda, h, a);
    }
    L b[kNodes][3];
    for (int i = 0; i < kNodes; ++i)
      for (int c = 0; c < 3; ++c) b[i][c] = L{} + part.numbers.g(i, c);
    const auto put = [&](int i, int j, const LaneMatrix<L>& k) __attribute__((always_inline)) {
      auto& numbers = out.at[pair_index(static_cast<std::size_t>(i), static_cast<std::size_t>(j))];
      for (std::size_t n = 0; n < 9; ++n) store_lanes(k.of[n / 3][n % 3], numbers[n].of + part.from);
    };
    if constexpr (Shape::kModes == 0) {
      blocks_with(a, b, put, [](int, int, LaneMatrix<L>&) __attribute__((always_inline)){});
    } else {
      const ModeBlocks<L, kNodes, Shape::kModes> modes(part.numbers, at);
      blocks_with(
          a, b, put, [&](int i, int j, LaneMatrix<L>& k) __attribute__((always_inline)) {
            modes.add(part.numbers, i, j, c_k, viscous, k);
          });
    }
  }
  /// Every row of blocks sums to zero, as the g_i do: those with node 0 follow from the others.
  template <typename L, class Put, class More>
  PALPATE_INLINE static void blocks_with(const Tangent<L>& a, const L (&b)[Shape::kNodes][3], const Put& put, const More& more) {
    LaneMatrix<L> rows[Shape::kNodes] = {};
    const auto subtract = [&](int row, const LaneMatrix<L>& k, bool transposed) __attribute__((always_inline)) {
      for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) rows[row].of[r][c] -= transposed ? k.of[c][r] : k.of[r][c];
    };
    for (int j = 1; j < Shape::kNodes; ++j) {
      TangentColumns<L> columns;
      columns_of(a, b[j], columns);
      for (int i = j; i < Shape::kNodes; ++i) {
        LaneMatrix<L> k;
        block(columns, b[i], k);
        more(i, j, k);
        put(i, j, k);
        subtract(i, k, false);
        if (i != j) subtract(j, k, true);
      }
      put(j, 0, rows[j]);
      subtract(0, rows[j], false);
    }
    put(0, 0, rows[0]);
  }
};

template <class Shape>
struct LinearisationLoop {
  template <std::size_t N>
  PALPATE_INLINE static void run(const MaterialOf<Shape>& m, const ElementGroup<Shape>& group, const double* x, const double* v,
                                 const std::array<ElementTangent<Shape>*, kElementLanes>& tangents) {
    for_parts<N>(
        group, [&](const auto& part) __attribute__((always_inline)) { linearise<N>(m, part, x, v, &tangents[part.from]); });
  }

 private:
  template <std::size_t N, class Of>
  PALPATE_INLINE static void linearise(const SpringMaterial& m, const Of& part, const double* x, const double* v,
                                       ElementTangent<Shape>* const* tangents) {
    const LaneAxial<Lanes<double, N>> at(m, part, x, v);
    for (std::size_t l = 0; l < part.used(); ++l)
      *tangents[l] = {{at.n[0][l], at.n[1][l], at.n[2][l]}, at.slope[l], at.across[l], at.damper[l]};
  }
  template <std::size_t N, class Of>
  PALPATE_INLINE static void linearise(const ElementMaterial& m, const Of& part, const double* x, const double*,
                                       ElementTangent<Shape>* const* tangents) {
    using L = Lanes<double, N>;
    LaneGradient<L, Shape::kColumns> at;
    LaneMatrix<L> h;
    LaneModuli<L> moduli;
    Tangent<L> a;
    part.gradient(x, at);
    displacement_gradient(at, h);
    part.moduli(m, 1, moduli);
    Variants<TangentLoop>::at<N>(*m.law, moduli, h, false, a);
    for (std::size_t l = 0; l < part.used(); ++l) {
      ElementTangent<Shape>& to = *tangents[l];
      for (int n = 0; n < 45; ++n) to.elastic[n] = a.of[n][l];
      for (int r = 0; r < 3; ++r)
        for (int c = 0; c < Shape::kColumns; ++c) to.gradient[r][c] = at.of[r][c][l];
    }
  }
};

/// Four columns side by side, of one element after the other: the same at every width.
template <class Shape>
struct ProductLoop {
  using L = Lanes<double, kColumnLanes>;
  using Gradient = LaneGradient<L, Shape::kColumns>;

  template <std::size_t N>
  PALPATE_INLINE static void run(const ElementProducts<Shape>& elements, const NodeLanes* y, double c_k, double c_d,
                                 NodeLanes* k_y, NodeLanes* d_y) {
    for (std::size_t e = 0; e < elements.cells.size(); ++e) {
      const ElementCell<Shape>& cell = elements.cells[e];
      const Shape& shape = elements.shapes[cell.shape];
      const ElementTangent<Shape>& at = elements.tangents[e];
      const ElementMaterial& m = elements.materials[cell.material];
      Gradient change{}, p{};
      for (int i = 0; i < Shape::kNodes; ++i) {
        const NodeLanes& of = y[cell.nodes[static_cast<std::size_t>(i)]];
        for (int c = 0; c < Shape::kColumns; ++c) {
          const double g = c < 3 ? shape.b(c, i) : shape.gamma(c - 3, i);
          add(g, of.x, change.of[0][c]), add(g, of.y, change.of[1][c]), add(g, of.z, change.of[2][c]);
        }
      }
      add_elastic(shape, at, change, p);
      for (auto& row : p.of)
        for (L& part : row) part *= c_k;
      if (!m.is_viscous()) {
        scatter(cell, shape, p, k_y);
        continue;
      }
      if (k_y != d_y) {
        scatter(cell, shape, p, k_y);
        p = {};
      }
      add_viscous(m, c_d, shape, at, change, p);
      scatter(cell, shape, p, d_y);
    }
  }

 private:
  PALPATE_INLINE static void add(double a, const double (&of)[kColumnLanes], L& to) {
    add_product(a, lanes(of), reinterpret_cast<FourDoubles&>(to));
  }
  PALPATE_INLINE static void add(double a, const L& of, L& to) {
    add_product(a, reinterpret_cast<const FourDoubles&>(of), reinterpret_cast<FourDoubles&>(to));
  }

  PALPATE_INLINE static void add_elastic(const Shape& shape, const ElementTangent<Shape>& at, const Gradient& change,
                                         Gradient& p) {
#pragma GCC unroll 9
    for (int i = 0; i < 9; ++i) {
      L sum = p.of[i / 3][i % 3];
#pragma GCC unroll 9
      for (int k = 0; k < 9; ++k) add(at.elastic[tangent_index(std::min(i, k), std::max(i, k))], change.of[k / 3][k % 3], sum);
      p.of[i / 3][i % 3] = sum;
    }
    for (int a = 0; a < Shape::kModes; ++a)
      for (int r = 0; r < 3; ++r) p.of[r][3 + a] += shape.k[static_cast<std::size_t>(a)] * change.of[r][3 + a];
  }

  PALPATE_INLINE static void add_viscous(const ElementMaterial& m, double c_d, const Shape& shape,
                                         const ElementTangent<Shape>& at, const Gradient& change, Gradient& p) {
    // add_generalised_viscous_stress() in fused multiply-adds
    const double viscous = c_d * m.damping_s, mu = viscous * shape.volume_m3 * m.mu,
                 lambda = viscous * shape.volume_m3 * m.lambda;
    const auto& f = at.gradient;
    L strain[3][3] = {};  // F^T dF, then its second Piola-Kirchhoff stress
    for (int k = 0; k < 3; ++k)
      for (int s = 0; s < 3; ++s)
        for (int r = 0; r < 3; ++r) add(f[r][k], change.of[r][s], strain[k][s]);
    const L volume = lambda * (strain[0][0] + strain[1][1] + strain[2][2]);
    for (int k = 0; k < 3; ++k)
      for (int s = 0; s < 3; ++s) {
        const L stress = mu * (strain[k][s] + strain[s][k]) + (k == s ? volume : L{});
        for (int r = 0; r < 3; ++r) add(f[r][k], stress, p.of[r][s]);
      }
    for (int a = 3; a < Shape::kColumns; ++a)
      for (int k = 0; k < 3; ++k) {
        L push{};  // of F^T q
        for (int r = 0; r < 3; ++r) add(f[r][a], change.of[r][k], push), add(f[r][k], change.of[r][a], push);
        push *= viscous * shape.k[static_cast<std::size_t>(a - 3)];
        for (int r = 0; r < 3; ++r) add(f[r][a], push, p.of[r][k]), add(f[r][k], push, p.of[r][a]);
      }
  }

  PALPATE_INLINE static void scatter(const ElementCell<Shape>& cell, const Shape& shape, const Gradient& p, NodeLanes* to) {
    for (int i = 0; i < Shape::kNodes; ++i) {
      NodeLanes& of = to[cell.nodes[static_cast<std::size_t>(i)]];
      for (int c = 0; c < Shape::kColumns; ++c) {
        const double g = c < 3 ? shape.b(c, i) : shape.gamma(c - 3, i);
        add_product(g, reinterpret_cast<const FourDoubles&>(p.of[0][c]), reinterpret_cast<FourDoubles&>(of.x));
        add_product(g, reinterpret_cast<const FourDoubles&>(p.of[1][c]), reinterpret_cast<FourDoubles&>(of.y));
        add_product(g, reinterpret_cast<const FourDoubles&>(p.of[2][c]), reinterpret_cast<FourDoubles&>(of.z));
      }
    }
  }
};

template <>
struct ProductLoop<TrussShape> {
  template <std::size_t N>
  PALPATE_INLINE static void run(const ElementProducts<TrussShape>& elements, const NodeLanes* y, double c_k, double c_d,
                                 NodeLanes* k_y, NodeLanes* d_y) {
    const double spatial = elements.materials[0].planar ? 0 : 1;
    const bool together = k_y == d_y;
    for (std::size_t e = 0;
         e < elements.cells.size();) {  // as in scatter(), the products of one node are summed before they are stored
      const std::uint32_t a = elements.cells[e].nodes[0];
      const ColumnLanes own[3] = {lanes(y[a].x), lanes(y[a].y), lanes(y[a].z)};
      ColumnLanes k_sum[3] = {}, d_sum[3] = {};
      for (; e < elements.cells.size() && elements.cells[e].nodes[0] == a; ++e) {
        const std::uint32_t b = elements.cells[e].nodes[1];
        const ElementTangent<TrussShape>& at = elements.tangents[e];
        const double across = c_k * at.across_n_m, damper = c_d * at.damping_n_s_m,
                     along = c_k * at.slope_n_m - across + (together ? damper : 0);
        const ColumnLanes u[3] = {own[0] - lanes(y[b].x), own[1] - lanes(y[b].y), spatial * (own[2] - lanes(y[b].z))};
        ColumnLanes stretch{}, f[3];
        for (int r = 0; r < 3; ++r) add_product(at.direction[r], u[r], stretch);
        const ColumnLanes pull = along * stretch;
        for (int r = 0; r < 3; ++r) {
          f[r] = across * u[r];
          add_product(at.direction[r], pull, f[r]);
        }
        move(f, k_y[b], k_sum);
        if (together) continue;
        stretch *= damper;
        for (int r = 0; r < 3; ++r) f[r] = at.direction[r] * stretch;
        move(f, d_y[b], d_sum);
      }
      lanes(k_y[a].x) += k_sum[0], lanes(k_y[a].y) += k_sum[1], lanes(k_y[a].z) += k_sum[2];
      if (!together) lanes(d_y[a].x) += d_sum[0], lanes(d_y[a].y) += d_sum[1], lanes(d_y[a].z) += d_sum[2];
    }
  }

 private:
  PALPATE_INLINE static void move(const ColumnLanes (&f)[3], NodeLanes& from, ColumnLanes (&sum)[3]) {
    lanes(from.x) -= f[0], lanes(from.y) -= f[1], lanes(from.z) -= f[2];
    for (int r = 0; r < 3; ++r) sum[r] += f[r];
  }
};

template <class Shape, class Loop, typename... Arguments>
void put_variants(void (*ElementLoops<Shape>::*member)(Arguments...), std::vector<ElementLoops<Shape>>& loops) {
  const auto variants = Variants<Loop>::template all<Arguments...>();
  loops.resize(variants.size());
  for (std::size_t k = 0; k < variants.size(); ++k) {
    loops[k].width = variants[k].width;
    loops[k].*member = variants[k].run;
  }
}

}  // namespace

template <class Shape>
std::vector<EightNumbers> ShapeNumbers<Shape>::of(std::span<const Shape* const> shapes) {
  std::vector<EightNumbers> numbers(kSize, EightNumbers{});
  for (std::size_t l = 0; l < shapes.size(); ++l) {
    const SharedNumbers<2, Shape> shape{*shapes[l]};
    numbers[0].of[l] = shape.volume();
    for (int a = 0; a < Shape::kModes; ++a) numbers[kModesAt + static_cast<std::size_t>(a)].of[l] = shape.k(a);
    for (int i = 0; i < Shape::kNodes; ++i)
      for (int c = 0; c < Shape::kColumns; ++c)
        numbers[gradient_at(static_cast<std::size_t>(i), static_cast<std::size_t>(c))].of[l] = shape.g(i, c);
  }
  return numbers;
}

std::vector<EightNumbers> ShapeNumbers<TrussShape>::of(std::span<const TrussShape* const> shapes) {
  std::vector<EightNumbers> numbers(3, EightNumbers{});
  for (std::size_t l = 0; l < shapes.size(); ++l) {
    numbers[0].of[l] = shapes[l]->stiffness_n_m;
    numbers[1].of[l] = shapes[l]->rest_length_m;
    numbers[2].of[l] = shapes[l]->damping_n_s_m;
  }
  return numbers;
}

template <class Shape>
std::span<const ElementLoops<Shape>> element_loops() {
  static const std::vector<ElementLoops<Shape>> loops = [] {
    std::vector<ElementLoops<Shape>> all;
    put_variants<Shape, ForceLoop<Shape>>(&ElementLoops<Shape>::add_forces, all);
    put_variants<Shape, BlockLoop<Shape>>(&ElementLoops<Shape>::blocks, all);
    put_variants<Shape, LinearisationLoop<Shape>>(&ElementLoops<Shape>::tangents, all);
    put_variants<Shape, ProductLoop<Shape>>(&ElementLoops<Shape>::add_products, all);
    return all;
  }();
  return loops;
}

template struct ShapeNumbers<TetraShape>;
template struct ShapeNumbers<HexaShape>;
template std::span<const ElementLoops<TrussShape>> element_loops();
template std::span<const ElementLoops<TetraShape>> element_loops();
template std::span<const ElementLoops<HexaShape>> element_loops();

}  // namespace palpate
