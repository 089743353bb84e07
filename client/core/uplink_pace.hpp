// How often a station sends its samples, and how many older ones each datagram repeats, from what the server says gets lost.
//
// A sample is lost for good when every datagram that carries it is: a run of losses longer than what is repeated. So repeated is
// what covers the longest run seen, half as long again, and one datagram more. A link that loses nothing is sent half as many
// datagrams, and little is repeated. Until the server has said anything the link counts as bad. A link that loses more than
// kFlooded is one too narrow for what it is sent: it gets as little as a calm one, since more would only drown more.
// Loss is believed at once and forgotten after kRemember.
#pragma once

#include <algorithm>

#include "common/wire/messages.hpp"

namespace palpate {

class UplinkPace {
 public:
  static constexpr Micros kBusy{2'000}, kCalm{4'000};  ///< between datagrams, with losses and without
  static constexpr double kCalmShare = 0.002;          ///< of the datagrams lost: a link that loses no more is calm
  static constexpr double kFlooded = 0.5;              ///< of the datagrams lost: fewer of them would get through better
  static constexpr int kRepeatLeast = 8, kRepeatUnknown = 32, kRepeatMost = 56;
  static constexpr Micros kRemember{10'000'000};

  /// `report`: what the server says of the datagrams to it.
  void take(const LinkReport& report, Micros now) {
    if (report.judged < kJudgedLeast) return;
    const double share = static_cast<double>(report.lost) / report.judged;
    if (now - share_at_ >= kRemember || share >= share_ || !known_) share_ = share, share_at_ = now;
    if (now - run_at_ >= kRemember || report.longest_run >= run_ || !known_) run_ = report.longest_run, run_at_ = now;
    known_ = true;
  }
  void reset() { *this = UplinkPace{}; }

  Micros interval() const { return calm() || flooded() ? kCalm : kBusy; }
  /// Older samples that each datagram repeats; one sample is a millisecond.
  int repeat() const {
    if (!known_) return kRepeatUnknown;
    if (flooded()) return kRepeatLeast;
    const auto samples_each = static_cast<int>(interval() / kSample);
    const int datagrams = run_ + (run_ + 1) / 2 + 1;
    return std::clamp(datagrams * samples_each, kRepeatLeast, kRepeatMost);
  }

 private:
  static constexpr int kJudgedLeast = 100;
  static constexpr Micros kSample{1'000};

  bool calm() const { return known_ && share_ <= kCalmShare; }
  bool flooded() const { return known_ && share_ > kFlooded; }

  bool known_ = false;
  double share_ = 0;
  int run_ = 0;
  Micros share_at_{}, run_at_{};
};

}  // namespace palpate
