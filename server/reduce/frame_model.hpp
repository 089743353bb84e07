// The computations that the patches of one frame share: the linearised body under all tools, and its responses at their ports.
//
// With P = s^2 M + s D + K at the state (x*, v*) and B_k the port of tool k, the patches of all touching stations are made of
//     X_k = P^-1 B_k,   P^-1 F,   P^-1 M v*,      F = F(x*, v*) + sum_k B_k lambda_k
// so a frame needs three solves per tool (five or six if it may slide: P^-1 (B_end lambda_end - B lambda), lambda_end rotated
// with the normal, tool_prediction.hpp) and two for all, at one shift s, and all of them go through P together. A model hardly
// suffers from an s that is not quite its own: with one tool s is that of its patch, with several that of their mean horizon.
//
// The other tools stay on the body while a patch is in use. The nearest are contacts of the patch (patch.hpp, OtherTool), which
// the player solves: they do not appear in its K, g or load_rate. Each tool o of the rest moves on at its velocity v_o, and its
// contact is a spring between it and the tissue,
//     lambda_o(t) = lambda_o* + S_o (v_o (t - t*) - B_o^T (x - x*)),    S_o = k_o I (it sticks) or k_o n n^T (it slips)
// so for the patch of station a the body carries the load lambda_o*, is stiffer by B_o S_o B_o^T, and its load grows with time:
//     residual force  F(x*, v*) + sum B_o lambda_o*,   stiffness K + sum B_o S_o B_o^T,   growing load  sum B_o S_o v_o
// and its P_a = P + sum B_o S_o B_o^T is inverted by the matrix inversion lemma, x -> x - X_O (I + S_O B_O^T X_O)^-1 S_O B_O^T x,
// where O are the tools that are coupled to it (kCoupledShare); the others hardly change the response at a's port. A node held by
// another tool (attach) moves on at its velocity: a growing load -K_o v_o. A scene has one kind of contact, so a grasp's patch
// meets held nodes only. k_o is the contact stiffness of the tool, but at most kContactStiffnessRatioMax times the tissue's own
// at that point (which also stands for rigid).
//
// Shapes: n coordinates of three numbers (body_operator.hpp), m coupled tools; x*, v*, F 3 n [m], [m/s], [N]; M, D, K, P 3 n x
// 3 n, P [N/m]; s [1/s]; B_k 3 n x 3, X_k 3 n x 3 [m/N]; lambda, v_o 3 [N], [m/s]; S_o 3 x 3 [N/m], S_O 3 m x 3 m, block
// diagonal; B_O, X_O 3 n x 3 m.
// Failures: P is not positive definite where a compressed body softens; then there is no system (system(), respond()); `clamp`
// drops the softening.
// Source: Woodbury (the lemma), Inverting modified matrices (1950).
#pragma once

#include <algorithm>
#include <array>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>

#include "server/body/integrator.hpp"
#include "server/reduce/basis.hpp"
#include "server/reduce/build_phase.hpp"
#include "server/reduce/snapshot_set.hpp"
#include "server/reduce/tool_prediction.hpp"

namespace palpate {

/// A port and its responses under P: three columns each.
struct PortResponse {
  Skin::Weights b;
  std::array<Vector, 3> input, response;  ///< B, masked; P^-1 B
  Mat3 compliance = Mat3::Zero();         ///< B^T P^-1 B
  std::vector<Vector> slides;             ///< P^-1 of the loads of a sliding tool; empty if not requested
};

/// The effect of other tools on the body while the patch of one is in use.
struct OtherTools {
  struct Spring {
    const PortResponse* port = nullptr;
    Mat3 stiffness = Mat3::Zero();  ///< S_o
    bool coupled = false;
  };
  struct Contact {
    const PortResponse* port = nullptr;
    std::size_t tool = 0;
  };
  std::vector<Contact> contacts;  ///< of the patch; the other members describe the other tools
  std::vector<Spring> springs;
  Vector load;       ///< sum B_o lambda_o*; empty when no other touches
  Vector load_rate;  ///< growing load [N/s]; empty when nothing grows
};

/// P at one shift, ready to solve with, and the solutions of this frame.
class SharedSystem {
 public:
  explicit SharedSystem(const Dynamics& dynamics) : solver_(dynamics) {}
  /// Starts a new frame. Returns false if P is found not to be positive definite.
  bool prepare(const Linearisation& at, double shift, bool clamp, double tolerance);
  /// A port, its point on the skin with B there, and the loads of its tool if it slides, if requested.
  struct PortPlace {
    std::size_t port = 0;
    SurfacePoint point;
    Skin::Weights b;
    std::span<const Vector> slides;
  };
  /// The body's own loads: the residual force and M v*. Null if not requested.
  struct OwnLoads {
    const Vector *residual = nullptr, *motion = nullptr;
  };
  /// Computes the responses to all of these together, unless they are known in this frame. The first guess of each is its last
  /// value. Returns false if P is found not to be positive definite.
  bool respond(std::span<const PortPlace> places, const OwnLoads& own);
  /// Results of respond().
  const PortResponse& port(std::size_t k) const { return ports_.at(k); }
  const Vector& residual() const { return residual_.x; }
  const Vector& motion() const { return motion_.x; }
  bool solve(std::span<const SolveColumn> columns) { return solver_.solve(at_, columns, tolerance_); }
  /// Diagonal blocks of P.
  std::span<const Mat3> diagonal() const { return solver_.diagonal(); }
  double shift() const { return shift_; }
  int iterations() const { return solver_.iterations(); }

