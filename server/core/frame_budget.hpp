// Chooses what the next frame has time for: first the scheme of each station that left it to the server, then rollouts, then the
// stations whose patches are built.
//
// Body and patches may use kSchemesMayTake of a frame for the nonlinear scheme and kRolloutsMayTake for rollouts; the rest is
// left for datagrams, viewers, the scheduler, and frames that take longer than others. The nonlinear scheme gains far more
// accuracy than it loses by making patches some milliseconds older, so it is dropped only where frames would be skipped. Costs
// are learnt from the frames (frame_costs.hpp), and choices have hysteresis (hysteresis_switch.hpp).
//
// The patches of a frame may use what the step leaves of kSchemesMayTake, and at least kPatchesMayTake of the frame. If the
// patches of all stations that touched the body lately take longer, half of that time goes to stations in order of arrival, hands
// before shadows, and the first one is always served; the other half rotates among the rest, longest wait first. A station that
// is not served keeps its tool on the body and plays the patch it has. A tool in the air counts with 1 / kMayTouch of its patch's
// cost. A station whose patch never fits is still served once in kTurnEvery times the patch's cost. So the first hand keeps its
// rate when others join.
#pragma once

#include <functional>
#include <string>

#include "server/core/frame_costs.hpp"
#include "server/core/station.hpp"
#include "server/room/room.hpp"

namespace palpate {

class FrameBudget {
 public:
  static constexpr double kSchemesMayTake = 0.95, kRolloutsMayTake = 0.8, kPatchesMayTake = 0.5;
  static constexpr Micros kTouchKept{60'000'000};  ///< time for which a patch's cost still counts after its last request
  static constexpr int kTurnEvery = 20, kMayTouch = 4;
  explicit FrameBudget(double rate_hz) : frame_s_(1 / rate_hz) {}

  /// Sets the costs that hold until frames have been measured.
  void expect(const FrameCosts::Expected& costs) { costs_.expect(costs); }
  /// Chooses for the frame that is about to be made: sets Station::in_use and `served` of all stations, and rollouts().
  void choose(Stations& stations, Micros now);
  bool rollouts() const { return rollouts_.taken(); }
  /// Learns from a frame that stepped the body, `passed` after the one before. Returns true if nonlinear patches were built
  /// without rollouts.
  bool learn(const FrameResult& result, const Stations& stations, Micros passed);

  /// Called with the scheme of a station that left it to the server: once at the start and at each change.
  std::function<void(const std::string& station, const SchemeInUse&)> on_scheme;

 private:
  Micros patch_cost(Scheme scheme) const { return scheme == Scheme::hyper ? costs_.nonlinear() : costs_.linear(); }
  void choose_schemes(Stations& stations, Micros now);
  void choose_scheme(Station& station, const DetailCost& cost, Micros now);
  void choose_rollouts(Stations& stations, Micros now);
  void choose_served(Stations& stations, Micros now);
  Micros expected_cost(const Station& station, Micros now) const;

  double frame_s_;
  FrameCosts costs_;
  HysteresisSwitch rollouts_;
  Micros next_turn_{};  ///< earliest next turn of stations that do not fit
};

}  // namespace palpate
