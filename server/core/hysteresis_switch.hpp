// Decides, with hysteresis, whether the next frame spends time on an option that improves accuracy: the nonlinear scheme for a
// station that left the scheme to the server (`auto`), or rollouts for a room. The option is chosen if it fits into the remaining
// time of the frame and, for a scheme, if the link is good enough for it:
//
//     left = (time - body - others) / shares
//
// While its cost is unknown the option is tried; a few frames suffice to measure it.
//
// The inputs are the costs of frames and the loss of the link; no clock is read. An option that has become too expensive is
// dropped at once. It returns only after it would have fitted with a margin for a while, and that while doubles each time the
// option is dropped again soon after its return.
#pragma once

#include <cstdint>

#include "common/base/types.hpp"
#include "common/wire/scheme_in_use.hpp"

namespace palpate {

/// Time budget of the thread that runs a frame.
struct DetailCost {
  Micros time{};    ///< time available for body and patches together
  Micros body{};    ///< time for the body's step and everything else that is not a patch
  Micros others{};  ///< time for the other work of the frame, whatever is chosen here
  Micros cost{};    ///< cost of the option; 0 = never measured
  int shares = 1;   ///< number of users among whom the time is divided
};

class HysteresisSwitch {
 public:
  /// A dropped option returns only if it needs less than this share of its time.
  static constexpr double kComesBackBelow = 0.85;
  static constexpr Micros kComesBackAfter{2'000'000}, kComesBackAfterMost{64'000'000};
  /// An option that stayed for this long starts again with kComesBackAfter.
  static constexpr Micros kStayed{30'000'000};

  /// Decides for one frame and returns true if the option is chosen. Call once a frame; `now` may come from any clock that does
  /// not go back; `lost` is the share of the datagrams to the station that get lost.
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
