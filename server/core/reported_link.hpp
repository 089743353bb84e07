// Link quality as a station reports it, and the number of copies of each patch that follows from it.
//
// A patch sent in n datagrams, each lost with probability p, is lost with probability p^n. n is the least number that loses no
// more than kPatchesLost of the patches, at most kPatchCopiesMost.
#pragma once

#include "common/wire/messages.hpp"

namespace palpate {

inline constexpr double kPatchesLost = 0.002;  ///< share of patches that may get lost; above it they are sent more than once
inline constexpr int kPatchCopiesMost = 3;     ///< most datagrams that carry the same patch
inline constexpr int kLossJudged = 20;         ///< fewest judged datagrams for a station's loss report to count

struct ReportedLink {
  Micros patch_age{};            ///< age that its patches reach in use; 0 = not reported
  int patch_copies = 2;          ///< datagrams that carry each patch to it
  bool loss_known = false;       ///< true once it has reported its loss
  double lost = 0;               ///< share of the datagrams to it that get lost
  int longest_run = 0;           ///< longest run of consecutive lost datagrams to it
  std::uint32_t ticks_late = 0;  ///< late ticks of its haptic loop

  void take(const Beat& beat) {
    patch_age = beat.link.patch_age;
    longest_run = beat.link.longest_run;
    ticks_late = beat.ticks_late;
    if (beat.link.judged < kLossJudged) return;
    loss_known = true;
    lost = static_cast<double>(beat.link.lost) / beat.link.judged;
    patch_copies = 1;
    for (double all = lost; all > kPatchesLost && patch_copies < kPatchCopiesMost; all *= lost) ++patch_copies;
  }
};

}  // namespace palpate
