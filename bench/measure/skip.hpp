// What a server costs that has several rooms, and what its hands feel: for setting what is left out beside what is not.
//
// The real server cores and bodies and the real stations in virtual time, without delay. The server is called as its shell calls
// it: when datagrams came, and at its deadlines. Sockets and threads are left out; so is what the stations themselves do.
#pragma once

#include <span>

#include "bench/fidelity/replay.hpp"

namespace palpate {

struct SkipRoom {
  const Scene* scene = nullptr;
  const Motion* hand = nullptr;  ///< none: nobody is there
  bool viewer = false;           ///< somebody looks on
  bool may_sleep = true;         ///< else its body is stepped in every frame
};

struct SkipCost {
  double busy_ms_s = 0;                                            ///< processor time of the server, a second
  double wake_ups_s = 0;                                           ///< how often it has something to do, a second
  double frames_s = 0, stepped_s = 0, patches_s = 0, bytes_s = 0;  ///< of all rooms, a second; bytes that it sends
  std::vector<std::vector<Vec3>> felt;                             ///< by the hand of each room that has one, tick by tick [N]
};

/// Throws std::runtime_error when a body cannot be stepped.
SkipCost serve(std::span<const SkipRoom> rooms, double duration_s, const Stopwatch& stopwatch, double deadband = 0);

/// Largest difference of what the hands felt [N].
double felt_difference_n(const SkipCost& a, const SkipCost& b);
/// The same over the force of `b` in that tick, or Deadband::kForceLeastN where that is smaller.
double felt_difference_share(const SkipCost& a, const SkipCost& b);

inline constexpr double kSkipRateHz = 20, kAwayM = 0.06, kVisitS = 12;
/// A hand that rests kAwayM above the body, comes down after 2 s, taps and leaves again; for a grasp it presses and stays.
/// kVisitS long.
Motion visit(const Scene& scene);
/// It rests so far above the body all the time.
Motion wait_above(const Scene& scene, double above_m);
/// It presses 6 mm into the body for 10 s, trembling by 0.2 mm, and leaves.
Motion hold_pressed(const Scene& scene);
/// It lingers 2 mm above the body, trembling by 0.2 mm, and dips 3 mm into it for 0.6 s every 3 s.
Motion linger(const Scene& scene);

}  // namespace palpate
