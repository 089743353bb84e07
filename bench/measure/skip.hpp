// Cost of a server with several rooms, and the forces on its hands, for comparing with and without skipped work.
//
// The real server cores and bodies and the real stations in virtual time, without delay. The server is called as its shell calls
// it: when datagrams come, and at its deadlines. Sockets, threads and the work of the stations themselves are not counted.
#pragma once

#include <span>

#include "bench/fidelity/replay.hpp"

namespace palpate {

struct SkipRoom {
  const Scene* scene = nullptr;
  const Motion* hand = nullptr;  ///< nullptr: no station
  bool viewer = false;           ///< true: there is a viewer
  bool may_sleep = true;         ///< false: the body is stepped in every frame
};

struct SkipCost {
  double busy_ms_s = 0;                                            ///< processor time of the server per second
  double wake_ups_s = 0;                                           ///< number of times per second that it has work to do
  double frames_s = 0, stepped_s = 0, patches_s = 0, bytes_s = 0;  ///< over all rooms, per second; bytes_s counts sent bytes
  std::vector<std::vector<Vec3>> felt;                             ///< for the hand of each room that has one, tick by tick [N]
};

/// Throws std::runtime_error if a body cannot be stepped.
SkipCost serve(std::span<const SkipRoom> rooms, double duration_s, const Stopwatch& stopwatch, double deadband = 0);

/// Largest difference of the felt forces [N].
double felt_difference_n(const SkipCost& a, const SkipCost& b);
/// The same over the force of `b` in that tick, or over Deadband::kForceLeastN if the force is smaller.
double felt_difference_share(const SkipCost& a, const SkipCost& b);

inline constexpr double kSkipRateHz = 20, kAwayM = 0.06, kVisitS = 12;
/// A hand that rests kAwayM above the body, comes down after 2 s, taps and leaves again; for a grasp it presses and stays. It
/// lasts kVisitS.
Motion visit(const Scene& scene);
/// A hand that rests `above_m` above the body all the time.
Motion wait_above(const Scene& scene, double above_m);
/// A hand that presses 6 mm into the body for 10 s, trembling by 0.2 mm, and leaves.
Motion hold_pressed(const Scene& scene);
/// A hand that stays 2 mm above the body, trembling by 0.2 mm, and dips 3 mm into it for 0.6 s every 3 s.
Motion linger(const Scene& scene);

}  // namespace palpate
