// What the patches of one frame have in common, computed once: the linearised body under all tools, and its responses at
// their ports.
//
// With P = s^2 M + s D + K at the state (x*, v*) and B_k the port of tool k, the patches of all touching stations are made of
//     X_k = P^-1 B_k,   P^-1 F,   P^-1 M v*,      F = F(x*, v*) + sum_k B_k lambda_k
// so a frame takes three solves a tool (five or six, where it may slide to: P^-1 (B_end lambda_end - B lambda), lambda_end turned
// with the normal, tool_prediction.hpp) and two for all, at one shift s, and all of them go through P together. A model is hardly
// the worse for an s that is not quite its own: with one tool s is that of its patch, with several that of their mean horizon.
//
// The other tools stay on the body while a patch lasts. The nearest are contacts of the patch (patch.hpp, OtherTool), which the
// player closes: nothing of them is in its K, g or load_rate. Of the rest, tool o moves on at its velocity v_o, and its contact
// is a spring between it and the tissue,
//     lambda_o(t) = lambda_o* + S_o (v_o (t - t*) - B_o^T (x - x*)),    S_o = k_o I (it sticks) or k_o n n^T (it slips)
// so for the patch of station a the body is pushed by lambda_o*, stiffer by B_o S_o B_o^T, and pushed more as time goes by:
//     residual force  F(x*, v*) + sum B_o lambda_o*,   stiffness K + sum B_o S_o B_o^T,   growing load  sum B_o S_o v_o
// and its P_a = P + sum B_o S_o B_o^T is inverted by the matrix inversion lemma, x -> x - X_O (I + S_O B_O^T X_O)^-1 S_O B_O^T x,
// where O are the tools that are coupled to it (kCoupledShare); those of others hardly change the response at a's port.
// A node held by another tool (attach) moves on at its velocity: a growing load -K_o v_o. A scene has one kind of contact, so a
// grasp's patch meets held nodes only.
// k_o is the contact stiffness of the tool, but at most kContactStiffnessRatioMax times the tissue's own at that point (which
// also stands for rigid).
//
// Shapes: n coordinates of three numbers (body_operator.hpp), m coupled tools; x*, v*, F 3 n [m], [m/s], [N]; M, D, K, P 3 n x
// 3 n, P [N/m]; s [1/s]; B_k 3 n x 3, X_k 3 n x 3 [m/N]; lambda, v_o 3 [N], [m/s]; S_o 3 x 3 [N/m], S_O 3 m x 3 m, block
// diagonal; B_O, X_O 3 n x 3 m.
// What can go wrong: P is not positive definite where a compressed body softens, and there is no system then (system(),
// respond()); with `clamp` the softening is left out.
// Source: of the lemma, Woodbury, Inverting modified matrices (1950).
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
#include "server/reduce/patch_part.hpp"
#include "server/reduce/snapshot_set.hpp"
#include "server/reduce/tool_prediction.hpp"

namespace palpate {

/// A port under P: three columns each.
struct PortResponse {
  Skin::Weights b;
  std::array<Vector, 3> input, response;  ///< B, masked; P^-1 B
  Mat3 compliance = Mat3::Zero();         ///< B^T P^-1 B
  std::vector<Vector> slides;             ///< P^-1 of the loads of a tool that slides on; none where none was asked for
};

/// What other tools do to the body while the patch of one lasts.
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
  std::vector<Contact> contacts;  ///< of the patch; the rest is of those that are none
  std::vector<Spring> springs;
  Vector load;       ///< sum B_o lambda_o*; empty when no other touches
  Vector load_rate;  ///< growing load [N/s]; empty when nothing grows
};

