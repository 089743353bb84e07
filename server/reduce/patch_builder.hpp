// Patches from a body: linearise at a port, reduce, and write down what patch.hpp defines. One call per scheme and station.
//
//   hold, filtered   the force at the stamp
//   tangent          static stiffness seen at the port, K_s = K_p - K_pf K_ff^-1 K_fp  (touch: compliance C_s = B^T K^-1 B)
//   ring             the nodes within TwoLayer::kLayers layers of the contact, all others held still, reduced like `port`
//   two-layer        those nodes, with outer elements and masses that stand for the rest of the body (two_layer.hpp), reduced
//                    like `port`; forces and velocities at the stamp are the body's own; `ring` for a body of finite elements,
//                    and then the patch says so
//   balanced         the whole body, balanced off-line at its rest state for this contact (balanced_basis.hpp)
//   port             the whole body, modes of a touch chosen from rational Krylov directions at the port (basis.hpp,
//                    linear_rollouts.hpp); of a grasp the first of them
//   hyper            the whole body, a basis for what it is likely to do (pod_basis.hpp), and beside the linear patch some of its
//                    elements (hyper_patch.hpp); `port` where they cannot be had, and then the patch says so
//
// All but the first two are one pipeline for both kinds of port: what the body answers the port with under
// P = s^2 M + s D + K (PortModel), a basis of that, K and D on the basis, and what the port adds. Of a large body all but
// `two-layer` and `balanced` see what is far from the tools coarser (refined_body.hpp).
//
// K and D are the symmetric tangents, so an orthogonal projection keeps them positive semi-definite where the body's own are.
// A compressed body may have a direction without stiffness, or with a negative one along which it snaps. There a linear model
// would carry the surface away for as long as the patch lasts, while the body itself is soon caught by its own stiffness. So no
// mode is taken for softer than the softest of the body at rest: its stiffness is max(|k|, softest), and by how much that differs
// is reported. What several stations of a room have in common is solved once a frame, and the tools of the others stay on the
// body while a patch lasts (frame_model.hpp); the basis has no direction of its own for their pushes
// (docs/decisions/0010-other-tools.md). For a grasp the joint stiffness of modes and tool is then projected onto the positive
// semi-definite ones (psd_projection.hpp).
#pragma once

#include <memory>
#include <optional>

#include "server/body/integrator.hpp"
#include "server/reduce/balanced_basis.hpp"
#include "server/reduce/frame_model.hpp"
#include "server/reduce/hyper_patch.hpp"
#include "server/reduce/linear_rollouts.hpp"
#include "server/reduce/pod_basis.hpp"
#include "server/reduce/static_indentation.hpp"
#include "server/reduce/two_layer.hpp"

namespace palpate {

struct PatchRequest {
  Scheme scheme = Scheme::port;
  int order = 0;           ///< states wanted, 0 = default of the scheme
  Micros horizon{50'000};  ///< age that the patch will reach
  /// That the link may make between two patches: valid for twice `horizon` and this.
  Micros silence = kSilenceLeast;
  /// Surface vertices that fit into a datagram beside so many modes, without and with a load_rate, branches that fade, and other
  /// tools that are contacts.
  int (*vertices_max)(int modes, bool loaded, int branches, int others) = [](int, bool, int, int) { return 12; };
  Vec3 acceleration = Vec3::Zero();  ///< of the hand [m/s^2]
  int modes_max = kMaxModes;         ///< that fit into a datagram
};

/// Modes of a patch, in the coordinates that they were found in.
class PatchModes {
 public:
  PatchModes() = default;
  PatchModes(Matrix v, const BodyOperator& body) : v_(std::move(v)), body_(&body), generation_(body.generation()) {}
  /// V, 3 N x r, for all nodes; nothing where the coordinates have changed since.
  Matrix of_nodes() const;

 private:
  Matrix v_;
  const BodyOperator* body_ = nullptr;
  std::uint64_t generation_ = 0;
};

struct BuiltPatch {
  Patch patch;
  NonlinearTerms terms;  ///< that go with it; no variables: none
  PatchModes modes;      ///< of scheme `hyper`
  /// `hyper` was asked for, `port` was built: a law that is not smooth, finite elements of several laws, springs too stiff for
  /// the player's step; or `two-layer` was, and `ring` was built: the body has finite elements.
  bool fell_back = false;
  double psd_change_1_s2 = 0;  ///< most that the stiffness of a mode was changed by
  int solver_iterations = 0;
};

class PatchBuilder {
 public:
  /// States, two a mode. Measured: 44 of a grasp gain less than 0.2 dB (docs/notebook.md, 15); of a touch what a datagram holds
  /// beside 12 vertices.
  static constexpr int kAttachOrder = 22, kTouchOrder = 16;
  /// Of a grasp all that a datagram holds; of a touch measured: 14 or 16 modes are no truer in the same bytes
  /// (docs/notebook.md, 23).
  static constexpr int kHyperAttachOrder = 2 * kMaxModes, kHyperTouchOrder = 30;
  /// Of the Krylov directions that modes of a touch are chosen from. Measured: 24 and 32 are the same within 0.1 dB.
  static constexpr int kCandidates = 16;
  static constexpr double kFilteredHz = 10;  ///< low-pass of `filtered`: the paper's, its model rate

