// What the server knows of a station's tool: its samples on the server's clock, how late they come, how it is held.
//
// A sample of the client's time t counts from t - offset on, offset being that of the two clocks (clock_sync.hpp). No datagram is
// mapped to after it came, so that a sample that would lie more than kSampleAhead after that is refused; and so that those which
// are there do not keep out the true ones, they are forgotten where they turn out to lie in the future, as the clock was found
// anew.
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

inline constexpr Micros kSampleAhead{20'000};  ///< of rounding, and of a tick that is stamped before it is due

struct SampleCounts {
  std::uint64_t samples = 0;          ///< new ones
  std::uint64_t samples_late = 0;     ///< of these: too late for the body, which had gone past them
  std::uint64_t samples_refused = 0;  ///< from the future, or before the clocks were known
};

class ToolInput {
 public:
  /// Samples that came at `now`; the body is simulated up to `body_time`. `on_buttons` hears each change of the buttons, once,
  /// in the server's clock.
  template <class OnButtons>
  void take(const Samples& samples, const ClockSync& clock, Micros body_time, Micros now, const OnButtons& on_buttons) {
    if (!add(samples, clock, body_time, now)) return;
    orientation_ = samples.orientation;
    for (const ButtonChange& change : samples.buttons) {  // changes are repeated, and come again out of order
      if (change.t <= buttons_.t) continue;
      const bool changed = change.pressed != buttons_.pressed;
      buttons_ = change;
      if (changed) on_buttons(ButtonChange{clock.from_peer(change.t), change.pressed});
    }
  }
  void forget_before(Micros t_server) { timeline_.forget_before(t_server); }

  const Timeline& timeline() const { return timeline_; }
  Micros heard() const { return heard_; }  ///< when the newest sample came
  Micros lag() const { return lag_; }
  Micros buffer() const { return buffer_.length(); }
  const Orientation& orientation() const { return orientation_; }  ///< the newest that came
  std::uint32_t pressed() const { return buttons_.pressed; }
  const SampleCounts& counts() const { return counts_; }

 private:
  /// Whether there was a new one.
  bool add(const Samples& samples, const ClockSync& clock, Micros body_time, Micros now);

  Timeline timeline_;
  JitterBuffer buffer_;
  Micros heard_{}, lag_{};
  Orientation orientation_;
  ButtonChange buttons_{Micros::min(), 0};  ///< the newest change; the station's clock
  SampleCounts counts_;
};

}  // namespace palpate
