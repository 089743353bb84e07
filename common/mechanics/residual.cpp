#include "common/mechanics/residual.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "common/mechanics/polar.hpp"

namespace palpate {
namespace {

constexpr std::size_t kWidth = 4;  // a matrix of two registers an entry would not fit into the registers of AVX2
using L = Lanes<double, kWidth>;
using Narrow = float __attribute__((vector_size(kWidth * sizeof(float))));
constexpr std::size_t kElements = ElementLinearisation::kElements;
using Numbers = std::array<double, kElements>;
using Lane = ElementLinearisation::Lane;

/// Reads the numbers of all elements from `first` on.
struct EachElement {
  std::size_t first;
  template <typename Number, typename To>
  PALPATE_INLINE void operator()(const std::array<Number, kElements>& from, To& to) const {
    load_lanes<To>(from.data() + first, to);
  }
};
/// Reads those of one element into all lanes.
struct OneElement {
  std::size_t element;
  template <typename Number, typename To>
  PALPATE_INLINE void operator()(const std::array<Number, kElements>& from, To& to) const {
    to = To{} + from[element];
  }
};

/// Half of the lanes as doubles, and both halves as floats.
template <int kHalf>
PALPATE_INLINE void widen(const Lane& from, L& to) {
  const Narrow half = __builtin_shufflevector(from, from, 4 * kHalf, 4 * kHalf + 1, 4 * kHalf + 2, 4 * kHalf + 3);
  to = __builtin_convertvector(half, L);
}
PALPATE_INLINE void narrow(const L& low, const L& high, Lane& to) {
  const Narrow first = __builtin_convertvector(low, Narrow), last = __builtin_convertvector(high, Narrow);
  to = __builtin_shufflevector(first, last, 0, 1, 2, 3, 4, 5, 6, 7);
}

/// Subtracts A dF.
template <typename Read>
PALPATE_INLINE void subtract_linear(const std::array<std::array<float, kElements>, 45>& a, const Read& read, const Lane (&df)[9],
                                    Lane (&q)[9]) {
  std::size_t entry = 0;
#pragma GCC unroll 9
  for (int i = 0; i < 9; ++i) {
#pragma GCC unroll 9
    for (int k = i; k < 9; ++k, ++entry) {
      Lane number;
      read(a[entry], number);
      q[i] -= number * df[k];
      if (k != i) q[k] -= number * df[i];
    }
  }
}

struct View {
  const Elasticity& law;
  const Numbers &mu, &lambda;
  const std::array<Numbers, 9>&h, &p;
  const std::array<std::array<float, kElements>, 45>& a;
};

/// Computes P at H. One function for all that need it, as it contains every law.
[[gnu::noinline]] void stress_at(const Elasticity& law, const LaneModuli<L>& m, const LaneMatrix<L>& h, LaneMatrix<L>& p) {
  p = {};
  law.add_stress(m, h, p);
}

/// Computes P(H + dH) - P(H) in half of the lanes.
template <int kHalf, typename Read>
PALPATE_INLINE void stress_change(const View& at, const Read& read, const Lane (&df)[9], L (&change)[9]) {
  LaneModuli<L> m;
  LaneMatrix<L> h, p;
  read(at.mu, m.mu);
  read(at.lambda, m.lambda);
  for (std::size_t k = 0; k < 9; ++k) {
    L& to = h.of[k / 3][k % 3];
    read(at.h[k], to);
    widen<kHalf>(df[k], change[k]);
    to += change[k];
  }
  stress_at(at.law, m, h, p);
  for (std::size_t k = 0; k < 9; ++k) {
    read(at.p[k], change[k]);
    change[k] = p.of[k / 3][k % 3] - change[k];
  }
}

/// Computes Q in all lanes; `low` and `high` read the numbers from either half of the lanes on.
template <typename Read>
PALPATE_INLINE void residual(const View& at, const Read& low, const Read& high, const Lane (&df)[9], Lane (&q)[9]) {
  L first[9], last[9];
  stress_change<0>(at, low, df, first);
  stress_change<1>(at, high, df, last);
  for (int k = 0; k < 9; ++k) narrow(first[k], last[k], q[k]);
  subtract_linear(at.a, low, df, q);
}

}  // namespace

void ElementLinearisation::set(std::size_t element, const Eigen::Matrix3d& f, double mu, double lambda) {
  assert(element < kElements);
  mu_[element] = mu;
  lambda_[element] = lambda;
  for (int k = 0; k < 9; ++k) h_[static_cast<std::size_t>(k)][element] = f(k / 3, k % 3) - (k % 4 == 0 ? 1 : 0);
}

void ElementLinearisation::linearise() {
  for (std::size_t first = 0; first < kElements; first += kWidth) {
    const EachElement read{first};
    LaneModuli<L> m;
    LaneMatrix<L> h, p;
    Tangent<L> a;
    L psi;
    read(mu_, m.mu);
    read(lambda_, m.lambda);
    for (std::size_t k = 0; k < 9; ++k) read(h_[k], h.of[k / 3][k % 3]);
    a.clear();
    stress_at(law_, m, h, p);
    law_.add_tangent(m, h, a);
    law_.energy(m, h, psi);
    for (std::size_t k = 0; k < 9; ++k) store_lanes(p.of[k / 3][k % 3], p_[k].data() + first);
    for (std::size_t k = 0; k < a_.size(); ++k)
      for (std::size_t l = 0; l < kWidth; ++l) a_[k][first + l] = static_cast<float>(a.of[k][l]);
    store_lanes(psi, psi_.data() + first);
  }
}

double ElementLinearisation::deviatoric_bound(std::size_t element) const {
  Eigen::Matrix3d f;
  for (int k = 0; k < 9; ++k) f(k / 3, k % 3) = h_[static_cast<std::size_t>(k)][element] + (k % 4 == 0 ? 1 : 0);
  const Eigen::Matrix3d g = cofactors(f);
  double bound = 0;
  for (int i = 0; i < 9; ++i) {
    double sum = 0;
    for (int k = 0; k < 9; ++k) {
      const auto entry = static_cast<std::size_t>(tangent_index(std::min(i, k), std::max(i, k)));
      sum += std::abs(static_cast<double>(a_[entry][element]) - lambda_[element] * g(i / 3, i % 3) * g(k / 3, k % 3));
    }
    bound = std::max(bound, sum);
  }
  return bound;
}

void ElementLinearisation::stress(const Lane (&df)[9], Lane (&q)[9]) const noexcept {
  residual({law_, mu_, lambda_, h_, p_, a_}, EachElement{0}, EachElement{kWidth}, df, q);
}

void ElementLinearisation::stresses(std::size_t element, std::size_t count, const float* df, float* q) const noexcept {
  assert(element < kElements && count % kElements == 0);
  for (std::size_t first = 0; first < count; first += kElements) {
    Lane change[9], stress[9];
    for (std::size_t k = 0; k < 9; ++k) load_lanes(df + k * count + first, change[k]);
    residual({law_, mu_, lambda_, h_, p_, a_}, OneElement{element}, OneElement{element}, change, stress);
    for (std::size_t k = 0; k < 9; ++k) store_lanes(stress[k], q + k * count + first);
  }
}

double ElementLinearisation::energy(const Lane (&df)[9]) const noexcept {
  double sum = 0;
  for (std::size_t element = 0; element < kElements; ++element) {
    LaneModuli<L> m{L{} + mu_[element], L{} + lambda_[element]};
    LaneMatrix<L> h;
    std::array<double, 9> way;
    for (std::size_t k = 0; k < 9; ++k) {
      way[k] = static_cast<double>(df[k][element]);
      h.of[k / 3][k % 3] = L{} + (h_[k][element] + way[k]);
    }
    L there;
    law_.energy(m, h, there);
    sum += there[0] - psi_[element];
    std::size_t entry = 0;
    for (std::size_t i = 0; i < 9; ++i) {
      sum -= p_[i][element] * way[i];
      for (std::size_t k = i; k < 9; ++k)
        sum -= (k == i ? 0.5 : 1.0) * static_cast<double>(a_[entry++][element]) * way[i] * way[k];
    }
  }
  return sum;
}

}  // namespace palpate
