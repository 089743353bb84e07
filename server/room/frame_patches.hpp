// The patches of a frame: what each station needs to render the body until the next one. Work that they share is done once
// (FrameModel); then one patch is built per station (patch_build.hpp), with snapshots of the states that the body may reach
// (StatePrediction).
//
// A patch of a sleeping body is reused (Kept) as long as the tool at p with velocity v, tau the horizon, satisfies
//
//     |p - p'| <= kKeptToolM,     tau |v - v'| <= kKeptAheadM,     |tau - tau'| <= kKeptHorizonShare tau
//
// where p', v', tau' are those that it was made for, and scheme, order and silence are unchanged.
//
// A station whose tool was released (release_fade.hpp) gets a constant patch with the fading force.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "server/reduce/patch_build.hpp"
#include "server/room/deadband.hpp"
#include "server/room/state_prediction.hpp"
#include "server/room/stepped_body.hpp"

namespace palpate {

class FramePatches {
 public:
  /// `body` must outlive it.
  explicit FramePatches(SteppedBody& body);
  /// Forgets all stations and all predictions of the body.
  void clear();
  /// Drops the patches of the sleeping body, once the body has been stepped.
  void forget_kept();
  /// Builds the patches of a frame after its step, for the stations of the job in order; without patches if `failed`.
  std::vector<StationFrame> build(const FrameJob& job, bool failed);
  /// Returns the modes of the newest patch that the station got, over all nodes; empty if it has got none.
  Matrix modes(StationId id) const;
  void listen(std::function<void(BuildPhase)> listener) { frame_model_.listen(std::move(listener)); }

 private:
  /// The last patch of a sleeping body, valid while the body sleeps and the tool hardly moves.
  struct Kept {
    PatchRequest request;
    Patch patch;
    NonlinearTerms terms;
    bool serves(const PatchRequest& asked, const ToolAt& tool) const;
  };

  struct Station {
    std::optional<Kept> kept;
    PatchModes modes;  // of the newest patch that was built
    Deadband deadband;
    std::uint32_t seq = 0;
  };

  void sync_stations(const FrameJob& job);
  /// `which`: port_of() the station.
  PatchRequest request_of(const StationJob& job, std::size_t which) const;
  /// Returns for each station whether it gets a patch.
  std::vector<std::uint8_t> begin(const FrameJob& job, bool failed);
  bool in_reach(std::size_t which, Micros horizon);
  void collect_snapshots(const FrameJob& job, const std::vector<std::uint8_t>& gets_patch, Micros horizon);
  /// Returns the patch that the station got last if it still equals what a new one would say; else null.
  const Kept* kept_for(const StationJob& job, std::size_t which) const;
  void give_patch(const StationJob& job, std::size_t which, StationFrame& frame);
  void give_fading_force(const StationJob& job, Micros stamp, StationFrame& frame);
  StationFrame frame_of(const StationJob& job, Micros stamp, bool gets_patch);

  SteppedBody* body_;
  FrameModel frame_model_;
  StatePrediction prediction_;
  std::map<StationId, Station> stations_;
};

}  // namespace palpate
