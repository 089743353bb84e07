#include "bench/paper/response.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace palpate {

std::vector<double> log_frequencies(double from_hz, double to_hz, int per_decade) {
  const double decades = std::log10(to_hz / from_hz);
  const int steps = std::max(1, static_cast<int>(std::ceil(decades * per_decade - 1e-9)));
  std::vector<double> f(static_cast<std::size_t>(steps) + 1);
  for (int i = 0; i <= steps; ++i) f[static_cast<std::size_t>(i)] = from_hz * std::pow(10.0, decades * i / steps);
  f.back() = to_hz;
  return f;
}

Response sample(const Transfer& transfer, std::span<const double> frequencies_hz) {
  Response r{{frequencies_hz.begin(), frequencies_hz.end()}, {}};
  r.value.reserve(frequencies_hz.size());
  for (const double f : frequencies_hz) r.value.push_back(transfer(Complex(0, 2 * std::numbers::pi * f)));
  return r;
}

std::vector<double> relative_error(const Response& small, const Response& full) {
  std::vector<double> error(full.value.size());
  for (std::size_t i = 0; i < error.size(); ++i)
    error[i] = largest_singular_value(small.value[i] - full.value[i]) / largest_singular_value(full.value[i]);
  return error;
}

double worst_in_band(std::span<const double> frequencies_hz, std::span<const double> error, double from_hz, double to_hz) {
  constexpr double kRounding = 1e-9;
  double worst = 0;
  for (std::size_t i = 0; i < error.size(); ++i)
    if (frequencies_hz[i] >= from_hz * (1 - kRounding) && frequencies_hz[i] <= to_hz * (1 + kRounding))
      worst = std::max(worst, error[i]);
  return worst;
}

}  // namespace palpate