/// P at one shift, ready to solve with, and what was solved in this frame.
class SharedSystem {
 public:
  explicit SharedSystem(const Dynamics& dynamics) : solver_(dynamics) {}
  /// For a new frame. False when P turns out not to be positive definite.
  bool prepare(const Linearisation& at, double shift, bool clamp, double tolerance);
  /// Which port, where on the skin, its B there, and the loads of its tool that slides on, if they are asked for.
  struct PortPlace {
    std::size_t port = 0;
    SurfacePoint point;
    Skin::Weights b;
    std::span<const Vector> slides;
  };
  /// The body's own: what is out of balance, and M v*. Null where it is not asked for.
  struct OwnLoads {
    const Vector *residual = nullptr, *motion = nullptr;
  };
  /// Responses to all of these together, as far as they are not known in this frame. The first guess of each is its last one.
  /// False when P turns out not to be positive definite.
  bool respond(std::span<const PortPlace> places, const OwnLoads& own);
  /// What respond() found.
  const PortResponse& port(std::size_t k) const { return ports_.at(k); }
  const Vector& residual() const { return residual_.x; }
  const Vector& motion() const { return motion_.x; }
  bool solve(std::span<const SolveColumn> columns) { return solver_.solve(at_, columns, tolerance_); }
  /// Blocks of the diagonal of P.
  std::span<const Mat3> diagonal() const { return solver_.diagonal(); }
  double shift() const { return shift_; }
  int iterations() const { return solver_.iterations(); }

 private:
  struct Kept {
    bool fresh = false;
    Vector x;
  };
  /// What is known of a port in this frame.
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

/// Where the nodes of the body may be until the next patches take over.
struct PredictedState {
  SnapshotKind kind = SnapshotKind::rollout;
  double weight = 1;  ///< of the snapshot that it makes
  Vector x;
};

class FrameModel {
 public:
  static constexpr std::size_t kHistoryFrames = 4;  ///< more gained single bodies and cost others (docs/notebook.md, 23)
  static constexpr double kHistorySpacingS = 0.04;  ///< less than the 50 ms of a frame at 20 Hz: there each counts
  static constexpr double kCoupledShare = 0.3;      ///< of B_a^T X_o to the geometric mean of the two compliances
  /// Of k_o to the tissue's own: what is stiffer differs by a hundredth of the tissue's compliance at most.
  static constexpr double kContactStiffnessRatioMax = 100;

  FrameModel(const Dynamics& dynamics, const Skin& skin);

  /// A new frame: the arguments must outlive it, and a port's point is settled before the first patch is built. `tools` are
  /// parallel to `ports`; `horizon` is the mean of the patches to come.
  void begin(const BodyState& state, const std::vector<ToolPort>& ports, std::span<const ToolAt> tools, Micros horizon);

  /// A patch will be built for this port, although it may not touch: its responses are found together with those of the others,
  /// and those to its load where it may have slid to, less its load where it is: B_end lambda_end - B lambda.
  void want(std::size_t k, const ExpectedSlide& slide = {});
  /// How the hands at the ports move; without it as the tools do, with no acceleration.
  void set_hands(std::vector<HandMotion> hands);
  /// The path of tool k that a patch with this horizon takes for granted.
  HandMotion path(std::size_t k, Micros horizon) const { return expected_path(hands_.at(k), seconds(horizon)); }
  /// The same frame in the coordinates of a locally refined body (refined_body.hpp), where the body is one for it; else this.
  FrameModel& refined() { return refined_ ? *refined_ : *this; }
  /// Hears of each part when it begins. The model itself knows no clock.
  void listen(std::function<void(PatchPart)> listener);
  void enter(PatchPart part) const {
    if (listener_) listener_(part);
  }

