#include "client/device/hand.hpp"

#include <cmath>
#include <numbers>

namespace palpate {

namespace {

constexpr double kTremorLowHz = 8, kTremorHighHz = 12, kTremorOnsetS = 0.5;

/// splitmix64: the same draws on every machine and library, unlike std's distributions.
class Draws {
 public:
  explicit Draws(std::uint64_t seed) : state_(seed) {}
  double uniform() {
    std::uint64_t z = (state_ += 0x9e3779b97f4a7c15ULL);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
    return static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1p-53;
  }

 private:
  std::uint64_t state_;
};

}  // namespace

std::optional<Hand> hand_from_name(std::string_view name) {
  if (name == "free") return Hand{0, 0, 0};
  if (name == "light") return Hand{0.1, 2, 100};
  if (name == "reference") return Hand{0.5, 6, 135};
  if (name == "firm") return Hand{1, 10, 500};
  return std::nullopt;
}

Tremor::Tremor(double amplitude_m, std::uint64_t seed) : amplitude_m_(amplitude_m / std::sqrt(3.0 * kSines)) {
  Draws draws(seed);
  for (auto& axis : axes_)
    for (Sine& sine : axis) {
      sine.omega_rad_s = 2 * std::numbers::pi * (kTremorLowHz + (kTremorHighHz - kTremorLowHz) * draws.uniform());
      sine.phase_rad = 2 * std::numbers::pi * draws.uniform();
    }
}

Vec3 Tremor::offset(double t_s) const noexcept {
  if (amplitude_m_ == 0 || t_s <= 0) return Vec3::Zero();
  const double onset = t_s < kTremorOnsetS ? 0.5 - 0.5 * std::cos(std::numbers::pi * t_s / kTremorOnsetS) : 1.0;
  Vec3 sum = Vec3::Zero();
  for (int axis = 0; axis < 3; ++axis)
    for (const Sine& sine : axes_[static_cast<std::size_t>(axis)]) sum[axis] += std::sin(sine.omega_rad_s * t_s + sine.phase_rad);
  return amplitude_m_ * onset * sum;
}

}  // namespace palpate
