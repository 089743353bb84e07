// The patches of a frame: what each station needs to feel the body until the next one. What they have in common is computed once
// (FrameModel), then a patch is built for each (PatchBuilder), with snapshots of where the body may be (StatePrediction).
//
// A patch of a sleeping body is given again (Kept) as long as the tool at p with velocity v, tau the horizon, has
//
//     |p - p'| <= kKeptToolM,     tau |v - v'| <= kKeptAheadM,     |tau - tau'| <= kKeptHorizonShare tau
//
// p', v', tau' those that it was made for, scheme, order and silence the same.
//
// A station whose tool was let go of (let_go.hpp) gets a constant patch with the force that fades.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "server/reduce/patch_builder.hpp"
#include "server/room/deadband.hpp"
#include "server/room/state_prediction.hpp"
#include "server/room/stepped_body.hpp"

namespace palpate {

class FramePatches {
 public:
  /// `body` must outlive it.
  explicit FramePatches(SteppedBody& body);
  /// Of stations and of what the body may do: begin anew.
  void clear();
  /// The body has been stepped: no patch of a sleeping body serves any more.
  void forget_kept();
  /// Once the body is where it is in this frame, for the stations of the job in order; without patches where `failed`.
  std::vector<StationFrame> build(const FrameJob& job, bool failed);
  /// Of the newest patch that a station got, of all nodes; none where it has got none.
  Matrix modes(StationId id) const;
  void listen(std::function<void(PatchPart)> listener) { frame_model_.listen(std::move(listener)); }

 private:
  /// The last patch of a sleeping body: it holds as long as the body sleeps, for a tool that hardly moves.
  struct Kept {
    PatchRequest request;
    Patch patch;
    NonlinearTerms terms;
    bool serves(const PatchRequest& asked, const ToolAt& tool) const;
  };

  struct Station {
    std::optional<Kept> kept;
    std::unique_ptr<PatchBuilder> builder;
    PatchModes modes;  // of the newest patch that was built
    Deadband deadband;
    std::uint32_t seq = 0;
  };

  void sync_stations(const FrameJob& job);
  /// `which`: port_of() the station.
  PatchRequest request_of(const StationJob& job, std::size_t which) const;
  /// For each station whether it gets a patch.
  std::vector<std::uint8_t> begin(const FrameJob& job, bool failed);
  bool in_reach(std::size_t which, Micros horizon);
  void collect_snapshots(const FrameJob& job, const std::vector<std::uint8_t>& gets_patch, Micros horizon);
  /// The patch that the station got last, where it still says what a new one would.
  const Kept* kept_for(const StationJob& job, std::size_t which) const;
  void give_patch(const StationJob& job, std::size_t which, StationFrame& frame);
  void give_fading_force(const StationJob& job, Micros stamp, StationFrame& frame);
  StationFrame frame_of(const StationJob& job, Micros stamp, bool gets_patch);

  SteppedBody* body_;
  BalancedBases balanced_;
  FrameModel frame_model_;
  StatePrediction prediction_;
  std::map<StationId, Station> stations_;
};

}  // namespace palpate
