// The body of a room and its tools, advanced from frame to frame by the equations of room.hpp.
//
// A frame, in this order: samples are added to tracks, and tools of stations that left are removed; a reset; ports for tools that
// join (stepped_body_tools.cpp); the body is stepped, or sleeps (stepped_body.cpp). A frame that fell behind and is n > 2 nominal
// frames long uses steps of n / 2 times their length.
//
// Cells part at the end of a frame. A body that tears fast (LiveCuts::due_s()) is looked at kMostLooks times a frame at most, and
// tears by a row at each: a fast tear that waits for the end of a frame would take too much work.
//
// A press of a button ties the thread in the hand at its last bite, and the hand takes the next one; the hand that holds none
// cuts the span of a thread within kScissorsM of its tool. With a needle that has the threads a press draws one through once the
// tip has come out of the body again, and then the hand holds its end; a press ties it if it is taut, and else takes the needle
// for the next bites.
//
// A tool that leaps, along its path at ToolTrack::kFastestMs for 20 mm of the frame, as no hand does, is released for kOff before
// it throws the body. If the tools cost more than hands do all the same (Stepper::advance() gives up), the frame begins again
// with the body at rest, and then without some tools, those with the longest path in the frame first: one, two more, four more
// ..., so that the hands that cause the cost bear it.
//
// Tools have the numbers of their ports, k < ports().size(). Stations that share the tool of another have no port of their own.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "common/player/predictability.hpp"
#include "server/body/needle_tissue.hpp"
#include "server/body/settle.hpp"
#include "server/body/stillness.hpp"
#include "server/dynamics/integrator_selection.hpp"
#include "server/reduction/tool_prediction.hpp"
#include "server/room/live_cuts.hpp"
#include "server/room/room.hpp"
#include "server/room/tool_coupling.hpp"
#include "server/room/tool_track.hpp"
#include "server/room/touched_allowance.hpp"

namespace palpate {

class SteppedBody {
 public:
  struct StationTool {
    ToolTrack track;
    Predictability past;  ///< of its path up to `noted`
    Micros noted{};
    FadingVector grasp;  ///< from the tool to its node
    std::optional<ReleaseFade> fade;
    bool costly = false;        ///< true: it fades because it cost too much
    std::uint32_t presses = 0;  ///< of its buttons, up to now
    std::uint8_t held = 0;      ///< number of it in the scene
    bool pulls = false;         ///< true: of a needle, the hand has drawn its thread through and holds the end
  };

  /// `like`: a body of the same scene, whose state at rest, kind of stepper and softest mode are copied, not computed
  /// again.
  explicit SteppedBody(const Scene& scene, const SteppedBody* like = nullptr);
  /// Same as in Room.
  void start(Micros body_time);
  bool resume(const Vector& x, const Vector& v, const Eigen::MatrixXf& relaxed,
              std::shared_ptr<const SutureState> threads = nullptr);
  /// Cuts the body at rest as it was cut; returns the change of the scene's, none without cuts. Call it before resume().
  std::optional<CutChange> cut_again(const std::vector<CutStep>& cuts);
  void use_threads(ThreadPool& pool) { integrator_.stepper->use_threads(pool); }

  /// Advances the body to the target of the job; returns none if it sleeps until then. Steps that do not converge leave the last
  /// good shape, at rest and released.
  std::optional<AdvanceReport> step(const FrameJob& job);

  const Scene& scene() const { return scene_; }
  const Skin& skin() const { return skin_; }
  const Dynamics& dynamics() const { return *dynamics_; }
  ChosenStepper& integrator() { return integrator_; }
  double softest_1_s2() const { return softest_1_s2_; }
  const BodyState& rest() const { return rest_; }
  const BodyState& state() const { return body_; }
  Micros time() const { return from_seconds(body_.time_s); }
  /// Returns true until a tool may meet the body.
  bool asleep() const { return asleep_; }
  /// Number of the body's present cells, nodes and surface, which cuts and tears change.
  std::uint32_t epoch() const { return epoch_; }
  /// The change of them by the last step(); null where they are the same, or those of the scene again.
  const CutChange* parted() const { return parted_ ? &*parted_ : nullptr; }
  /// The body as its scene has it.
  const LumpedBody& begun() const { return cuts_ ? cuts_->begun() : scene_.body; }
  const BodyState& rest_begun() const { return cuts_ ? cuts_->rest_begun() : rest_; }
  /// Cuts and tears since then; null: none.
  std::shared_ptr<const std::vector<CutStep>> cuts() const { return cuts_ ? cuts_->steps() : nullptr; }
  /// Returns the stations whose tools were released in the last step() because they cost too much.
  const std::vector<StationId>& released() const { return released_; }
  /// Returns the changes of threads in the last step().
  const SutureNews& suture_news() const { return suture_news_; }
  /// Returns the thread that the needle of the first hand has, unless a hand holds its end.
  std::optional<ThreadOnNeedle> thread_on_needle() const;

