// Input from a station's tool: its samples on the server's clock, their delay, the tool's orientation and buttons.
//
// A sample of client time t counts from t - offset on, where offset is that of the two clocks (clock_sync.hpp). No sample can be
// newer than its datagram: one more than kSampleAhead after its arrival is refused. Stored samples that turn out to lie in the
// future, after the clock offset was estimated anew, are dropped, so that they do not block the true ones.
//
//     age of the tool   now - newest sample, both on the server's clock
//     lag               that age when the newest sample came
//     buffer            what the age rarely exceeds before the next sample comes (jitter_buffer.hpp)
#pragma once

#include "common/session/clock_sync.hpp"
#include "common/wire/messages.hpp"
#include "server/core/jitter_buffer.hpp"
#include "server/core/timeline.hpp"

namespace palpate {

inline constexpr Micros kSampleAhead{20'000};  ///< tolerance for rounding, and for a tick that is stamped before it is due

struct SampleCounts {
  std::uint64_t samples = 0;          ///< new samples
  std::uint64_t samples_late = 0;     ///< those of `samples` that came too late: the body had passed them
  std::uint64_t samples_refused = 0;  ///< samples from the future, or before the clocks were known
};

class ToolInput {
 public:
  /// Accepts samples that came at `now`, with the body simulated up to `body_time`. `on_buttons` is called once for each change
  /// of the buttons, in the server's clock.
  template <class OnButtons>
  void take(const Samples& samples, const ClockSync& clock, Micros body_time, Micros now, const OnButtons& on_buttons) {
    if (!add(samples, clock, body_time, now)) return;
    orientation_ = samples.samples.back().orientation;
    opening_ = samples.samples.back().opening;
    for (const ButtonChange& change : samples.buttons) {  // changes are repeated, and may arrive out of order
      if (change.t <= buttons_.t) continue;
      const bool changed = change.pressed != buttons_.pressed;
      if ((change.pressed & ~buttons_.pressed) != 0) ++presses_;
      buttons_ = change;
      if (changed) on_buttons(ButtonChange{clock.from_peer(change.t), change.pressed});
    }
  }
  void forget_before(Micros t_server) { timeline_.forget_before(t_server); }

  const Timeline& timeline() const { return timeline_; }
  Micros heard() const { return heard_; }  ///< arrival of the newest sample
  Micros lag() const { return lag_; }
  Micros buffer() const { return buffer_.length(); }
  const Orientation& orientation() const { return orientation_; }  ///< the newest that came
  double opening() const { return opening_; }                      ///< likewise
  std::uint32_t pressed() const { return buttons_.pressed; }
  std::uint32_t presses() const { return presses_; }  ///< how often a button was pressed
  const SampleCounts& counts() const { return counts_; }

 private:
  /// Returns true if there was a new sample.
  bool add(const Samples& samples, const ClockSync& clock, Micros body_time, Micros now);

  Timeline timeline_;
  JitterBuffer buffer_;
  Micros heard_{}, lag_{};
  Orientation orientation_;
  double opening_ = 0;
  ButtonChange buttons_{Micros::min(), 0};  ///< the newest change; the station's clock
  std::uint32_t presses_ = 0;
  SampleCounts counts_;
};

}  // namespace palpate
