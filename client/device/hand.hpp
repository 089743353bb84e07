// The hand that holds a simulated device: a mass, damper and spring between the tool and its intended position, and the
// involuntary tremor.
//
// The four presets span the published range: arm and hand at an endpoint 0.55 kg, 6.5 N s/m, 135 N/m (Sci. Rep. 2015, srep18004);
// light pen grips and firm grips around it. "free" means that nothing holds the device. Damping ratios 0.32, 0.37, 0.22. Tremor:
// 8-12 Hz, with the power of a sine of 0.1 mm (50-200 um rms is typical).
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "common/base/types.hpp"

namespace palpate {

struct Hand {
  double mass_kg = 0, damping_n_s_m = 0, stiffness_n_m = 0;
  bool holds() const { return mass_kg > 0 || damping_n_s_m > 0 || stiffness_n_m > 0; }
};

/// Returns the preset "free", "light", "reference" or "firm"; empty for another name.
std::optional<Hand> hand_from_name(std::string_view name);

/// Tremor of one hand: per axis a sum of sines whose frequencies (8-12 Hz) and phases are drawn from the seed, together with the
/// power of one sine of `amplitude_m`. It grows from zero over the first half second so that a motion starts at rest.
class Tremor {
 public:
  Tremor(double amplitude_m, std::uint64_t seed);
  Vec3 offset(double t_s) const noexcept;

 private:
  static constexpr int kSines = 6;
  struct Sine {
    double omega_rad_s = 0, phase_rad = 0;
  };
  double amplitude_m_;
  std::array<std::array<Sine, kSines>, 3> axes_;
};

}  // namespace palpate
