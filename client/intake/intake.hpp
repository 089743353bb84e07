// The network side of the hand-over: a checked patch arrives, is compiled, is replayed over the client's own samples, and leaves
// through a wait-free slot to the haptic thread; and again when its terms have arrived (nonlinear_terms.hpp).
//
// Until then such a patch is only its linear part and a small surface, and the whole patch before it may be more accurate
// although it is older. Whenever terms arrive, both are compared with the new whole patch at the newest sample,
//     e_before = |f_before - f| / (patches it is behind),   e_linear = |f_linear - f|,   running means,
// and the next patch is held back while e_before times the number of patches that the whole one is then behind is at most
// e_linear, for at most kBehindMost patches and no longer than the whole one is valid.
//
// A seq further ahead than any real patch is refused, because a single such datagram would make all later patches stale: with t
// the time that stamps or our clock have advanced since the last patch, and f the server's frame rate, it may lead by kJumpFree +
// 1.25 f t. Runs off the haptic thread; one writer.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>

#include "common/base/latest_slot.hpp"
#include "common/base/sample_history.hpp"
#include "common/base/types.hpp"
#include "common/patch/patch.hpp"
#include "common/patch/terms_pieces.hpp"
#include "common/player/player.hpp"

namespace palpate {

struct IntakeCounts {
  std::uint64_t accepted = 0, stale = 0, too_old = 0, from_future = 0;
  std::uint64_t jumped = 0;       ///< patches whose seq was too far ahead
  std::uint64_t with_terms = 0;   ///< patches played with their terms
  std::uint64_t held_back = 0;    ///< patches that waited for their terms while the one before was still played with its own
  std::uint64_t stale_terms = 0;  ///< pieces of terms that were old, duplicated, or from another patch
};

class PatchIntake {
 public:
  static constexpr int kBehindMost = 4;
  static constexpr Micros kFutureMax{20'000};  ///< limit beyond which a stamp ahead of our own clock is invalid
  /// A shadow's stamps arrive by way of its hand's link, whose two directions may differ by much more than the shadow's own
  /// delay.
  static constexpr Micros kShadowFutureMax{250'000};
  static constexpr int kJumpFree = 8;
  static constexpr Micros kStoodMost{3'000'000};
  explicit PatchIntake(LatestSlot<PatchPlayer>& slot, Micros future_max = kFutureMax) : slot_(slot), future_max_(future_max) {}
  /// Adds a sample of the haptic thread: each one, in order.
  void add_sample(const ToolSample& sample) { history_.add(sample); }
  const SampleHistory<ToolSample>& history() const { return history_; }
  /// Sets the frame rate of the server [1/s], kMaxRateHz before the first call.
  void expect(double rate_hz) { rate_hz_ = rate_hz; }
  /// Notes that our clock stood still for this long (the machine slept) while the server's numbers advanced. No session survives
  /// more than kStoodMost.
  void stood_still(Micros time) { last_came_ -= std::min(time, kStoodMost); }
  /// Accepts a patch that passed check(). Returns false (and counts) when it is not newer than the last one, leads too far, is
  /// older than the history, or is from the future. `now` is on the clock of the samples; the newest sample may be older, after
  /// this side stood still.
  bool accept(const Patch& patch, Micros now);
  /// Accepts a piece of the terms of a patch, before or after the patch itself. With the last piece the patch is recompiled with
  /// its terms, replayed and handed over like a new one. Until then, or for good when a piece is lost, the patch plays without
  /// terms, or the one before is still played.
  bool accept(const PatchTerms& piece);
  /// Prepares for a new server process or station: sequence numbers start over.
  void reset();
  const IntakeCounts& counts() const { return counts_; }
  /// Returns the seq of the patch handed over last; 0 when none was since reset(), or when its terms are incomplete.
  std::uint32_t playing() const { return playing_; }
  /// The state of the terms of patches.
  const TermsAssembly& terms() const { return terms_; }

 private:
  bool leads_too_far(const Patch& patch, Micros now) const;
  void catch_up(PatchPlayer& player) const;
  void hand_over(const NonlinearTerms& terms);
  bool before_is_truer(Micros now) const;
  void compare(const PatchPlayer& whole);
  std::int32_t patches_behind() const;

  LatestSlot<PatchPlayer>& slot_;
  Micros future_max_;
  SampleHistory<ToolSample> history_{kSampleHistoryTicks};
  Patch patch_;  ///< last accepted patch
  TermsAssembly terms_;
  std::uint32_t last_seq_ = 0, playing_ = 0;
  double rate_hz_ = kMaxRateHz;
  Micros last_came_{};
  std::optional<PatchPlayer> whole_;  ///< the patch handed over last with its terms
  bool whole_plays_ = false;          ///< true: nothing was handed over since `whole_`
  double before_error_n_ = 0, linear_error_n_ = 0;
  IntakeCounts counts_;
};

}  // namespace palpate
