// The path of one tool in body time, from the samples (t_k, x_k) that came so far:
//     x(t) = x_k + (t - t_k) / (t_(k+1) - t_k) (x_(k+1) - x_k) + (1 - m((t - t_b) / T)) j,   T = kLeadBack,
// the last term from t_b to t_b + T alone, m the curve of least jerk (minimum_jerk.hpp).
//
// A path is nowhere faster than kFastestMs, whatever the samples say: a sample that is further away is taken to lie on the way to
// it. What jumps about would otherwise cost a body many short steps.
//
// After the last sample a tool goes on as it went (its mean velocity over the last kVelocityWindow) and comes to rest
// (tool_prediction.hpp). Samples that come when the body has already gone past them, at t_b, take it back to where it truly was:
// what the path jumps by there, j, is given back over T, so that no body is torn.
#pragma once

#include <cassert>
#include <deque>
#include <span>

#include "server/body/integrator.hpp"

namespace palpate {

class ToolTrack {
 public:
  static constexpr Micros kVelocityWindow{8'000};  ///< a step of 0.03 mm, an encoder's, is then 4 mm/s; longer: lags more
  static constexpr Micros kLeadBack{100'000};      ///< as long as a tool is dead-reckoned; shorter: faster
  static constexpr double kFastestMs = 2;          ///< along the path; a hand that taps gets to about 1 m/s

  bool empty() const { return samples_.empty(); }
  // Of a path that has samples, as all below but add() and forget_before().
  Micros begin() const {
    assert(!empty());
    return samples_.front().t;
  }
  Micros newest() const {
    assert(!empty());
    return samples_.back().t;
  }
  /// Ascending; a sample that is not newer than the last one is left out. `body_time`: how far the body has gone along the path.
  void add(std::span<const ToolSample> samples, Micros body_time);
  /// The body goes on at `to` in the place of `from`: the tool is led to where it is then, as by add().
  void leave_out(Micros from, Micros to);
  /// All of a path, before any of it was gone along.
  void add(std::span<const ToolSample> samples) { add(samples, Micros::min()); }
  /// Position, and velocity of the segment that ends at or contains `t`.
  ToolAt at(Micros t) const;
  /// The same without being led back: where the tool truly was, as far as samples tell.
  ToolAt on_path(Micros t) const;
  /// Forgets what no call of at() from `t` on needs.
  void forget_before(Micros t);

 private:
  std::deque<ToolSample> samples_;
  void lead_on(const Vec3& from, Micros body_time);

  Micros led_from_{};
  Vec3 offset_ = Vec3::Zero();  // of at() from the path at led_from_
};

}  // namespace palpate
