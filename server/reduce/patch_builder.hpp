// Patches from a body: linearise at a port, reduce, and write down what patch.hpp defines. One call per scheme and station.
//
//   hold, filtered   the force at the stamp
//   tangent          static stiffness seen at the port, K_s = K_p - K_pf K_ff^-1 K_fp  (touch: compliance C_s = B^T K^-1 B)
//   ring             the nodes within kRingLayers layers of the contact, all others held still, reduced like `port`
//   two-layer        those nodes, with outer elements and masses that stand for the rest of the body (two_layer.hpp), reduced
//                    like `port`; forces and velocities at the stamp are the body's own; `ring` for a body of tetrahedra, and
//                    then the patch says so
//   balanced         the whole body, balanced off-line at its rest state for this contact (balanced_basis.hpp)
//   port             the whole body, rational Krylov basis at the port (basis.hpp); a grasp with few modes and long to last: the
//                    best of more directions (narrow_basis.hpp)
//   hyper            the whole body, a basis for what it is likely to do (hyper_basis.hpp), and beside the linear patch
//                    some of its elements (hyper_patch.hpp); `port` where they cannot be had, and then the patch says so
//
// Of a large body all but `two-layer` and `balanced` see what is far from the tools coarser (refined_body.hpp).
//
// K and D are the symmetric tangents, so an orthogonal projection keeps them positive semi-definite where the body's own are.
// A compressed body may have a direction without stiffness, or with a negative one along which it snaps. There a linear model
// would carry the surface away for as long as the patch lasts, while the body itself is soon caught by its own stiffness. So no
// mode is taken for softer than the softest of the body at rest: its stiffness is max(|k|, softest), and by how much that differs
// is reported. What several stations of a room have in common is solved once a frame, and the tools of the others stay on the
// body while a patch lasts (frame_model.hpp); the basis has the direction in which their growing load moves the body where they
// are coupled to the port. For a grasp the joint stiffness of modes and tool is then projected onto the positive semi-definite
// ones (psd_projection.hpp).
#pragma once

#include <memory>
#include <optional>

#include "server/body/integrator.hpp"
#include "server/reduce/balanced_basis.hpp"
#include "server/reduce/frame_model.hpp"
#include "server/reduce/hyper_basis.hpp"
#include "server/reduce/hyper_patch.hpp"
#include "server/reduce/static_indentation.hpp"
#include "server/reduce/two_layer.hpp"

