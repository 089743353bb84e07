// A thread through tissue: spans of material length between bites, where it slides with friction; the same law on both ends.
//
// Bite j = 0 ... n - 1 is a point x_j of the body that the thread passes through. Span i = 1 ... n - 1 lies between bites i - 1
// and i; span 0 is the tail before the first bite, and span n goes from the last bite to the hand at h, or is a tail, too. With
// the distance l_i between its ends and its material length L_i a span has the tension
//
//     T_i = k max(0, l_i - L_i);   of a tail T = 0
//
// At bite j it turns by the angle theta_j, r_j = e^(mu theta_j) (Euler, Eytelwein), and slides where one side pulls harder:
//
//     T_(j+1) <= r_j T_j + d,   T_j <= r_j T_(j+1) + d;   else length passes through the bite until that holds
//
// but not through a bite that is tied, nor of a barbed thread to a lower span.
//
// This is a return map on the lengths: their sum stays as it is, and as length passes only to where the tension is higher, the
// energy sum T_i^2 / 2 k never grows: it dissipates. k stands for the thread and for the tissue that it lies on.
//
// A bite bears what the tissue's toughness J allows: a thread of diameter d cuts through it, and the bite moves on
//
//     |f_j| <= J d,   f_j = T_(j+1) u_(j+1) - T_j u_j,   u the directions of spans;   else x_j moves along f_j until that holds
//
// This is a return map, too: it dissipates J d a length, and takes that from the energy of the thread.
//
// Tangent: spans that slide on each other are a group, dT_i/dl_m = c_i / sum_m (c_m / k), with c_(j+1) = r_j c_j along the slide;
// 0 if a tail or a slack span feeds it; k of a span alone.
//
// Shapes and units: n bites; x_j, h 3 [m]; l, L [m]; T, d, J d [N]; k [N/m]; theta [rad]; mu, r, c no unit.
// What can go wrong: a span that has given all its length to its neighbours stays at length 0; a tail that is used up holds, as
// if it ended in a knot.
#pragma once

#include <array>

#include "common/base/types.hpp"

namespace palpate {

inline constexpr int kMaxBites = 8;
inline constexpr std::size_t kMaxSpans = kMaxBites + 1;
inline constexpr double kMaxThreadM = 1, kMinThreadStiffness_n_m = 10, kMaxThreadStiffness_n_m = 1e5;

struct SutureLaw {
  int bites = 0;             ///< n
  double stiffness_n_m = 0;  ///< k
  double friction = 0;       ///< mu
  double drag_n = 0;         ///< d: with which tissue holds a thread that is not pulled
  bool first_tied = false, last_tied = false;
  bool barbed = false;  ///< true: it slides towards its end alone
  double tear_n = 0;    ///< J d; 0: tissue holds whatever pulls
};

/// A number of each span.
using OfSpans = std::array<double, kMaxSpans>;

/// The place of a thread: its bites, and the hand that holds its end.
struct SuturePlace {
  std::array<Vec3, kMaxSpans> points;  ///< x_0 ... x_(n-1), h
  bool held = false;                   ///< false: h is not used
};

/// Distances between the ends of spans, and directions from the lower bite to the higher, or the hand; of tails zero.
struct SutureShape {
  OfSpans distance_m{};
  std::array<Vec3, kMaxSpans> along;
  std::array<double, kMaxBites> ratio{};  ///< r_j
  bool held = false;
};
SutureShape shape_of(const SutureLaw& law, const SuturePlace& place) noexcept;

struct SuturePull {
  OfSpans tension_n{}, length_m{};     ///< T_i and L_i, after the slides
  OfSpans share{};                     ///< c_i
  OfSpans group_n_m{};                 ///< 1 / sum (c_m / k) of its group
  std::array<int, kMaxSpans> group{};  ///< number of its group
  /// Returns dT_i/dl_m.
  double tangent(std::size_t i, std::size_t m) const { return group[i] == group[m] ? share[i] * group_n_m[i] : 0.0; }
};
/// Returns the tensions of a thread of these material lengths, and its lengths after it has slid.
SuturePull pull_of(const SutureLaw& law, const OfSpans& length_m, const SutureShape& shape) noexcept;

/// Ways of bites through the tissue.
struct SutureTear {
  std::array<Vec3, kMaxBites> way;  ///< of each bite [m]
  double length_m = 0;              ///< of all together
  OfSpans spans_m{};                ///< L_i afterwards
  int settled = 0;                  ///< how often its tensions were computed, which is what it costs
};
inline constexpr int kSettledInFull = 2000;
/// Returns the ways by which a thread of these material lengths cuts through the tissue: the bite that bears the most moves on,
/// and the thread slides, in turn, until each bite bears J d at most, or the tensions were computed `most_settled` times. What is
/// left then is for the next call. No less energy than J d a length is taken from it.
SutureTear tear_of(const SutureLaw& law, const OfSpans& length_m, SuturePlace place, int most_settled = kSettledInFull) noexcept;

}  // namespace palpate
