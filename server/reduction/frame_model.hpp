// The computations that the patches of one frame share: the linearised body under all tools, and its responses at their ports.
//
// With P = s^2 M + s D + K at the state (x*, v*) and U_k the input of port k (shared_system.hpp), patches are made of
//     X_k = P^-1 U_k,   P^-1 F,   P^-1 M v*,      F = F(x*, v*) + sum_k B_k lambda_k  over the tools that touch
// so a frame needs three solves per tool (five or six if it may slide: P^-1 (B_end lambda_end - B lambda), lambda_end rotated
// with the normal, tool_prediction.hpp) and two for all, at one shift s. A model hardly suffers from an s that is not quite its
// own: with one tool s is that of its patch, with several that of their mean horizon.
//
// A frame is seen in the coordinates of one or two operators (BodyFrame): those of a locally refined body (refined_body.hpp), if
// the body suits, and those of the whole body, which serve where P of the first is not definite.
//
// Shapes: n coordinates of three numbers (body_operator.hpp); x*, v*, F 3 n [m], [m/s], [N]; M, D, K, P 3 n x 3 n, P [N/m]; s
// [1/s]; lambda 3 [N].
// Failures: P is not positive definite where a compressed body softens; then there is no system (system(), respond()); `clamp`
// drops the softening.
#pragma once

#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>

#include "server/dynamics/integrator.hpp"
#include "server/dynamics/needle_ports.hpp"
#include "server/reduction/basis.hpp"
#include "server/reduction/build_phase.hpp"
#include "server/reduction/shared_system.hpp"
#include "server/reduction/snapshot_set.hpp"
#include "server/reduction/static_indentation.hpp"
#include "server/reduction/tool_prediction.hpp"

namespace palpate {

/// A predicted state of the body within the life of the next patches.
struct PredictedState {
  SnapshotKind kind = SnapshotKind::rollout;
  double weight = 1;  ///< of the resulting snapshot
  Vector x;
};

class BodyFrame;

class FrameModel {
 public:
  static constexpr std::size_t kHistoryFrames = 4;  ///< more improved some bodies and hurt others (docs/notebook.md, 23)
  static constexpr double kHistorySpacingS = 0.04;  ///< less than the 50 ms of a frame at 20 Hz: there each counts

  /// `softest_1_s2`: lower bound of a mode's stiffness in a patch, softest_stiffness() of the body.
  FrameModel(const Dynamics& dynamics, const Skin& skin, double softest_1_s2);
  ~FrameModel();
  FrameModel(const FrameModel&) = delete;

  /// Continues a model of the body before it was cut: `node_before` of each node, none where that is another body.
  void succeed(FrameModel& before, std::span<const std::uint32_t> node_before);
  /// Starts a new frame: the arguments must outlive it, and the ports' points must be final before the first patch is built.
  /// `tools` are parallel to `ports`; `horizon` is the mean of the coming patches.
  void begin(const BodyState& state, const std::vector<ToolPort>& ports, std::span<const ToolAt> tools, Micros horizon);
  /// Announces a patch for this port, even if it does not touch: its responses are computed with those of the others, and those
  /// to the load where it may have slid to, minus its present load: B_end lambda_end - B lambda.
  void request_patch(std::size_t k, const ExpectedSlide& slide = {});
  /// Sets the motion of the hands at the ports; the default is that of the tools, without acceleration.
  void set_hands(std::vector<HandMotion> hands);
  /// Sets the predicted states for snapshots of this frame; the default is none.
  void set_predicted_states(std::vector<PredictedState> states) { predicted_ = std::move(states); }
  /// Sets a listener that is called when each part begins. The model itself reads no clock.
  void listen(std::function<void(BuildPhase)> listener) { listener_ = std::move(listener); }
  void enter(BuildPhase part) const {
    if (listener_) listener_(part);
  }

  /// The frame in the coordinates of a locally refined body, if the body suits, and of the whole body, in this order.
  std::span<const std::unique_ptr<BodyFrame>> bodies() const { return bodies_; }
  BodyFrame& refined() { return *bodies_.front(); }
  BodyFrame& whole() { return *bodies_.back(); }

