// Builds patches from a body: linearises at a port, reduces, and fills in what patch.hpp defines. One call per scheme and
// station.
//
//   hold      the force at the stamp
//   tangent   static stiffness at the port, K_s = K_p - K_pf K_ff^-1 K_fp  (touch: compliance C_s = B^T K^-1 B)
//   ring      the nodes of the contact and their neighbours, all others held still, reduced like `port`
//   port      the whole body; the modes of a touch are chosen from rational Krylov directions at the port (basis.hpp,
//             linear_rollouts.hpp), those of a grasp are the first of them
//   hyper     the whole body, a basis for its likely motions (pod_basis.hpp), and in addition to the linear patch some of its
//             elements (fit_nonlinear_terms.hpp); if that fails, `port` is built, and the patch reports it
//
// All but the first two are one pipeline for both kinds of port: the body's responses to the port under P = s^2 M + s D + K
// (PortModel), a basis of these, K and D on the basis, and the contributions of the port. For a large body they use a coarser
// model of the part far from the tools (refined_body.hpp).
//
// K and D are the symmetric tangents, so an orthogonal projection keeps them positive semi-definite where the body's own are. A
// compressed body may have a direction without stiffness, or with a negative one along which it snaps. There a linear model would
// carry the surface away for as long as the patch lasts, while the body itself is soon stopped by its own stiffness. So each mode
// is at least as stiff as the softest mode of the body at rest: its stiffness is max(|k|, softest), and the difference is
// reported. The computations that stations of a room share are done once per frame, and the other stations' tools stay on the
// body while a patch is in use (frame_model.hpp); the basis has no direction of its own for their forces
// (docs/decisions/0010-other-tools.md). For a grasp the joint stiffness of modes and tool is then projected onto the positive
// semi-definite matrices (psd_projection.hpp).
#pragma once

#include <memory>
#include <optional>

#include "server/body/integrator.hpp"
#include "server/reduce/fit_nonlinear_terms.hpp"
#include "server/reduce/frame_model.hpp"
#include "server/reduce/linear_rollouts.hpp"
#include "server/reduce/local_body.hpp"
#include "server/reduce/node_graph.hpp"
#include "server/reduce/pod_basis.hpp"
#include "server/reduce/static_indentation.hpp"

namespace palpate {

struct PatchRequest {
  Scheme scheme = Scheme::port;
  int order = 0;           ///< number of states requested, 0 = default of the scheme
  Micros horizon{50'000};  ///< age that the patch will reach
  /// Longest silence expected of the link between two patches: the patch is valid for twice `horizon` plus this.
  Micros silence = kSilenceLeast;
  /// Number of surface vertices that fit into a datagram with this number of modes, without or with a load_rate, and with these
  /// numbers of relaxation branches and of other tools that are contacts.
  int (*vertices_max)(int modes, bool loaded, int branches, int others) = [](int, bool, int, int) { return 12; };
  Vec3 acceleration = Vec3::Zero();  ///< of the hand [m/s^2]
  int modes_max = kMaxModes;         ///< most that fit into a datagram
};

/// Modes of a patch, in the coordinates in which they were computed.
class PatchModes {
 public:
  PatchModes() = default;
  PatchModes(Matrix v, const BodyOperator& body) : v_(std::move(v)), body_(&body), generation_(body.generation()) {}
  /// Returns V, 3 N x r, for all nodes; empty if the coordinates have changed since.
  Matrix of_nodes() const;

