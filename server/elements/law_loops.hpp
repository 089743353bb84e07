// Stress and tangent of a law of elasticity in lanes, compiled once for each width (lane_variants.hpp).
#pragma once

#include "common/mechanics/laws.hpp"
#include "server/elements/lane_variants.hpp"

namespace palpate {

/// Adds the law's stress at H = F - 1, its moduli times those given.
struct StressLoop {
  template <std::size_t N>
  PALPATE_INLINE static void run(const Elasticity& law, const LaneModuli<Lanes<double, N>>& moduli,
                                 const LaneMatrix<Lanes<double, N>>& h, LaneMatrix<Lanes<double, N>>& p) {
    law.add_stress(moduli, h, p);
  }
};

/// Replaces the negative eigenvalues of a symmetric matrix (common/mechanics/tangent.hpp) by zero.
void drop_negative_eigenvalues(double (&tangent)[45]);

/// Computes the law's tangent at H = F - 1. With `clamp` lanes that are not positive semi-definite lose their negative
/// eigenvalues: those with a pivot of L D L^T below kRounding times the trace.
struct TangentLoop {
  template <std::size_t N>
  PALPATE_INLINE static void run(const Elasticity& law, const LaneModuli<Lanes<double, N>>& moduli,
                                 const LaneMatrix<Lanes<double, N>>& h, bool clamp, Tangent<Lanes<double, N>>& a) {
    a.clear();
    law.add_tangent(moduli, h, a);
    if (clamp) project(a);
  }

 private:
  template <typename L>
  PALPATE_INLINE static void project(Tangent<L>& a) {
    constexpr double kRounding = 1e-10;
    Tangent<L> left = a;
    L trace{};
    for (int i = 0; i < 9; ++i) trace += a.at(i, i);
    left.add_identity(kRounding * trace);
    LaneTruths<L> definite = trace > 0.0;
    for (int k = 0; k < 9; ++k) {
      const L pivot = left.at(k, k);
      definite &= pivot > 0.0;
      for (int i = k + 1; i < 9; ++i) {
        const L share = left.at(k, i) / pivot;
        for (int n = i; n < 9; ++n) left.at(i, n) -= share * left.at(k, n);
      }
    }
    for (std::size_t l = 0; l < kLanes<L>; ++l) {
      if (definite[l]) continue;
      double lane[45];
      for (int n = 0; n < 45; ++n) lane[n] = a.of[n][l];
      drop_negative_eigenvalues(lane);
      for (int n = 0; n < 45; ++n) a.of[n][l] = lane[n];
    }
  }
};

}  // namespace palpate
