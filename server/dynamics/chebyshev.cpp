#include "server/dynamics/chebyshev.hpp"

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

/// T_j and its derivatives at one argument.
struct Polynomials {
  std::vector<double> value{1}, slope{0}, bend{0};
  Polynomials(int s, double at) {
    value.push_back(at);
    slope.push_back(1);
    bend.push_back(0);
    for (std::size_t j = 2; j <= static_cast<std::size_t>(s); ++j) {
      value.push_back(2 * at * value[j - 1] - value[j - 2]);
      slope.push_back(2 * value[j - 1] + 2 * at * slope[j - 1] - slope[j - 2]);
      bend.push_back(4 * slope[j - 1] + 2 * at * bend[j - 1] - bend[j - 2]);
    }
  }
};

}  // namespace

Chebyshev::Chebyshev(int s) {
  const auto last = static_cast<std::size_t>(s);
  const double w_0 = 1 + kDamped / (s * s);
  const Polynomials t(s, w_0);
  const double w_1 = t.slope[last] / t.bend[last];
  std::vector<double> b(last + 1);
  for (std::size_t j = 2; j <= last; ++j) b[j] = t.bend[j] / (t.slope[j] * t.slope[j]);
  b[0] = b[1] = b[2];
  stages.push_back({0, 0, b[1] * w_1, 0, b[1] * w_1});
  for (std::size_t j = 2; j <= last; ++j) {
    Stage stage{2 * b[j] * w_0 / b[j - 1], -b[j] / b[j - 2], 2 * b[j] * w_1 / b[j - 1], 0, 0};
    stage.gamma_t = -(1 - b[j - 1] * t.value[j - 1]) * stage.mu_t;
    stage.c = stage.mu * stages[j - 2].c + (j > 2 ? stage.nu * stages[j - 3].c : 0) + stage.mu_t + stage.gamma_t;
    stages.push_back(stage);
  }
}

std::complex<double> Chebyshev::grow(std::complex<double> z) const {
  std::complex<double> before = 0, d = 0;
  for (const Stage& c : stages) {
    const std::complex<double> next = c.mu * d + c.nu * before + z * (c.mu_t * (1.0 + d) + c.gamma_t);
    before = d;
    d = next;
  }
  return 1.0 + d;
}

/// Checks both eigenvalues of each mode where they are real; else they are conjugate, and one is enough.
bool Chebyshev::is_stable(const Spectrum& spectrum, double h) const {
  constexpr int kRatios = 3, kModes = 200;
  constexpr double kSlowest = 1e-6, kRounding = 1e-9;  // relative to w^2
  const auto grows = [&](const std::complex<double>& value) { return !(std::norm(grow(h * value)) <= 1 + 2 * kRounding); };
  for (int i = 0; i < kRatios; ++i) {
    const double ratio_s = spectrum.least_s * std::pow(spectrum.most_s / spectrum.least_s, i / (kRatios - 1.0));
    for (int k = 0; k < kModes; ++k) {
      const double w2 = spectrum.w2 * std::pow(kSlowest, k / (kModes - 1.0)), g = std::min(ratio_s * w2, spectrum.g);
      const std::complex<double> root = std::sqrt(std::complex<double>(g * g / 4 - w2));
      if (grows(-g / 2 + root) || (root.imag() == 0 && grows(-g / 2 - root))) return false;
    }
  }
  return true;
}

}  // namespace palpate
