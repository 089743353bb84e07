// The path of one tool in body time, from the samples (t_k, x_k, R_k) received so far:
//     x(t) = x_k + (t - t_k) / (t_(k+1) - t_k) (x_(k+1) - x_k) + (1 - m((t - t_b) / T)) j,   T = kLeadBack,
// with the last term only from t_b to t_b + T, and m the minimum-jerk curve (minimum_jerk.hpp). Its rotation is that of constant
// spin between samples, R(t) = exp((1 - m) phi) R_k slerp, upright without orientations, and its opening is like a coordinate of
// x.
//
// A path is nowhere faster than kFastestMs, kFastestRadS and kFastestOpening1S, whatever the samples say: a sample that is too
// far away is moved onto the line towards it. A tool that jumps about would otherwise cost the body many short steps.
//
// After the last sample the tool continues at its mean velocity and spin over the last kVelocityWindow and comes to rest
// (tool_prediction.hpp). Samples that arrive after the body has passed them, at t_b, correct the path: the resulting jump (j,
// phi) of the path at t_b is blended out over T, so that no body is torn.
#pragma once

#include <span>

#include "common/base/minimum_jerk.hpp"
#include "common/base/sample_history.hpp"
#include "common/base/tool_shape.hpp"
#include "server/dynamics/integrator.hpp"

namespace palpate {

/// Returns the tool displaced by an offset that fades.
inline ToolAt moved_by(ToolAt tool, const FadingVector& offset, Micros t) {
  if (offset.over(t)) return tool;
  return {tool.position + offset.at(t), tool.velocity + offset.rate(t), tool.axis, tool.edge};
}

/// A tool that may turn.
struct TurningTool {
  ToolAt at;  ///< of the tool point
  Rotation turn = Rotation::Identity();
  Vec3 spin = Vec3::Zero();  ///< omega, in W [rad/s]
  double opening = 0;        ///< o (tool_shape.hpp)
  double opens_1_s = 0;      ///< o'
  /// Returns the centre of a sphere of its body: h + R a, h' + omega x R a + o' R da/do; R e_z, R e_x.
  ToolAt centre_of(const ToolSphere& sphere) const;
};

class ToolTrack {
 public:
  static constexpr Micros kVelocityWindow{8'000};  ///< an encoder's step of 0.03 mm makes 4 mm/s; longer: lags more
  static constexpr Micros kLeadBack{100'000};      ///< as long as a tool is dead-reckoned; shorter: faster
  static constexpr double kFastestMs = 2;          ///< highest speed [m/s] along the path; a tapping hand reaches about 1 m/s
  static constexpr double kFastestRadS = 20;       ///< highest spin [rad/s]; a wrist reaches about 10
  static constexpr double kFastestOpening1S = 20;  ///< fastest change of the opening; fingers close within about 0.1 s

  bool empty() const { return samples_.empty(); }
  // Requires a path with samples, as all below except add() and forget_before().
  Micros begin() const { return samples_.oldest().t; }
  Micros newest() const { return samples_.newest().t; }
  /// Adds ascending samples; one that is not newer than the last is dropped. `body_time`: how far the body has followed the path.
  void add(std::span<const ToolSample> samples, Micros body_time);
  /// Skips the time between `from` and `to`: the tool is led from where it was to where it is then, as by add().
  void skip(Micros from, Micros to) { lead_on(turning(from), to); }
  /// Adds samples to a path that the body has not started to follow.
  void add(std::span<const ToolSample> samples) { add(samples, Micros::min()); }
  /// Returns the position, and the velocity of the segment that ends at or contains `t`.
  ToolAt at(Micros t) const { return turning(t).at; }
  TurningTool turning(Micros t) const;
  /// Returns the same without the blend: the true path of the tool, as known from its samples.
  TurningTool on_path(Micros t) const;
  /// The true path as samples: their orientations are empty where those of the tool are.
  ToolSample sample(Micros t) const;
  /// Drops samples that no call of at() from `t` on needs.
  void forget_before(Micros t);

 private:
  static constexpr std::size_t kMost = 8192;  // samples
  void lead_on(const TurningTool& from, Micros body_time);

  SampleHistory<ToolSample> samples_{kMost};
  FadingVector lead_, lead_turn_, lead_opening_;  // from the path to at() [m]; rotation vector [rad]; opening, along x
};

}  // namespace palpate
