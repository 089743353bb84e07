// The patches of a frame: what each station needs to render the body until the next one. Work that they share is done once
// (FrameModel); then one patch is built per station (patch_build.hpp), with snapshots of the states that the body may reach
// (StatePrediction).
//
// A patch of a sleeping body is reused (CachedPatch) as long as the tool at p with velocity v, tau the horizon, satisfies
//
//     |p - p'| <= kCachedToolM,     tau |v - v'| <= kCachedAheadM,     |tau - tau'| <= kCachedHorizonShare tau
//
// where p', v', tau' are those that it was made for, and scheme, order and silence are unchanged.
//
// A station whose tool was released (tool_coupling.hpp) gets a constant patch with the fading force.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "server/reduction/patch_build.hpp"
#include "server/room/deadband.hpp"
#include "server/room/state_prediction.hpp"
#include "server/room/stepped_body.hpp"

namespace palpate {

class FramePatches {
 public:
  /// `body` must outlive it.
  explicit FramePatches(SteppedBody& body);
  /// Forgets all stations.
  void clear() { stations_.clear(); }
  /// Takes up the body where its cells and nodes have changed (SteppedBody::epoch()).
  void renew();
  /// Drops the patches of the sleeping body, once the body has been stepped.
  void drop_cached();
  /// Builds the patches of a frame after its step, for the stations of the job in order; without patches if `failed`.
  std::vector<StationFrame> build(const FrameJob& job, bool failed);
  /// Returns the modes of the newest patch that the station got, over all nodes; empty if it has got none.
  Matrix modes(StationId id) const;
  void listen(std::function<void(BuildPhase)> listener) { frame_model_->listen(std::move(listener)); }

 private:
  /// The last patch of a sleeping body, valid while the body sleeps and the tool hardly moves.
  struct CachedPatch {
    PatchRequest request;
    Patch patch;
    NonlinearTerms terms;
    bool serves(const PatchRequest& asked, const ToolAt& tool) const;
  };
  struct Station {
    std::optional<CachedPatch> cached;
    PatchModes modes;  // of the newest patch that was built
    Deadband deadband;
    std::uint32_t seq = 0;
  };
  /// The share of one station in a frame.
  struct Task {
    const StationJob* job = nullptr;
    Station* station = nullptr;
    std::vector<std::size_t> parts;   // ports of its tool; empty: it is released, or has no samples
    std::optional<std::size_t> port;  // of these the one that touches most, or else is nearest
    bool builds = false, reuses = false;
    PatchRequest request;
  };

  void sync_stations(const FrameJob& job);
  void begin_model(const FrameJob& job, Micros mean_horizon);
  Task task_of(const StationJob& job);
  std::optional<double> height_in_reach(std::size_t port, Micros horizon, double sudden_m);
  void choose_port(Task& task, Micros horizon);
  void set_pose(const Task& task, StationFrame& frame) const;
  StationFrame frame_of(const Task& task, Micros stamp);
  void give_patch(const Task& task, StationFrame& frame);
  void give_fading_force(const StationJob& job, Micros stamp, StationFrame& frame);

  SteppedBody* body_;
  std::unique_ptr<FrameModel> frame_model_;
  std::optional<StatePrediction> prediction_;
  std::map<StationId, Station> stations_;
};

}  // namespace palpate
