#include "bench/tissue/closed_forms.hpp"

#include <cmath>
#include <functional>
#include <numbers>
#include <stdexcept>

namespace palpate {
namespace {

using std::numbers::pi;

/// Zero of an increasing function between two bounds.
double zero_of(const std::function<double(double)>& f, double low, double high) {
  constexpr int kHalvings = 100;
  for (int k = 0; k < kHalvings; ++k) (f((low + high) / 2) < 0 ? low : high) = (low + high) / 2;
  return (low + high) / 2;
}

constexpr double kThinnest = 0.4, kThickest = 2.2;  // range of lateral stretches

/// Radii of all shells of a sphere.
class RadialSphere {
 public:
  RadialSphere(const SolidMaterial& material, double inner_m, double outer_m) : material_(material) {
    for (int i = 0; i <= kPieces; ++i) rest_.push_back(inner_m + (outer_m - inner_m) * i / kPieces);
    r_ = rest_;
  }

  void move_inside(double to_m) {
    r_[0] = to_m;
    for (int k = 0; k < kNewtonMax; ++k)
      if (newton_step() < kStill * to_m) return;
    throw std::runtime_error("a thick sphere finds no equilibrium");
  }

  double pressure() const { return -pull(0)[0] / (4 * pi * r_[0] * r_[0]); }

 private:
  static constexpr int kPieces = 400, kNewtonMax = 60;
  static constexpr double kStill = 1e-11;

  /// -dE/dr at both ends of a piece.
  std::array<double, 2> pull(std::size_t piece) const { return pull(piece, r_[piece], r_[piece + 1]); }
  std::array<double, 2> pull(std::size_t piece, double r0, double r1) const {
    const double length = rest_[piece + 1] - rest_[piece], middle = (rest_[piece] + rest_[piece + 1]) / 2;
    const double along = (r1 - r0) / length, around = (r0 + r1) / 2 / middle, weight = 4 * pi * middle * middle * length;
    const Vec3 p = principal_stress(material_, {along, around, around});
    const double by_slope = weight * p[0] / length, by_mean = weight * (p[1] + p[2]) / (2 * middle);
    return {by_slope - by_mean, -by_slope - by_mean};
  }

  /// Solves by Thomas' algorithm over the free shells; returns the largest change.
  double newton_step() {
    const std::size_t n = r_.size() - 1;
    std::vector<double> below(n + 1, 0), on(n + 1, 0), above(n + 1, 0), right(n + 1, 0);
    for (std::size_t e = 0; e < n; ++e) {
      const double step = 1e-7 * rest_[e];
      const auto f = pull(e);
      for (std::size_t k = 0; k < 2; ++k) right[e + k] += f[k];
      for (std::size_t j = 0; j < 2; ++j) {
        const double d0 = j == 0 ? step : 0, d1 = j == 1 ? step : 0;
        const auto up = pull(e, r_[e] + d0, r_[e + 1] + d1), down = pull(e, r_[e] - d0, r_[e + 1] - d1);
        for (std::size_t i = 0; i < 2; ++i) {
          const double k = -(up[i] - down[i]) / (2 * step);
          (i == j ? on[e + i] : i > j ? below[e + 1] : above[e]) += k;
        }
      }
    }
    std::vector<double> change(n + 2, 0);
    for (std::size_t i = 2; i <= n; ++i) {
      const double much = below[i] / on[i - 1];
      on[i] -= much * above[i - 1];
      right[i] -= much * right[i - 1];
    }
    double most = 0;
    for (std::size_t i = n; i >= 1; --i) {
      change[i] = (right[i] - above[i] * change[i + 1]) / on[i];
      most = std::max(most, std::abs(change[i]));
    }
    // Shells must keep their order.
    const double share = std::min(1.0, 0.3 * (rest_[1] - rest_[0]) / std::max(most, 1e-300) * static_cast<double>(n));
    for (std::size_t i = 1; i <= n; ++i) r_[i] += share * change[i];
    return most;
  }

  SolidMaterial material_;
  std::vector<double> rest_, r_;
};

}  // namespace

double uniaxial_stress(const SolidMaterial& material, double stretch) {
  const double m = zero_of(
      [&](double side) {
        return principal_stress(material, {stretch, side, side})[1];
      },
      kThinnest, kThickest);
  return principal_stress(material, {stretch, m, m})[0];
}

double equibiaxial_stress(const SolidMaterial& material, double stretch) {
  const double m = zero_of(
      [&](double side) {
        return principal_stress(material, {stretch, stretch, side})[2];
      },
      kThinnest, kThickest);
  return principal_stress(material, {stretch, stretch, m})[0];
}

Mat3 simple_shear_stress(const SolidMaterial& material, double shear) {
  Mat3 f = Mat3::Identity();
  f(0, 1) = shear;
  return stress_at(material, f);
}

TorsionAnswer torsion_of_cylinder(const SolidMaterial& material, double radius_m, double turn_1_m) {
  constexpr int kPieces = 2000;  // intervals of Simpson's rule
  const double h = radius_m / kPieces;
  const auto at = [&](double r) { return energy_by_first_invariant(material, 3 + std::pow(turn_1_m * r, 2)) * r * r * r; };
  double sum = 0;
  for (int k = 0; k < kPieces; k += 2) sum += h / 3 * (at(k * h) + 4 * at((k + 1) * h) + at((k + 2) * h));
  return {4 * pi * turn_1_m * sum, -2 * pi * turn_1_m * turn_1_m * sum};
}

double lame_sphere_pressure(const SolidMaterial& material, double inner_m, double outer_m, double moved_m) {
  const Lame lame(material);
  const double three_bulk = 3 * lame.lambda + 2 * lame.mu, a3 = std::pow(inner_m, 3), b3 = std::pow(outer_m, 3);
  const double b = moved_m / (4 * lame.mu / (three_bulk * b3) * inner_m + 1 / (inner_m * inner_m));
  return 4 * lame.mu * b * (1 / a3 - 1 / b3);
}

double sphere_pressure(const SolidMaterial& material, double inner_m, double outer_m, double moved_m) {
  constexpr int kShares = 20;
  RadialSphere sphere(material, inner_m, outer_m);
  for (int k = 1; k <= kShares; ++k) sphere.move_inside(inner_m + moved_m * k / kShares);
  return sphere.pressure();
}

}  // namespace palpate
