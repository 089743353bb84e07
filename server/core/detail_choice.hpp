// Whether something that makes patches truer and takes the server time is done in the next frame: the nonlinear scheme for a
// station that left it to the server (`auto`), or rollouts for a room. It is done where it fits what is left of the frame and,
// for a scheme, the link; with
//
//     left = (time - body - others) / shares
//
// As long as nobody knows what it costs it is tried: a few frames tell.
//
// It is told what frames cost and what the link carries; it knows no clock. With hysteresis in both directions: what has become
// too dear is given up at once, and comes back only after it would have fitted with a margin for a while, and that while doubles
// each time that it had to be given up again soon after it came back.
#pragma once

#include <cstdint>

#include "common/base/types.hpp"
#include "common/wire/scheme_in_use.hpp"

namespace palpate {

/// Time that the thread takes which runs a frame.
struct DetailCost {
  Micros time{};    ///< that body and patches may take together
  Micros body{};    ///< the body's step and all that is no patch
  Micros others{};  ///< what else is done in the frame, whatever is chosen here
  Micros cost{};    ///< of what is to be chosen, 0 = never measured
  int shares = 1;   ///< that there are to be
};

class DetailChoice {
 public:
  /// What was given up comes back only where it takes less than this of what it may.
  static constexpr double kComesBackBelow = 0.85;
  static constexpr Micros kComesBackAfter{2'000'000}, kComesBackAfterMost{64'000'000};
  /// What stayed for so long starts again with kComesBackAfter.
  static constexpr Micros kStayed{30'000'000};

  /// Call once a frame, `now` of any clock that does not go back; `lost` is the share of the datagrams that get lost on the way
  /// to the station. Whether it is done.
  bool decide(const DetailCost& cost, double lost, Micros now);

  bool taken() const { return taken_; }
  SchemeReason reason() const { return reason_; }
  std::uint32_t changes() const { return changes_; }
  static Micros left(const DetailCost& cost);

 private:
  SchemeReason objection(const DetailCost& cost, double lost, double share) const;
  void change(bool taken, Micros now);

  bool taken_ = false, began_ = false, objected_ = false;
  SchemeReason reason_ = SchemeReason::not_known_yet;
  std::uint32_t changes_ = 0;
  Micros changed_{}, fits_since_{}, comes_back_after_ = kComesBackAfter;
};

}  // namespace palpate