  const Dynamics& dynamics() const { return *dynamics_; }
  const Skin& skin() const { return *skin_; }
  double softest_1_s2() const { return softest_1_s2_; }
  double extent_m() const { return extent_m_; }    ///< diagonal of the box around the body at rest
  double spacing_m() const { return spacing_m_; }  ///< mean length of its edges
  const BodyState& state() const { return *state_; }
  const std::vector<ToolPort>& ports() const { return *ports_; }
  const ToolAt& tool(std::size_t k) const { return tools_[k]; }
  bool is_wanted(std::size_t k) const { return wanted_[k].has_value(); }
  const std::vector<PredictedState>& predicted_states() const { return predicted_; }
  /// Positions in the last frames in which this was called, at least kHistorySpacingS apart, from the oldest on.
  std::span<const Vector> history();
  /// Returns the path of tool k that a patch with this horizon assumes.
  HandMotion path(std::size_t k, Micros horizon) const { return expected_path(hands_.at(k), seconds(horizon)); }
  /// Returns the shift for a patch with this horizon in this frame.
  double shift(Micros horizon) const;
  /// Returns true if both ports are spheres of one tool.
  bool is_same_tool(std::size_t a, std::size_t b) const { return ports()[a].tool == ports()[b].tool && has_body(a); }
  /// Returns true if the tool of the port is not a point.
  bool has_body(std::size_t k) const { return ports()[k].body; }
  /// Returns true if any part of the tool of the port moves with its opening.
  bool has_jaws(std::size_t k) const {
    return std::ranges::any_of(ports(),
                               [&](const ToolPort& port) { return port.tool == ports()[k].tool && port.sphere.opens(); });
  }
  /// Returns the vector from the point of a port to the tool there, the lowest point of its sphere [m].
  Vec3 gap(std::size_t k);
  /// Returns the positions of the skin's vertices.
  const std::vector<double>& positions();
  /// Returns the outward normal of the surface at a port.
  Vec3 normal(std::size_t k) { return normal_at(skin_->view(), positions(), ports()[k].point); }
  /// Returns the position of a port on the body at rest.
  Vec3 place_of(const ToolPort& port) const;
  /// A load that slides with its tool: weights on the skin and forces, to be added.
  struct SlidingLoad {
    SurfacePoint end;
    Vec3 lambda_end;
  };
  /// Returns lambda_end and where it acts for each expected slide of a wanted port; empty if its tool does not touch, or slides
  /// are not requested.
  std::vector<SlidingLoad> sliding_loads(std::size_t k);
  /// Returns true if the tool touches the surface, or will within `horizon` on its expected path.
  bool will_touch(std::size_t k, Micros horizon);
  /// Returns snapshots around the place of port k (static_indentation.hpp).
  StaticIndentations& indentations(std::size_t k);

 private:
  const Dynamics* dynamics_;
  const Skin* skin_;
  double softest_1_s2_, extent_m_ = 0, spacing_m_ = 0;
  const BodyState* state_ = nullptr;
  const std::vector<ToolPort>* ports_ = nullptr;
  std::vector<ToolAt> tools_;
  std::vector<HandMotion> hands_;
  std::vector<std::optional<ExpectedSlide>> wanted_;
  Micros horizon_{};
  std::vector<PredictedState> predicted_;
  std::vector<Vector> history_;
  double history_time_s_ = 0;                     // of the last entry of history_
  std::optional<std::pair<double, Vector>> now_;  // time and positions of this frame, the next entry of history_
  std::vector<double> positions_;
  std::map<std::size_t, StaticIndentations> indentations_;
  std::function<void(BuildPhase)> listener_;
  std::vector<std::unique_ptr<BodyFrame>> bodies_;
};

/// A frame in the coordinates of one operator. What it computes is kept until the next frame.
class BodyFrame {
 public:
  BodyFrame(FrameModel& frame, std::unique_ptr<BodyOperator> body);
  /// Starts a new frame.
  void begin();

  /// Coordinates that the tools and the scene hold.
  const std::vector<std::uint8_t>& held();
  /// Returns the linearisation; Linearisation::part is that of the last select_subdomain().
  Linearisation linearisation();
  /// Selects the neighbourhood of this tool, for a locally refined body, as Linearisation::part.
  void select_subdomain(std::size_t which);
  /// Returns the coordinate of a node that is held, or near a tool.
  std::uint32_t coordinate(std::uint32_t node) const { return body_->coordinate(node); }
  /// Returns B at a point of the skin, and at the point of the body at which a port pushes.
  NodeWeights weights(const SurfacePoint& point) const { return body_->restricted(frame_->skin().weights(point)); }
  NodeWeights weights(const ToolPort& port) const { return body_->restricted(weights_of(frame_->skin(), port)); }
  /// Returns the displacements of the coordinates from the present state to those of the last frames, to the predicted states and
  /// to rest, in this order.
  const SnapshotSet& snapshots();
  /// Returns F(x*, v*), with zero rows for held nodes, and the same with the forces of all touching tools.
  const Vector& forces();
  const Vector& total();
  /// Returns BodyOperator::fading().
  const std::vector<Vector>& fading();

  /// Returns P; nullptr if it is not positive definite. `tolerance`: of its solves.
  SharedSystem* system(SystemKey key, double tolerance);
  /// Computes the responses of P at all points of the surface that tools touch or that are wanted, at port `which`, and where
  /// `own` is true to the body's own loads, F* and M v*. Returns false if P is found not to be positive definite.
  bool respond(SharedSystem& p, std::size_t which, bool own);

 private:
  /// Determines the held nodes, and the coordinates of a locally refined body.
  void settle();
  /// Returns B_end lambda_end - B lambda for each expected slide of a port.
  std::vector<Vector> sliding_loads(std::size_t k);

  FrameModel* frame_;
  std::unique_ptr<BodyOperator> body_;
  std::map<std::size_t, NonlinearSubdomain> subdomains_;  // per tool
  const NonlinearSubdomain* subdomain_ = nullptr;
  bool settled_ = false, linearised_ = false;
  std::vector<std::uint8_t> held_;
  std::optional<Vector> forces_, total_;
  std::optional<std::vector<Vector>> fading_;
  std::optional<SnapshotSet> snapshots_;
  std::deque<SharedSystem> systems_;  // the first `systems_used_` belong to this frame
  std::size_t systems_used_ = 0;
};

/// Returns 2 / horizon within bounds [1/s].
double shift_for(Micros horizon);

}  // namespace palpate
