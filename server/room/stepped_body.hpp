// The body of a room and the tools on it, moved from frame to frame: room.hpp says by what.
//
// A frame, in this order: samples to tracks, and who left; a reset; ports of those whose tools are on the body
// (stepped_body_tools.cpp); the body is stepped, or sleeps (stepped_body.cpp). A frame that is n > 2 nominal frames long, as it
// fell behind, has steps of n / 2 times their length.
//
// Tools that cost more than hands do (Stepper::advance() gives up) are let go of, those that went farthest in the frame first,
// one, then two more, four more ..., and the frame goes on without them: who costs it feels it. They stay off for kOff, and twice
// as long as before each time that it comes again within kForgiven.
//
// Over a sleeping body the surface stands still, so a tool that was h_0 over it [m] at p_0 is, at p, not lower than
//
//     h >= h_0 - |p - p_0|
//
// and the surface is looked for only where that is not enough (MeasuredHeight).
//
// Tools are numbered as their ports are, k < ports().size(). Stations that share the tool of another have no port of their own.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <vector>

#include "server/body/integrator_selection.hpp"
#include "server/body/settle.hpp"
#include "server/body/stillness.hpp"
#include "server/reduce/tool_prediction.hpp"
#include "server/room/grasp.hpp"
#include "server/room/let_go.hpp"
#include "server/room/room.hpp"
#include "server/room/tool_track.hpp"

namespace palpate {

class SteppedBody {
 public:
  /// How high over the sleeping body a tool was, and where that was measured.
  struct MeasuredHeight {
    Vec3 from = Vec3::Zero();
    double height_m = 0;
    double least_height_m(const Vec3& at) const { return height_m - (at - from).norm(); }
  };

  struct StationTool {
    ToolTrack track;
    std::optional<LetGo> let_go;
    std::optional<MeasuredHeight> measured_height;
    Grasp grasp;
    Micros off{};  ///< that it had to stay off when it cost too much last
    std::optional<Micros> cost_at;
  };

  explicit SteppedBody(const Scene& scene);
  /// As Room's.
  void start(Micros body_time);
  bool resume(const Vector& x, const Vector& v, const Eigen::MatrixXf& relaxed);
  void use_threads(ThreadPool& pool) { integrator_.stepper->use_threads(pool); }

  /// Moves it to the target of the job; nothing where it sleeps until then. Steps that do not converge leave the last good shape,
  /// at rest and let go of.
  std::optional<AdvanceReport> step(const FrameJob& job);

  const Scene& scene() const { return scene_; }
  const Skin& skin() const { return skin_; }
  const Dynamics& dynamics() const { return dynamics_; }
  ChosenStepper& integrator() { return integrator_; }
  double softest_1_s2() const { return softest_1_s2_; }
  const BodyState& rest() const { return rest_; }
  const BodyState& state() const { return body_; }
  Micros time() const { return from_seconds(body_.time_s); }
  /// Until a tool may meet it.
  bool asleep() const { return asleep_; }
  /// Whose tools were let go of in the last step(), as they cost too much.
  const std::vector<StationId>& too_dear() const { return too_dear_; }

  const std::vector<ToolPort>& ports() const { return ports_; }
  /// Where the surface is nearest to a tool that does not touch.
  void move_point(std::size_t k, const SurfacePoint& point) { ports_[k].point = point; }
  /// The port of the tool that a station feels with, and of the station's own.
  std::optional<std::size_t> port_of(const StationJob& job) const;
  std::optional<std::size_t> port_of(StationId id) const;
  /// The tool that a station feels with; null where none has come.
  const StationTool* tool_of(const StationJob& job) const;
  /// Tool k in body time: of a grasp its node goes from where it was taken to the tool.
  ToolAt tool(std::size_t k, Micros t) const { return tool_at(tools_.at(port_owner_[k]), t); }
  /// Of the hand at tool k: of the parabola through where it was now and 30 and 60 ms ago; where it came since its velocity
  /// alone.
  HandMotion hand_motion(std::size_t k) const;
  /// Where the surface is nearest to tool k at `tool`, if it is nearer than `far_m`. Over a sleeping body it is looked for only
  /// when the tool may have got so near since it was looked for last. `positions()`: of the skin's vertices.
  std::optional<NearestPoint> nearest_within(std::size_t k, const Vec3& tool, double far_m,
                                             const std::function<const std::vector<double>&()>& positions);

 private:
  static constexpr Micros kOff{1'000'000}, kOffMost{32'000'000}, kForgiven{60'000'000};
  ToolAt tool_at(const StationTool& tool, Micros t) const {
    return scene_.tool.contact == ContactKind::attach ? tool.grasp.at(tool.track, t) : tool.track.at(t);
  }
  void take_samples(const FrameJob& job);
  void sync_ports(const FrameJob& job);
  void reset();
  void leave_out_until(Micros begin);
  void let_go_of(std::size_t k, Micros off);
  bool let_go_of_dearest(std::size_t most, Micros begin, Micros until);
  bool stays_off(StationTool& tool);
  void fall_asleep();
  bool sleeps_through(const FrameJob& job);
  bool may_meet(std::size_t k, Micros until);
  AdvanceReport advance(const FrameJob& job);

  Scene scene_;
  Skin skin_;
  Dynamics dynamics_;
  ChosenStepper integrator_;
  BodyState rest_, body_;
  double softest_1_s2_;
  Stillness stillness_;
  bool asleep_ = false;
  std::vector<double> placed_;  // where the skin of a sleeping body is
  std::map<StationId, StationTool> tools_;
  std::vector<StationId> too_dear_;
  std::vector<ToolPort> ports_;
  std::vector<StationId> port_owner_;  // parallel to ports_
};

}  // namespace palpate