  /// `softest_1_s2`: lowest stiffness that a mode may have, softest_stiffness() of the body. `balanced`: off-line bases, shared
  /// by the builders of a body; without them there is no patch of scheme balanced.
  PatchBuilder(const Dynamics& dynamics, const Skin& skin, double softest_1_s2, BalancedBases* balanced = nullptr);

  /// A patch for port `which` of the frame; seq and stamp are left to the caller. Nothing when the port's matrix cannot be
  /// solved.
  std::optional<BuiltPatch> build(FrameModel& frame, std::size_t which, const PatchRequest& request);
  /// For FrameModel::want() of the port that the patch will be for.
  ExpectedSlide expected_slide(const PatchRequest& request) const;
  static int modes_for(Scheme scheme, ContactKind contact, int order);

 private:
  /// Which P directions are solved for with: at so many times the shift of the prediction horizon, and with `clamp` compressed
  /// elements do not soften it.
  struct SystemVariant {
    double shift_factor = 1;
    bool clamp = false;
  };

  /// A patch in the making.
  struct Job {
    FrameModel* frame = nullptr;
    std::size_t which = 0;
    const PatchRequest* request = nullptr;
    SystemVariant variant;
    const ToolPort& port() const { return frame->ports()[which]; }
    const ToolAt& tool() const { return frame->tool(which); }
    double shift(double usual) const { return request->scheme == Scheme::tangent ? 0 : variant.shift_factor * usual; }
    bool hyper() const { return request->scheme == Scheme::hyper; }
  };

  /// What is reduced: a body, or some of its nodes.
  struct Model {
    Linearisation at;
    Vector residual;                   ///< F* of its nodes, with the loads of others' tools, zero where they are held
    const LocalBody* local = nullptr;  ///< null: all of the body
    OtherTools others;                 ///< those whose growing load or springs are in it
    PortRows rows(std::uint32_t node, const Matrix& v) const { return local ? local->rows(node, v) : at.body->rows(node, v); }
  };

  /// What it answers the port with, and what directions are made of.
  struct PortModel {
    double shift_1_s = 0;
    KrylovStart start;
    KrylovSolve solve;
    std::span<const Vector> push, slide_loads;  ///< B, and B_end lambda_end - B lambda; of a touch of scheme `port`
    Matrix prescribed;                          ///< how the tool moves its node, 3 N x 3; no columns for touch
    SnapshotSet snapshots;                      ///< of scheme `hyper`, but for those that all ports have
    std::optional<Matrix> balanced;             ///< directions of scheme `balanced`
  };

  struct Reduced {
    Matrix v, rotation;  ///< modes, 3 N x r, and how they are made of the basis
    Vector stiffness;    ///< before PSD projection
    Matrix coordinates;  ///< of snapshots, in the basis
    SnapshotSet snapshots;
  };

  bool attempt(const Job& job, BuiltPatch& made);
  bool attempt_two_layer(const Job& job, BuiltPatch& made);
  std::optional<BuiltPatch> fall_back(FrameModel& frame, std::size_t which, const PatchRequest& request, Scheme scheme);
  int modes_beside(const Job& job, const OtherTools& others) const;
  bool reduce(const Job& job, const Model& model, PortModel& port, BuiltPatch& made, Reduced& reduced);
  RolloutLoads rollout_loads(const Job& job, const Model& model, const PortModel& port, const Matrix& w) const;
  bool take_basis(const Job& job, const Model& model, const Matrix& basis, const Projection& projected, BuiltPatch& made,
                  Reduced& reduced) const;
  void add_fading(const Job& job, const Model& model, const Matrix& v, Patch& patch) const;
  void add_terms(const Model& model, const Matrix& port, const Matrix& true_stiffness, int vertices, const Reduced& reduced,
                 BuiltPatch& made) const;
  std::vector<std::uint32_t> contact_nodes(const ToolPort& port) const;
  bool hold_far_nodes(const FrameModel& frame, const std::vector<std::uint32_t>& seeds);

  // patch_builder_grasp.cpp
  bool build_grasp(const Job& job, const Model& model, ShiftedSolver& solver, BasisMemory& memory, BuiltPatch& made);

  // patch_builder_touch.cpp
  bool respond(const Job& job, Model& model, SharedSystem& p);
  void add_other_tools(const Job& job, const Model& model, const SharedSystem& p, const Matrix& v, Patch& patch) const;
  bool build_touch(const Job& job, const Model& model, SharedSystem* p, BuiltPatch& made);
  PortModel touch_model(const Job& job, const Model& model, SharedSystem& p);
  void add_touch_snapshots(const Job& job, const Model& model, const SharedSystem& p, const Vec3& inwards, PortModel& port);

  const Dynamics* dynamics_;
  const Skin* skin_;
  BalancedBases* balanced_;
  NodeGraph graph_;
  double softest_1_s2_ = 0, extent_m_ = 0, spacing_m_ = 0;
  std::vector<std::uint8_t> held_;
  ShiftedSolver solver_;  // of a grasp: its own node is held
  SharedSystem ring_;     // of a ring: its far nodes are held
  BasisMemory memory_, response_memory_;
  std::unique_ptr<TwoLayer> two_layer_;               // made when it is first asked for
  std::unique_ptr<StaticIndentations> indentations_;  // likewise
};

}  // namespace palpate