 private:
  Matrix v_;
  const BodyOperator* body_ = nullptr;
  std::uint64_t generation_ = 0;
};

struct BuiltPatch {
  Patch patch;
  NonlinearTerms terms;  ///< terms of the patch; no variables: none
  PatchModes modes;      ///< for scheme `hyper`
  /// True if `port` was built instead of `hyper`: a law that is not smooth, finite elements of several laws, springs too stiff
  /// for the player's step.
  bool fell_back = false;
  double psd_change_1_s2 = 0;  ///< largest change of the stiffness of a mode
  int solver_iterations = 0;
};

class PatchBuilder {
 public:
  /// Default number of states, two per mode. Measured: 44 for a grasp gain less than 0.2 dB (docs/notebook.md, 15); for a touch
  /// limited by a datagram with 12 vertices.
  static constexpr int kAttachOrder = 22, kTouchOrder = 16;
  /// The same for `hyper`: for a grasp all that a datagram holds; for a touch measured: 14 or 16 modes are no more accurate in
  /// the same bytes (docs/notebook.md, 23).
  static constexpr int kHyperAttachOrder = 2 * kMaxModes, kHyperTouchOrder = 30;
  /// Number of Krylov directions from which the modes of a touch are chosen. Measured: 24 and 32 are the same within 0.1 dB.
  static constexpr int kCandidates = 16;
  static constexpr int kRingLayers = 1;  ///< layers of neighbours that `ring` keeps: the paper's

  /// `softest_1_s2`: lower bound of a mode's stiffness, softest_stiffness() of the body.
  PatchBuilder(const Dynamics& dynamics, const Skin& skin, double softest_1_s2);

  /// Builds a patch for port `which` of the frame; the caller sets seq and stamp. Returns none if the port's matrix cannot be
  /// solved.
  std::optional<BuiltPatch> build(FrameModel& frame, std::size_t which, const PatchRequest& request);
  /// Returns the argument of FrameModel::request_patch() for the port of the patch.
  ExpectedSlide expected_slide(const PatchRequest& request) const;
  static int modes_for(Scheme scheme, ContactKind contact, int order);

 private:
  /// Variant of P with which directions are solved for: at `shift_factor` times the shift of the prediction horizon; with `clamp`
  /// compressed elements do not soften it.
  struct SystemVariant {
    double shift_factor = 1;
    bool clamp = false;
  };

  /// A patch under construction.
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

  /// The body that is reduced, or some of its nodes.
  struct Model {
    Linearisation at;
    Vector residual;    ///< F* of its nodes, with the loads of other tools; zero for held nodes
    OtherTools others;  ///< those whose growing load or springs are included
  };

  /// Responses of the model to the port, and the inputs of its basis.
  struct PortModel {
    double shift_1_s = 0;
    KrylovStart start;
    KrylovSolve solve;
    std::span<const Vector> push, slide_loads;  ///< B, and B_end lambda_end - B lambda; for a touch of scheme `port`
    Matrix prescribed;                          ///< motion of the tool's node with the tool, 3 N x 3; no columns for touch
    SnapshotSet snapshots;                      ///< for scheme `hyper`, without those that all ports share
  };

  struct Reduced {
    Matrix v, rotation;  ///< modes, 3 N x r, and their coefficients in the basis
    Vector stiffness;    ///< before PSD projection
    Matrix coordinates;  ///< of snapshots, in the basis
    SnapshotSet snapshots;
  };

  bool attempt(const Job& job, BuiltPatch& made);
  std::optional<BuiltPatch> fall_back(FrameModel& frame, std::size_t which, const PatchRequest& request);
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
  bool build_grasp(const Job& job, const Model& model, BuiltPatch& made);

  // patch_builder_touch.cpp
  bool respond(const Job& job, Model& model, SharedSystem& p);
  void add_other_tools(const Job& job, const Model& model, const SharedSystem& p, const Matrix& v, Patch& patch) const;
  bool build_touch(const Job& job, const Model& model, SharedSystem& p, BuiltPatch& made);
  PortModel touch_model(const Job& job, const Model& model, SharedSystem& p);
  void add_touch_snapshots(const Job& job, const Model& model, const SharedSystem& p, const Vec3& inwards, PortModel& port);

  const Dynamics* dynamics_;
  const Skin* skin_;
  NodeGraph graph_;
  double softest_1_s2_ = 0, extent_m_ = 0, spacing_m_ = 0;
  std::vector<std::uint8_t> held_;
  ShiftedSolver solver_;  // for a grasp: its own node is held
  SharedSystem ring_;     // for a ring: its far nodes are held
  WarmStarts memory_, response_memory_;
  std::unique_ptr<StaticIndentations> indentations_;  // created on demand
};

}  // namespace palpate
