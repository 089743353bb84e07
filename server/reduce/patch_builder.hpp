// Patches from a body: linearise at a port, reduce, and write down what patch.hpp defines. One call per scheme and station.
//
//   hold, filtered   the force at the stamp
//   tangent          static stiffness seen at the port, K_s = K_p - K_pf K_ff^-1 K_fp  (touch: compliance C_s = B^T K^-1 B)
//   ring             the nodes within kRingLayers layers of the contact, all others held still, reduced like `port`
//   port             the whole body, rational Krylov basis at the port (basis.hpp)
//
// K and D are the symmetric tangents, so an orthogonal projection keeps them positive semi-definite where the body's own are.
// A compressed body may have a direction without stiffness, or with a negative one along which it snaps. There a linear model
// would carry the surface away for as long as the patch lasts, while the body itself is soon caught by its own stiffness. So no
// mode is taken for softer than the softest of the body at rest: its stiffness is max(|k|, softest), and by how much that differs
// is reported. What several stations of a room have in common is solved once a frame, and the tools of the others stay on the
// body while a patch lasts (frame_model.hpp); the basis has the direction in which their growing load moves the body where they
// are coupled to the port. For a grasp the joint stiffness of modes and tool is then lifted to zero where it is still negative
// (lift.hpp).
#pragma once

#include <memory>
#include <optional>

#include "server/body/integrator.hpp"
#include "server/reduce/frame_model.hpp"

namespace palpate {

struct PatchRequest {
  Scheme scheme = Scheme::port;
  int order = 0;          ///< states wanted, 0 = default of the scheme
  Micros bridge{50'000};  ///< age that the patch will reach
  /// Surface vertices that fit into a datagram beside so many modes, without and with a load_rate.
  int (*vertices_max)(int modes, bool loaded) = [](int, bool) { return 12; };
};

struct PatchBuildReport {
  double lifted_1_s2 = 0;  ///< most that the stiffness of a mode was changed by
  int solver_iterations = 0;
};

class PatchBuilder {
 public:
  static constexpr int kRingLayers = 1;
  static constexpr int kAttachOrder = 22, kTouchOrder = 16;
  static constexpr double kFilteredHz = 10;  ///< low-pass of `filtered`: the paper's, its model rate

  /// `softest_1_s2`: lowest stiffness that a mode may have, softest_stiffness() of the body.
  PatchBuilder(const Dynamics& dynamics, const Skin& skin, double softest_1_s2);

  /// A patch for port `which` of the frame; seq and stamp are left to the caller. Nothing when the port's matrix cannot be
  /// solved.
  std::optional<Patch> build(FrameModel& frame, std::size_t which, const PatchRequest& request);
  const PatchBuildReport& report() const { return report_; }
  static int modes_for(Scheme scheme, ContactKind contact, int order);

 private:
  // With `clamp` compressed elements do not soften the matrix that is solved with: the second try, when the first was not
  // definite.
  std::optional<Patch> build_attach(const FrameModel& frame, std::size_t which, const PatchRequest& request, Patch patch,
                                    bool clamp);
  std::optional<Patch> build_touch(FrameModel& frame, std::size_t which, const PatchRequest& request, Patch patch, bool clamp);
  std::optional<Mat3> static_response(const Linearisation& at, const std::vector<Vector>& inputs);
  std::optional<Matrix> touch_basis(FrameModel& frame, SharedSystem& p, std::size_t which, const OtherTools& others,
                                    const Linearisation& at, const PatchRequest& request);
  void hold_far_nodes(const std::vector<std::uint32_t>& seeds);
  bool reduce(const Linearisation& at, const Matrix& v, const OtherTools& others, Patch& patch, Matrix& rotated);
  Vector unit(std::uint32_t node, int axis) const;

  const Dynamics* dynamics_;
  const Skin* skin_;
  std::vector<std::vector<std::uint32_t>> neighbours_;
  double softest_1_s2_ = 0, extent_m_ = 0, spacing_m_ = 0;
  std::vector<std::uint8_t> held_;
  ShiftedSolver solver_;  // of a grasp: its own node is held
  SharedSystem ring_;     // of a ring: its far nodes are held
  BasisMemory memory_;
  PatchBuildReport report_;
};

}  // namespace palpate
