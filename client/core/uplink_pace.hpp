// Rate at which a station sends its samples, and the number of older samples that each datagram repeats, from the losses that the
// server reports.
//
// A sample is lost for good when every datagram that carries it is lost, i.e. in a run of losses longer than the repeats. So the
// repeats cover the longest run seen, half as long again, plus one datagram. A link without losses gets half as many datagrams
// with few repeats. Until the server has reported, the link counts as bad. A link that loses more than kFlooded is too narrow for
// what it carries: it gets as little as a calm one, because more would only flood it further. A loss counts at once and is
// forgotten after kRemember.
#pragma once

#include <algorithm>

#include "common/wire/messages.hpp"

namespace palpate {

class UplinkPace {
 public:
  static constexpr Micros kBusy{2'000}, kCalm{4'000};  ///< interval between datagrams, with losses and without
  static constexpr double kCalmShare = 0.002;          ///< largest share of lost datagrams on a calm link
  static constexpr double kFlooded = 0.5;              ///< share of lost datagrams beyond which fewer of them arrive better
  static constexpr int kRepeatLeast = 8, kRepeatUnknown = 32, kRepeatMost = 56;
  static constexpr Micros kRemember{10'000'000};

  /// `report`: the server's report about the datagrams that it receives.
  void take(const LinkReport& report, Micros now) {
    if (report.judged < kJudgedLeast) return;
    const double share = static_cast<double>(report.lost) / report.judged;
    if (now - share_at_ >= kRemember || share >= share_ || !known_) share_ = share, share_at_ = now;
    if (now - run_at_ >= kRemember || report.longest_run >= run_ || !known_) run_ = report.longest_run, run_at_ = now;
    known_ = true;
  }
  void reset() { *this = UplinkPace{}; }

  Micros interval() const { return calm() || flooded() ? kCalm : kBusy; }
  /// Number of older samples in each datagram; one sample is a millisecond.
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
