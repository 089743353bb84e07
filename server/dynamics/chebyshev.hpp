// A stabilised explicit method of second order, Runge-Kutta-Chebyshev: s evaluations per step, stable over an interval that grows
// as s^2.
//
// One step of y' = F(t, y) from y_0 over h; d_j = Y_j - y_0 is the increment of stage j:
//
//     d_0 = 0,   d_1 = mu~_1 h F_0
//     d_j = mu_j d_(j-1) + nu_j d_(j-2) + mu~_j h F(t + c_(j-1) h, y_0 + d_(j-1)) + gamma~_j h F_0,    j = 2 ... s
//
// For y' = lambda y a step gives P(h lambda) y, with P a Chebyshev polynomial stretched over the negative real axis: |P| stays
// below 1 - kDamped / 3 down to about -0.65 s^2, where s Euler steps reach -2 s. Coefficients: w_0 = 1 + kDamped / s^2,
// w_1 = T_s'(w_0) / T_s''(w_0), b_j = T_j''(w_0) / T_j'(w_0)^2, b_0 = b_1 = b_2,
//
//     mu_j = 2 b_j w_0 / b_(j-1),   nu_j = -b_j / b_(j-2),   mu~_j = 2 b_j w_1 / b_(j-1),   mu~_1 = b_1 w_1,
//     gamma~_j = -(1 - b_(j-1) T_(j-1)(w_0)) mu~_j
//
// Source: Verwer, Hundsdorfer, Sommeijer, Convergence properties of the Runge-Kutta-Chebyshev method, Numer. Math. 57 (1990);
// Sommeijer, Shampine, Verwer, RKC: an explicit solver for parabolic PDEs, J. Comput. Appl. Math. 88 (1998). The variant with
// Legendre polynomials (Meyer, Balsara, Aslam 2014) needs a tenth more stages for the same bodies.
//
// A body is not a parabolic equation: slow modes of x'' = -w^2 x - r w^2 x' oscillate. Their eigenvalues lie on a circle through
// 0 of radius 1 / r around -1 / r, those of fast modes on the negative axis. P is stable on the circle up to about h = 2.4 r, and
// not on the imaginary axis: the method does not suit a body without dampers.
#pragma once

#include <complex>
#include <vector>

#include "server/body/spectrum.hpp"

namespace palpate {

struct Chebyshev {
  static constexpr double kDamped = 2.0 / 13;
  struct Stage {
    double mu = 0, nu = 0, mu_t = 0, gamma_t = 0;
    double c = 0;  ///< time of the stage is t + c h
  };
  std::vector<Stage> stages;  ///< s stages; the first uses only mu~

  /// Requires s >= 2.
  explicit Chebyshev(int s);
  /// Returns P(z).
  std::complex<double> grow(std::complex<double> z) const;
  /// Returns true if no mode of such a body grows in steps of `h` [s].
  bool is_stable(const Spectrum& spectrum, double h) const;
};

}  // namespace palpate