  const BodyState& state() const { return *state_; }
  const std::vector<ToolPort>& ports() const { return *ports_; }
  const ToolAt& tool(std::size_t k) const { return tools_[k]; }
  /// Nodes, or the coordinates of a locally refined body, that the tools and the scene hold.
  const std::vector<std::uint8_t>& held();
  /// With others held.
  Linearisation linearisation(const std::vector<std::uint8_t>& held);
  Linearisation linearisation() { return linearisation(this->held()); }
  /// From here on with what is near this tool, of a locally refined body, for Linearisation::part.
  void select_subdomain(std::size_t which);
  /// Of a node that is held, or near a tool.
  std::uint32_t coordinate(std::uint32_t node) const { return body_->coordinate(node); }
  /// B at a point of the skin.
  Skin::Weights weights(const SurfacePoint& point) const;
  /// Where it is on the body at rest.
  Vec3 place_of(const ToolPort& port) const;
  /// For snapshots() of this frame; none where nobody says.
  void set_predicted_states(std::vector<PredictedState> states) { predicted_ = std::move(states); }
  /// How the coordinates move from where the body is to where it was in the last frames in which this was asked for, 40 ms or
  /// more apart, to where it may be, and to where it rests, in this order; `history` the oldest first.
  const SnapshotSet& snapshots();
  /// F(x*, v*), rows of held nodes zero.
  const Vector& forces();
  /// BodyOperator::fading().
  const std::vector<Vector>& fading();
  /// The skin's vertices.
  const std::vector<double>& positions();
  /// The shift for a patch with this horizon in this frame.
  double shift(Micros horizon) const;

  /// P at a shift; nullptr when it is not positive definite. `tolerance` of its solves.
  SharedSystem* system(double shift, bool clamp, double tolerance);
  /// Has P respond at all ports that touch or are wanted, at `which` and to the body's own loads that are asked for. False when P
  /// turns out not to be positive definite.
  struct Own {
    bool residual = false, motion = false;
  };
  bool respond(SharedSystem& p, std::size_t which, Own own);
  /// B_end lambda_end - B lambda of a port that is wanted; none where its tool does not touch, or nothing is asked.
  std::span<const Vector> sliding_loads(std::size_t k);
  /// The tools besides `which` that may be contacts of its patch: those that touch the surface, or will within `horizon` if
  /// they go on. The more the one moves the body under the other, the earlier; once P has responded.
  std::vector<std::size_t> neighbours(const SharedSystem& p, std::size_t which, Micros horizon);
  /// The tools besides `which`, a port that touches, once P has responded; `contacts` of them are contacts of its patch.
  OtherTools others(const SharedSystem& p, std::size_t which, std::span<const std::size_t> contacts);
  /// The same for a node that is held.
  OtherTools other_nodes(std::size_t which);
  /// F with the forces of all tools that touch, and of all but one.
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
    std::optional<std::vector<Vector>> loads;  // where it leads, once somebody has asked
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
  std::deque<Known> past_;    // of the whole, like the next
  std::optional<Known> now_;  // will be past
  std::optional<SnapshotSet> snapshots_;
  std::vector<std::uint8_t> held_;
  std::vector<Wanted> wanted_;
  Micros horizon_{};
  FrameModel* whole_ = nullptr;      // of a locally refined one
  WholeBody* whole_body_ = nullptr;  // either
  RefinedBody* refined_body_ = nullptr;
  std::unique_ptr<BodyOperator> body_;                    // the same
  std::map<std::size_t, NonlinearSubdomain> subdomains_;  // of its tools
  const NonlinearSubdomain* subdomain_ = nullptr;
  std::unique_ptr<FrameModel> refined_;  // of the whole of a large body
  bool settled_ = false, linearised_ = false, placed_ = false;
  std::function<void(PatchPart)> listener_;
  Vector forces_, total_;
  std::optional<std::vector<Vector>> fading_;
  std::vector<double> positions_;
  std::vector<Slot> slots_;
};

/// x of P + sum B_o S_o B_o^T from x of P, over the coupled ones; several right-hand sides at once.
class SpringCorrection {
 public:
  explicit SpringCorrection(const OtherTools& others);
  void apply(Vector& x) const;

 private:
  std::vector<const OtherTools::Spring*> coupled_;
  Matrix gain_;  // (I + S_O B_O^T X_O)^-1 S_O
};

/// 2 / horizon within bounds [1/s].
double shift_for(Micros horizon);

}  // namespace palpate
