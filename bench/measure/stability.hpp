// Decides whether a loop of hand, device and display keeps itself moving.
//
// At rest. Nothing drives the loop: the hand has let go, or stands still. The motion from then on is cut into windows of 0.3 s.
// Each window has p, the peak-to-peak motion (the diagonal of the box that the tool stays in), and T, the highest kinetic energy.
// With the first two windows as `head`, the last two as `tail` and those between a third of the time and the tail as `mid`,
//
//     it dies out:        p_tail <= max(p_head / 4, kStillM)   and   T_tail <= max(T_head / 16, kStillJ)
//     and keeps falling:  p_tail <= max(p_mid 3/4, kStillM)    and   T_tail <= max(T_mid 9/16, kStillJ)
//
// (p and T are equivalent in a pure oscillation, as energy grows with the square of motion). A limit cycle is not stable, however
// small compared with the blow that began it, nor is an oscillation that needs more than the observed time to fall to a quarter.
// The rate at which the motion dies out is the least-squares slope of ln p over time, without windows below kStillM.
//
// Driven. Motion that the hand's slow motion does not explain is the shake s = x - mean of x over +-50 ms. Its size is the
// highest peak-to-peak motion within +-50 ms, and the highest speed. A display that shakes a driven hand is not stable:
//
//     p_s <= max(2 p_s of the reference, p of the reference / 4)   and the same for speeds
//
// A tool that turns is judged by three points, the tool point and two kLeverM from it along its axes x and z: the largest of each
// figure counts.
//
// The reference is the same hand on the full model at 1 kHz (reference_loop). No scheme has to calm a motion that the reference
// does not calm within the observed time: twice its tail (four times its energy) is also allowed at rest.
#pragma once

#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "bench/measure/closed_loop.hpp"

namespace palpate {

inline constexpr double kWindowS = 0.3;
/// Each frame answers a reading that is a step of q = 0.03 mm off on any axis, whichever way it was rounded: a tool at rest stays
/// within a box of two steps per side, whose diagonal is 2 sqrt(3) q = 0.104 mm.
inline constexpr double kStillM = 1.2e-4;
inline constexpr double kLeverM = 0.05;
inline constexpr double kStillJ = 1.4e-7;  ///< energy of 75 g in an oscillation of kStillM, peak to peak, at 5 Hz

struct StabilityVerdict {
  bool stable = false;
  std::vector<double> peak_to_peak_m;  ///< the successive whole windows; at least one, cut short if the tool was lost
  std::vector<double> kinetic_max_j;
  double growth_1_s = 0;  ///< growth rate of the motion, negative: it dies out; 0 if fewer than two windows move

  double tail_m() const;  ///< the larger of the last two windows
  double tail_j() const;
};

/// Bounds below which a loop counts as at rest.
struct RestBounds {
  double motion_m = kStillM, kinetic_j = kStillJ;
};

/// `position` and `kinetic_j` have one entry per millisecond, from the moment from which nothing drives. `lost`: the motion ended
/// because the tool went too far.
StabilityVerdict judge_motion(std::span<const Vec3> position, std::span<const double> kinetic_j, bool lost,
                              const RestBounds& still = {});

struct Shake {
  double motion_m = 0, speed_m_s = 0;    ///< shake s
  double travel_m = 0, fastest_m_s = 0;  ///< whole motion x
};
Shake shake_of(std::span<const LoopTick> driven);

enum class LoopFault : std::uint8_t { none, lost, unrest, shakes };
inline constexpr std::array<std::string_view, 4> kLoopFaultNames{"stable", "lost", "unrest", "shakes"};
inline std::string_view name_of(LoopFault f) { return kLoopFaultNames[static_cast<std::size_t>(f)]; }

struct LoopVerdict {
  LoopFault fault = LoopFault::none;
  StabilityVerdict rest;
  Shake shake;
  double generated_j = 0;  ///< energy from the display beyond what the hand had put in until then, at its largest
};

/// Nothing drives the loop from `rest_tick` on. The reference was driven alike; the motion that it has not calmed is added to
/// `still`.
LoopVerdict judge_loop(const ClosedLoopResult& loop, const ClosedLoopResult& reference, std::size_t rest_tick,
                       RestBounds still = {});

}  // namespace palpate