 private:
  struct Kept {
    bool fresh = false;
    Vector x;
  };
  /// The responses of a port that are known in this frame.
  struct Fresh {
    SurfacePoint point;
    bool slides = false;
  };
  ShiftedSolver solver_;
  Linearisation at_;
  double shift_ = 0, tolerance_ = 0;
  bool definite_ = false;
  std::map<std::size_t, PortResponse> ports_;
  std::map<std::size_t, Fresh> fresh_;
  Kept residual_, motion_;
};

/// A predicted state of the body within the life of the next patches.
struct PredictedState {
  SnapshotKind kind = SnapshotKind::rollout;
  double weight = 1;  ///< of the resulting snapshot
  Vector x;
};

class FrameModel {
 public:
  static constexpr std::size_t kHistoryFrames = 4;  ///< more improved some bodies and hurt others (docs/notebook.md, 23)
  static constexpr double kHistorySpacingS = 0.04;  ///< less than the 50 ms of a frame at 20 Hz: there each counts
  static constexpr double kCoupledShare = 0.3;      ///< least ratio of B_a^T X_o to the geometric mean of the two compliances
  /// Largest ratio of k_o to the tissue's own stiffness: a stiffer contact differs by at most a hundredth of the tissue's
  /// compliance.
  static constexpr double kContactStiffnessRatioMax = 100;

  FrameModel(const Dynamics& dynamics, const Skin& skin);

  /// Starts a new frame: the arguments must outlive it, and the ports' points must be final before the first patch is built.
  /// `tools` are parallel to `ports`; `horizon` is the mean of the coming patches.
  void begin(const BodyState& state, const std::vector<ToolPort>& ports, std::span<const ToolAt> tools, Micros horizon);

  /// Announces a patch for this port, even if it does not touch: its responses are computed with those of the others, and those
  /// to the load where it may have slid to, minus its present load: B_end lambda_end - B lambda.
  void request_patch(std::size_t k, const ExpectedSlide& slide = {});
  /// Sets the motion of the hands at the ports; the default is that of the tools, without acceleration.
  void set_hands(std::vector<HandMotion> hands);
  /// Returns the path of tool k that a patch with this horizon assumes.
  HandMotion path(std::size_t k, Micros horizon) const { return expected_path(hands_.at(k), seconds(horizon)); }
  /// Returns this frame in the coordinates of a locally refined body (refined_body.hpp), if the body suits; else this model.
  FrameModel& refined() { return refined_ ? *refined_ : *this; }
  /// Sets a listener that is called when each part begins. The model itself reads no clock.
  void listen(std::function<void(BuildPhase)> listener);
  void enter(BuildPhase part) const {
    if (listener_) listener_(part);
  }

  const BodyState& state() const { return *state_; }
  const std::vector<ToolPort>& ports() const { return *ports_; }
  const ToolAt& tool(std::size_t k) const { return tools_[k]; }
  /// Nodes, or coordinates of a locally refined body, that the tools and the scene hold.
  const std::vector<std::uint8_t>& held();
  /// Returns the linearisation with other nodes held.
  Linearisation linearisation(const std::vector<std::uint8_t>& held);
  Linearisation linearisation() { return linearisation(this->held()); }
  /// Selects the neighbourhood of this tool, for a locally refined body, as Linearisation::part.
  void select_subdomain(std::size_t which);
  /// Returns the coordinate of a node that is held, or near a tool.
  std::uint32_t coordinate(std::uint32_t node) const { return body_->coordinate(node); }
  /// Returns B at a point of the skin.
  Skin::Weights weights(const SurfacePoint& point) const;
  /// Returns the position of a port on the body at rest.
  Vec3 place_of(const ToolPort& port) const;
  /// Sets the predicted states for snapshots() of this frame; the default is none.
  void set_predicted_states(std::vector<PredictedState> states) { predicted_ = std::move(states); }
  /// Returns the displacements of the coordinates from the present state to those of the last frames in which this was called, at
  /// least 40 ms apart, to the predicted states, and to rest, in this order; `history` from the oldest on.
  const SnapshotSet& snapshots();
  /// Returns F(x*, v*), with zero rows for held nodes.
  const Vector& forces();
  /// Returns BodyOperator::fading().
  const std::vector<Vector>& fading();
  /// Returns the positions of the skin's vertices.
  const std::vector<double>& positions();
  /// Returns the shift for a patch with this horizon in this frame.
  double shift(Micros horizon) const;

