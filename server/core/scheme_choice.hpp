// Which scheme a station that left it to the server (`auto`) gets in the next frame: the nonlinear one where its patch fits the
// station's share of the frame and of the link, `port` else.
//
// As long as nobody knows what a nonlinear patch costs it is tried: a few frames tell.
//
// It is told what frames cost and what the link carries; it knows no clock. With hysteresis in both directions: a patch that has
// become too dear is given up at once, one that was given up comes back only after it would have fitted with a margin for a
// while, and that while doubles each time it had to be given up again soon.
#pragma once

#include <cstdint>

#include "common/base/types.hpp"
#include "common/port/scheme_in_use.hpp"

namespace palpate {

/// Processor time of one frame.
struct SchemeCost {
  Micros frame{};      ///< that a frame lasts
  Micros body{};       ///< the body's step and all that is no patch
  Micros others{};     ///< patches of stations that named their scheme
  Micros nonlinear{};  ///< a nonlinear patch, 0 = never measured
  int stations = 1;    ///< that left it to the server
};

class SchemeChoice {
 public:
  /// Of the frame that body and patches may take together: the rest is for datagrams, viewers and the scheduler.
  static constexpr double kShareOfFrame = 0.8;
  /// Of the datagrams that a link may lose: a nonlinear patch takes several, and is of no use before all have come.
  static constexpr double kLostMost = 0.1;
  /// The nonlinear scheme comes back only where it takes less than this of what it may.
  static constexpr double kComesBackBelow = 0.75;
  static constexpr Micros kComesBackAfter{2'000'000}, kComesBackAfterMost{64'000'000};
  /// One that stayed for so long starts again with kComesBackAfter.
  static constexpr Micros kStayed{30'000'000};

  /// Call once a frame, `now` of any clock that does not go back; `lost` is the share of the datagrams that get lost on the way
  /// to the station. Whether the nonlinear scheme is taken.
  bool decide(const SchemeCost& cost, double lost, Micros now);

  bool nonlinear() const { return nonlinear_; }
  SchemeReason reason() const { return reason_; }
  std::uint32_t changes() const { return changes_; }
  /// Time that a station has for its patch.
  static Micros has(const SchemeCost& cost);

 private:
  SchemeReason objection(const SchemeCost& cost, double lost, double share) const;
  void change(bool nonlinear, Micros now);

  bool nonlinear_ = false, began_ = false, objected_ = false;
  SchemeReason reason_ = SchemeReason::not_known_yet;
  std::uint32_t changes_ = 0;
  Micros changed_{}, fits_since_{}, comes_back_after_ = kComesBackAfter;
};

}  // namespace palpate
