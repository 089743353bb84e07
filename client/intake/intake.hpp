// The network side of the hand-over: a checked patch comes in, is compiled and caught up with the client's own samples,
// and leaves through a wait-free slot to the haptic thread; once more when the terms that go with it have come (scheme hyper).
//
// Until they have, a patch of scheme hyper is its linear part, and the nonlinear one before it may be truer, if older.
// Whenever terms come, both are set beside the new nonlinear patch at the newest sample,
//     e_before = |f_before - f| / (patches it is behind),   e_linear = |f_linear - f|,   running means,
// and the next patch is held back while e_before times the patches that the nonlinear one is then behind is at most e_linear,
// for at most kBehindMost patches and no longer than the nonlinear one is valid.
//
// A seq that leads further than patches can have been made is refused, or one datagram would make all that follow it old news:
// with t the time that stamps or our clock have gone on since the last patch, and f the server's frames a second, it may lead by
// kJumpFree + 1.25 f t.
// Runs off the haptic thread; one writer.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/base/latest_slot.hpp"
#include "common/base/types.hpp"
#include "common/player/player.hpp"
#include "common/port/patch.hpp"
#include "common/port/terms_pieces.hpp"

namespace palpate {

/// The client's own tool samples, newest last, bounded; what a patch is caught up with.
class SampleHistory {
 public:
  SampleHistory();
  void add(const ToolSample& sample);
  std::size_t size() const;
  const ToolSample& operator[](std::size_t age_from_oldest) const;
  /// Index of the first sample later than `t`; size() when there is none.
  std::size_t first_after(Micros t) const;
  void clear();

 private:
  std::vector<ToolSample> ring_;
  std::size_t first_ = 0, count_ = 0;
};

struct IntakeCounts {
  std::uint64_t accepted = 0, stale = 0, too_old = 0, from_future = 0;
  std::uint64_t jumped = 0;       ///< whose seq lead too far
  std::uint64_t nonlinear = 0;    ///< patches that were played with their terms
  std::uint64_t held_back = 0;    ///< patches that waited for their terms while the one before, nonlinear, went on
  std::uint64_t stale_terms = 0;  ///< pieces of terms that were old, known, or of another whole
};

class PatchIntake {
 public:
  static constexpr Micros kFutureMax{20'000};  ///< a stamp further ahead of our own clock than this is nonsense
  /// A shadow's stamps come by way of its hand's link, whose two ways may differ by much more than its own way takes.
  static constexpr Micros kShadowFutureMax{250'000};
  static constexpr int kJumpFree = 8;
  static constexpr Micros kStoodMost{3'000'000};
  explicit PatchIntake(LatestSlot<PatchPlayer>& slot, Micros future_max = kFutureMax) : slot_(slot), future_max_(future_max) {}
  /// Every sample of the haptic thread, in order.
  void add_sample(const ToolSample& sample) { history_.add(sample); }
  const SampleHistory& history() const { return history_; }
  /// Frames a second of the server, kMaxRateHz before the first call.
  void expect(double rate_hz) { rate_hz_ = rate_hz; }
  /// Our clock stood still for so long (a machine that slept): the server's numbers went on meanwhile. Of more than kStoodMost no
  /// session is left.
  void stood_still(Micros time) { last_came_ -= std::min(time, kStoodMost); }
  /// Takes a patch that passed check(): false (and counted) when it is not newer than the last one, leads too far, is older than
  /// the history, or from the future. `now` is the clock of the samples; the newest of them may be older, after this side stood
  /// still.
  bool accept(const Patch& patch, Micros now);
  /// Takes a piece of the terms of a patch, before or after the patch itself. When the last one is there the patch is compiled
  /// anew with them, caught up and handed over like a new one; until then, and for ever when one is lost, it plays without, or
  /// the one before goes on.
  bool accept(const PatchTerms& piece);
  /// A new server process or station: sequence numbers start over.
  void reset();
  const IntakeCounts& counts() const { return counts_; }
  /// seq of the patch that was handed over last; 0 when none was since reset(), or one whose terms are not all there.
  std::uint32_t playing() const { return playing_; }
  /// What came of the terms that patches are sent with.
  const TermsAssembly& terms() const { return terms_; }

 private:
  static constexpr int kBehindMost = 4;

  bool leads_too_far(const Patch& patch, Micros now) const;
  void catch_up(PatchPlayer& player) const;
  void hand_over(const NonlinearTerms& terms);
  bool before_is_truer(Micros now) const;
  void compare(const PatchPlayer& nonlinear);
  std::int32_t patches_behind() const;

  LatestSlot<PatchPlayer>& slot_;
  Micros future_max_;
  SampleHistory history_;
  Patch patch_;  ///< the last one that was accepted
  TermsAssembly terms_;
  std::uint32_t last_seq_ = 0, playing_ = 0;
  double rate_hz_ = kMaxRateHz;
  Micros last_came_{};
  std::optional<PatchPlayer> nonlinear_;  ///< what was handed over last with its terms
  bool nonlinear_plays_ = false;          ///< and nothing since
  double before_error_n_ = 0, linear_error_n_ = 0;
  IntakeCounts counts_;
};

}  // namespace palpate
