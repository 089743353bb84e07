// What a station says of the link to it, and how often each patch is sent for that.
//
// A patch that travels in n datagrams is lost with probability p^n where each of them is with p: n is the least that loses no
// more than kPatchesLost of the patches, at most kPatchCopiesMost.
#pragma once

#include "common/wire/messages.hpp"

namespace palpate {

inline constexpr double kPatchesLost = 0.002;  ///< share of the patches that may get lost: else they go more than once
inline constexpr int kPatchCopiesMost = 3;     ///< datagrams that carry the same patch
inline constexpr int kLossJudged = 20;         ///< datagrams at least, before a station's word on what it loses counts

struct LinkSaid {
  Micros patch_age{};            ///< that its patches in use reach; 0 = it has not said
  int patch_copies = 2;          ///< datagrams that carry each patch to it
  bool loss_known = false;       ///< it has said what it loses
  double lost = 0;               ///< share of the datagrams to it that get lost
  int longest_run = 0;           ///< of datagrams to it that got lost one after the other
  std::uint32_t ticks_late = 0;  ///< of its haptic loop

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