  /// Ports have the station of their tool as their tool's number; a tool with a body has one for each of its spheres, a needle
  /// those of needle_ports.hpp.
  const std::vector<ToolPort>& ports() const { return ports_; }
  /// Sets the nearest point of the surface to a tool that does not touch.
  void move_point(std::size_t k, const SurfacePoint& point) { ports_[k].point = point; }
  /// Sets the paths that needles which are outside would take (needle_ports.hpp).
  void predict_paths();
  /// Returns the ports of the tool that a station feels with; for an id, those of that station's own tool.
  std::vector<std::size_t> ports_of(const StationJob& job) const;
  std::vector<std::size_t> ports_of(StationId id) const;
  /// Returns the tool that a station feels with; null if it has no samples.
  const StationTool* tool_of(const StationJob& job) const;
  /// Returns what the tool that a station feels with is; the scene's first if that has no samples.
  const ToolSpec& spec_of(const StationJob& job) const;
  /// Returns the tool of port k in body time, of a body the centre of its sphere; in a grasp its node moves from where it was
  /// grasped to the tool.
  ToolAt tool(std::size_t k, Micros t) const { return tool_at(tools_.at(ports_[k].tool), ports_[k].sphere, t); }
  /// Returns the motion of the hand at tool k, from the parabola through its positions now and 30 and 60 ms ago; without samples
  /// that old, its velocity alone.
  HandMotion hand_motion(std::size_t k) const;
  /// Returns the share of it that the hand's own past shows to be predictable, and how far it comes back of a swing
  /// (predictability.hpp): the motion that the other stations' patches expect.
  HandMotion predictable_motion(std::size_t k) const;
  /// Returns the nearest point of the surface as the tool of port k meets it to `tool`, if it is nearer than `far_m`.
  std::optional<NearestPoint> nearest_within(std::size_t k, const Vec3& tool, double far_m) const;

 private:
  static constexpr Micros kOff{1'000'000};
  static constexpr double kScissorsM = 0.004;
  static constexpr int kMostLooks = 4;
  static ToolAt tool_at(const StationTool& tool, const ToolSphere& sphere, Micros t) {
    return moved_by(tool.track.turning(t).centre_of(sphere), tool.grasp, t);
  }
  void take_samples(const FrameJob& job);
  void note_past(StationTool& tool, Micros horizon) const;
  void use_buttons(const FrameJob& job);
  void sync_ports(const FrameJob& job);
  bool holds_thread() const;
  std::optional<std::uint32_t> next_thread() const;
  bool draw_through(StationId id);
  void let_threads_go();
  void reset();
  void leave_out_until(Micros begin);
  void release_tool(StationId id, Micros off);
  void release_costly(StationId id);
  void release_leaping(Micros begin, Micros until);
  bool release_longest(std::size_t most, Micros begin, Micros until);
  void begin_again(const BodyState& before, const std::vector<ToolPort>& ports_before);
  bool stays_off(StationTool& tool) const;
  void fall_asleep();
  bool sleeps_through(const FrameJob& job) const;
  bool may_meet(std::size_t k, Micros until) const;
  AdvanceReport advance(const FrameJob& job);
  AdvanceReport advance(Micros until, double step_s);
  void cut_on();
  void renew_steppers();

  Scene scene_;
  Skin skin_;
  std::unique_ptr<NeedleTissue> tissue_;  // where the tools are needles
  std::optional<Dynamics> dynamics_;
  ChosenStepper integrator_;
  TouchedAllowance allowance_;
  BodyState rest_, body_;
  double softest_1_s2_;
  std::optional<Stillness> stillness_;
  std::optional<LiveCuts> cuts_;  // of one that blades cut, or that tears
  std::uint32_t epoch_ = 0;
  std::optional<CutChange> parted_;  // in the last step()
  bool asleep_ = false;
  std::map<StationId, StationTool> tools_;
  std::vector<StationId> released_;
  SutureNews suture_news_;
  std::vector<ToolPort> ports_;
};

}  // namespace palpate
