// What a room has time for in the next frame: the scheme of each station that left it to the server, then rollouts, then whose
// patches are built.
//
// Body and patches may take kSchemesMayTake of a frame for the sake of the nonlinear scheme, kRolloutsMayTake for the sake of
// rollouts, which leave time for datagrams, viewers and the scheduler, and for frames that take longer than others; the nonlinear
// scheme, which buys far more than the milliseconds that it makes patches older by, is given up where frames would be skipped.
// What things cost is learnt from the frames (frame_costs.hpp), what is done is chosen with hysteresis (detail_choice.hpp).
//
// Patches of a frame may take what the step leaves of kSchemesMayTake, and kPatchesMayTake of the frame at least. Where those of
// all stations that touched the body lately take longer, who came first, hands before shadows, is served first, the first of all
// in any case, until half of the time is spent; the other half goes round among the rest, who waited longest first. A station for
// which there is no time keeps its tool on the body and plays the patch that it has. A tool in the air counts with one in
// kMayTouch of what its patch would take. One that never fits is served all the same once in kTurnEvery times as long as its
// patch takes. So the first hand keeps its rate, whoever else comes and whatever for.
#pragma once

#include <functional>
#include <string>

#include "server/core/frame_costs.hpp"
#include "server/core/station.hpp"
#include "server/room/room.hpp"

namespace palpate {

class FrameDetail {
 public:
  static constexpr double kSchemesMayTake = 0.95, kRolloutsMayTake = 0.8, kPatchesMayTake = 0.5;
  static constexpr Micros kTouchKept{60'000'000};  ///< that a patch counts with its cost after it was asked for last
  static constexpr int kTurnEvery = 20, kMayTouch = 4;
  explicit FrameDetail(double rate_hz) : frame_s_(1 / rate_hz) {}

  /// For the frame that is about to be made: Station::in_use and `served` of all, rollouts().
  void choose(Stations& stations, Micros now);
  bool rollouts() const { return rollouts_.taken(); }
  /// From a frame that stepped the body, `passed` after the one before. True where nonlinear patches were built without rollouts.
  bool learn(const FrameResult& result, const Stations& stations, Micros passed);

  /// Hears what a station gets that left the scheme to the server: first, and at each change.
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
  DetailChoice rollouts_;
  Micros next_turn_{};  ///< of stations that do not fit
};

}  // namespace palpate
