// What a room keeps from frame to frame, and the steps that a frame is made of. For the files of this room only.
//
// A frame, in this order: samples to tracks, and who left (room_stations.cpp); a reset (room_reset.cpp); ports of those whose
// tools are on the body; the body is stepped, or sleeps (room_sleep.cpp); what patches have in common, snapshots of where the
// body may be (room_rollouts.cpp), and a patch for each station (room_patches.cpp). A frame that is n > 2 nominal frames long, as
// it fell behind, has steps of n / 2 times their length.
//
// Over a sleeping body the surface stands still, so a tool that was h_0 over it [m] at p_0 is, at p, not lower than
//
//     h >= h_0 - |p - p_0|
//
// and the surface is looked for only where that is not enough (MeasuredHeight). A patch of a sleeping body is given again (Kept)
// as long as the tool at p with velocity v, tau the horizon, has
//
//     |p - p'| <= kKeptToolM,     tau |v - v'| <= kKeptAheadM,     |tau - tau'| <= kKeptHorizonShare tau
//
// p', v', tau' those that it was made for, scheme, order and silence the same.
#pragma once

#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "server/body/integrator_selection.hpp"
#include "server/body/settle.hpp"
#include "server/body/stillness.hpp"
#include "server/reduce/patch_builder.hpp"
#include "server/room/deadband.hpp"
#include "server/room/grasp.hpp"
#include "server/room/let_go.hpp"
#include "server/room/room.hpp"
#include "server/room/rough_steps.hpp"
#include "server/room/snapshot_cache.hpp"
#include "server/room/tool_track.hpp"

namespace palpate {

struct Room::State {
  /// How high over the sleeping body a tool was, and where that was measured.
  struct MeasuredHeight {
    Vec3 from = Vec3::Zero();
    double height_m = 0;
    double least_height_m(const Vec3& at) const { return height_m - (at - from).norm(); }
  };

  /// The last patch of a sleeping body: it holds as long as the body sleeps, for a tool that hardly moves.
  struct Kept {
    PatchRequest request;
    Patch patch;
    NonlinearTerms terms;

    bool serves(const PatchRequest& asked, const ToolAt& tool) const {
      // Many times a hand's tremor of 0.2 mm, and less than nodes are apart; more: older patches.
      constexpr double kKeptToolM = 0.001, kKeptAheadM = 0.005, kKeptHorizonShare = 0.1;
      const double horizon_s = seconds(asked.horizon);
      return asked.scheme == request.scheme && asked.order == request.order && asked.silence == request.silence &&
             std::abs(horizon_s - seconds(request.horizon)) <= kKeptHorizonShare * horizon_s &&
             (tool.position - patch.tool).norm() <= kKeptToolM &&
             horizon_s * (tool.velocity - patch.tool_velocity).norm() <= kKeptAheadM;
    }
  };

  struct Station {
    ToolTrack track;
    std::optional<LetGo> let_go;
    std::optional<MeasuredHeight> measured_height;
    std::optional<Kept> kept;
    Grasp grasp;
    std::unique_ptr<PatchBuilder> builder;
    PatchModes modes;  // of the newest patch that was built
    Deadband deadband;
    std::uint32_t seq = 0;
  };

  explicit State(const Scene& s)
      : scene(s), skin(scene.body, scene.tool.radius_m), dynamics(scene.body), integrator(choose_stepper(scene, dynamics, skin)) {
    if (!integrator.stepper->leaves_no_trace() || scene.body.is_solid()) roughly.emplace(dynamics, skin);
    fall_asleep();
  }

  // The tool of a station in body time: for a grasp the node goes from where it was taken to the tool.
  ToolAt tool_at(const Station& station, Micros t) const {
    return scene.tool.contact == ContactKind::attach ? station.grasp.at(station.track, t) : station.track.at(t);
  }
  void take_samples(const FrameJob& job);
  void sync_ports(const FrameJob& job);
  // room_reset.cpp
  void reset_body();
  bool stays_off(Station& station);
  void show_nothing(const StationJob& job, Micros stamp, StationFrame& frame);
  void fall_asleep();
  bool sleeps_through(const FrameJob& job);
  bool may_meet(std::size_t which, Micros until);
  std::optional<NearestPoint> nearest_within(std::size_t which, const Vec3& tool, double far_m,
                                             const std::function<const std::vector<double>&()>& positions);
  AdvanceReport advance(const FrameJob& job);
  Vec3 hand_acceleration(const Station& station) const;
  /// `which`: port_of() the station.
  PatchRequest request_of(const StationJob& job, std::size_t which) const;
  /// A rollout from where the body is: `snapshot` gets which of kRolloutSnapshots moments it is, and x; roughly, it gets
  /// kRoughRolloutSnapshots of them.
  bool roll_out(double over_s, const ToolMotion& tool, const std::function<void(int, const Vector&)>& snapshot);
  std::size_t affordable_rollouts(Micros horizon);
  std::vector<PredictedState> hand_rollouts(Micros horizon);
  void warm_start(const std::vector<std::size_t>& feeling);
  void add_cached(const std::vector<std::size_t>& feeling, std::vector<PredictedState>& predicted);
  void collect_snapshots(const FrameJob& job, const std::vector<std::uint8_t>& gets_patch, Micros horizon);
  /// The port of the tool that a station feels with.
  std::optional<std::size_t> port_of(const StationJob& job) const;
  /// For each station whether it gets a patch.
  std::vector<std::uint8_t> begin_patches(const FrameJob& job);
  bool in_reach(std::size_t which, Micros horizon);
  /// The patch that the station got last, where it still says what a new one would.
  const Kept* kept_for(const StationJob& job, std::size_t which) const;
  void give_patch(const StationJob& job, std::size_t which, StationFrame& frame);
  StationFrame frame_of(const StationJob& job, Micros stamp, bool gets_patch);

  Scene scene;
  Skin skin;
  Dynamics dynamics;
  ChosenStepper integrator;
  std::optional<RoughSteps> roughly;  // where `integrator` cannot roll out, or takes more small steps than that is worth
  BodyState rest = settled_state(dynamics, scene.name), body = rest;
  BalancedBases balanced{dynamics, skin, rest};
  double softest_1_s2 = softest_stiffness(dynamics);
  Stillness stillness{dynamics, softest_1_s2, rest.x};
  bool asleep = false;
  std::vector<double> placed;  // where the skin of a sleeping body is
  std::map<StationId, Station> stations;
  std::vector<StationId> port_owner;  // parallel to ports
  std::vector<ToolPort> ports;
  FrameModel frame_model{dynamics, skin};
  SnapshotCache snapshot_cache{mean_edge_m(scene.body)};
  std::deque<Vec3> warm_started;  // places on the body at rest
};

}  // namespace palpate