namespace palpate {

struct PatchRequest {
  Scheme scheme = Scheme::port;
  int order = 0;           ///< states wanted, 0 = default of the scheme
  Micros horizon{50'000};  ///< age that the patch will reach
  /// That the link may make between two patches: valid for twice `horizon` and this.
  Micros silence = kSilenceLeast;
  /// Surface vertices that fit into a datagram beside so many modes, without and with a load_rate.
  int (*vertices_max)(int modes, bool loaded) = [](int, bool) { return 12; };
  Vec3 acceleration = Vec3::Zero();  ///< of the hand [m/s^2]
};

struct PatchBuildReport {
  /// `hyper` was asked for, `port` was built: a law that is not smooth, finite elements of several laws, springs too stiff for
  /// the player's step; or `two-layer` was, and `ring` was built: the body has tetrahedra.
  bool fell_back = false;
  double psd_change_1_s2 = 0;  ///< most that the stiffness of a mode was changed by
  int solver_iterations = 0;
};

class PatchBuilder {
 public:
  static constexpr int kRingLayers = 1;
  static constexpr int kAttachOrder = 22, kTouchOrder = 16;
  static constexpr Micros kLongHorizon{120'000};  ///< from there on a grasp's few modes are chosen from more (narrow_basis.hpp)
  static constexpr int kHyperAttachOrder = 32, kHyperTouchOrder = 30;
  static constexpr double kFilteredHz = 10;  ///< low-pass of `filtered`: the paper's, its model rate

  /// `softest_1_s2`: lowest stiffness that a mode may have, softest_stiffness() of the body. `balanced`: off-line bases, shared
  /// by the builders of a body; without them there is no patch of scheme balanced.
  PatchBuilder(const Dynamics& dynamics, const Skin& skin, double softest_1_s2, BalancedBases* balanced = nullptr);

  /// A patch for port `which` of the frame; seq and stamp are left to the caller. Nothing when the port's matrix cannot be
  /// solved.
  std::optional<Patch> build(FrameModel& frame, std::size_t which, const PatchRequest& request);
  /// Those that go with the patch that was built last; no variables: none.
  const NonlinearTerms& terms() const { return terms_; }
  /// Its modes V, 3 N x r, where it is of scheme `hyper`; else nothing, and where they were those of coordinates that have
  /// changed.
  Matrix modes() const;
  /// For FrameModel::want() of the port that the patch will be for.
  ExpectedSlide expected_slide(const PatchRequest& request) const;
  const PatchBuildReport& report() const { return report_; }
  static int modes_for(Scheme scheme, ContactKind contact, int order);

 private:
  /// What is reduced, and with what.
  struct Model {
    Linearisation at;
    Vector residual;  ///< F* of its nodes, zero where they are held
    ShiftedSolver* solver = nullptr;
    BasisMemory* memory = nullptr;
    const LocalBody* local = nullptr;  ///< null: all of the body
    OtherTools others;                 ///< those whose growing load or springs are in it
  };

  struct Reduced {
    Matrix v;          ///< modes, 3 N x r
    Vector stiffness;  ///< before PSD projection
  };

  /// What directions are solved for with: P at so many times the shift of the prediction horizon, and with `clamp` compressed
  /// elements do not soften it.
  struct Footing {
    double faster = 1;
    bool clamp = false;
    double shift(const PatchRequest& request, double usual) const {
      return request.scheme == Scheme::tangent ? 0 : faster * usual;
    }
  };

  std::optional<Patch> build_whole(FrameModel& frame, std::size_t which, const PatchRequest& request, const Patch& patch,
                                   const Footing& footing);
  std::optional<Patch> fall_back(FrameModel& frame, std::size_t which, const PatchRequest& request, Scheme scheme);
  std::optional<Patch> build_two_layer(FrameModel& frame, std::size_t which, const PatchRequest& request, const Patch& patch,
                                       const Footing& footing);
  std::optional<Patch> build_attach(const Model& model, const ToolPort& port, const PatchRequest& request, Patch patch,
                                    const Footing& footing, const ToolAt& tool);
  std::optional<Patch> build_touch(const Model& model, FrameModel& frame, std::size_t which, const PatchRequest& request,
                                   Patch patch, const Footing& footing);
  std::optional<Patch> build_shared_touch(FrameModel& frame, std::size_t which, const PatchRequest& request, Patch patch,
                                          const Footing& footing);
  std::optional<Matrix> grasp_basis(const Model& model, const std::vector<Vector>& inputs, const PatchRequest& request,
                                    BasisRequest wanted);
  bool solve_ports(const Model& model, const std::vector<Vector>& inputs, double tolerance);
  std::optional<Mat3> static_response(const Model& model, const std::vector<Vector>& inputs);
  KrylovStart touch_start(const SharedSystem& p, std::size_t which, const SpringCorrection& correct, bool with_motion) const;
  std::optional<HyperBasis> touch_basis(FrameModel& frame, SharedSystem& p, std::size_t which, const OtherTools& others,
                                        const Linearisation& at, const PatchRequest& request);
  std::vector<std::uint32_t> contact_nodes(const ToolPort& port) const;
  bool hold_far_nodes(const FrameModel& frame, const std::vector<std::uint32_t>& seeds);
  void begin_touch(const ToolPort& port, Patch& patch) const;
  std::optional<HyperBasis> grasp_shapes(const Model& model, std::uint32_t node, std::vector<Vector> inputs,
                                         HyperBasisRequest wanted, const ToolAt& tool, HyperShapes& shapes);
  Matrix known_snapshots() const;
  void add_terms(const Linearisation& at, const Patch& patch, const Matrix& true_stiffness, HyperShapes& shapes, int vertices);
  bool reduce(const Linearisation& at, const Matrix& v, const Projection& of_v, const OtherTools& others, Patch& patch,
              Reduced& reduced);

  const Dynamics* dynamics_;
  const Skin* skin_;
  BalancedBases* balanced_;
  std::vector<std::vector<std::uint32_t>> neighbours_;
  double softest_1_s2_ = 0, extent_m_ = 0, spacing_m_ = 0;
  std::vector<std::uint8_t> held_;
  ShiftedSolver solver_;  // of a grasp: its own node is held
  SharedSystem ring_;     // of a ring: its far nodes are held
  BasisMemory memory_;
  std::unique_ptr<TwoLayer> two_layer_;               // made when it is first asked for
  std::unique_ptr<StaticIndentations> indentations_;  // likewise
  BasisMemory basis_memory_;
  const DisplacementSnapshots* snapshots_ = nullptr;  // of the frame, for scheme hyper
  NonlinearTerms terms_;
  Matrix modes_;
  const RefinedBody* modes_of_ = nullptr;  // in whose coordinates they are; null: in those of all nodes
  std::uint64_t modes_generation_ = 0;
  PatchBuildReport report_;
};

}  // namespace palpate