  /// Returns P at a shift; nullptr if it is not positive definite. `tolerance`: of its solves.
  SharedSystem* system(double shift, bool clamp, double tolerance);
  /// Computes the responses of P at all ports that touch or are wanted, at `which`, and to the requested own loads of the body.
  /// Returns false if P is found not to be positive definite.
  struct Own {
    bool residual = false, motion = false;
  };
  bool respond(SharedSystem& p, std::size_t which, Own own);
  /// Returns B_end lambda_end - B lambda of a wanted port; empty if its tool does not touch, or slides are not requested.
  std::span<const Vector> sliding_loads(std::size_t k);
  /// Returns the tools besides `which` that may be contacts of its patch, the most strongly coupled through the body first: those
  /// that touch the surface, or will within `horizon` on their expected path. Requires the responses of P.
  std::vector<std::size_t> neighbours(const SharedSystem& p, std::size_t which, Micros horizon);
  /// Returns the effect of the tools besides `which`, a port that touches; `contacts` of them are contacts of its patch. Requires
  /// the responses of P.
  OtherTools others(const SharedSystem& p, std::size_t which, std::span<const std::size_t> contacts);
  /// Returns the same for a held node.
  OtherTools other_nodes(std::size_t which);
  /// Return F with the forces of all touching tools, and of all but one.
  const Vector& total();
  Vector forces_beside(std::size_t which);

 private:
  struct Slot {
    std::unique_ptr<SharedSystem> system;
    double shift = 0;
    bool clamp = false, in_use = false, definite = false;
  };
  struct Wanted {
    bool patch = false;
    ExpectedSlide slide;
    std::optional<std::vector<Vector>> loads;  // loads of the slide, once requested
  };
  struct Known {
    double time_s = 0;
    Vector x;
  };
  explicit FrameModel(FrameModel* whole);
  void record_history();
  void settle();
  Eigen::Index size() { return linearisation().masses().size(); }
  double coupling(const SharedSystem& p, std::size_t a, std::size_t b) const;
  bool will_touch(std::size_t k, Micros horizon);
  Mat3 contact_stiffness(std::size_t k, const PortResponse& response);
  void add_held_nodes(std::size_t which, Vector& load_rate);

  const Dynamics* dynamics_;
  const Skin* skin_;
  const BodyState* state_ = nullptr;
  const std::vector<ToolPort>* ports_ = nullptr;
  std::vector<ToolAt> tools_;
  std::vector<HandMotion> hands_;
  std::vector<PredictedState> predicted_;
  std::deque<Known> past_;    // of the whole body, as the next
  std::optional<Known> now_;  // the next entry of past_
  std::optional<SnapshotSet> snapshots_;
  std::vector<std::uint8_t> held_;
  std::vector<Wanted> wanted_;
  Micros horizon_{};
  FrameModel* whole_ = nullptr;      // of a locally refined model
  WholeBody* whole_body_ = nullptr;  // only one of these two is set
  RefinedBody* refined_body_ = nullptr;
  std::unique_ptr<BodyOperator> body_;                    // owns it
  std::map<std::size_t, NonlinearSubdomain> subdomains_;  // per tool
  const NonlinearSubdomain* subdomain_ = nullptr;
  std::unique_ptr<FrameModel> refined_;  // of the whole of a large body
  bool settled_ = false, linearised_ = false, placed_ = false;
  std::function<void(BuildPhase)> listener_;
  Vector forces_, total_;
  std::optional<std::vector<Vector>> fading_;
  std::vector<double> positions_;
  std::vector<Slot> slots_;
};

/// Converts x of P to x of P + sum B_o S_o B_o^T, over the coupled ones; several right-hand sides at once.
class SpringCorrection {
 public:
  explicit SpringCorrection(const OtherTools& others);
  void apply(Vector& x) const;

 private:
  std::vector<const OtherTools::Spring*> coupled_;
  Matrix gain_;  // (I + S_O B_O^T X_O)^-1 S_O
};

/// Returns 2 / horizon within bounds [1/s].
double shift_for(Micros horizon);

}  // namespace palpate
