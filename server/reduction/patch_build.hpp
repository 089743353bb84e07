// Builds a patch from a body: linearises at a port, reduces, and fills in what patch.hpp defines. One call per station.
//
//   hold      the force at the stamp
//   tangent   static stiffness at the port, K_s = K_p - K_pf K_ff^-1 K_fp  (touch: compliance C_s = B^T K^-1 B)
//   ring      the nodes of the contact and their neighbours, all others held still, reduced like `port`
//   port      the whole body, on the first rational Krylov directions at the port (basis.hpp)
//   hyper     the whole body, a basis for its likely motions (pod_basis.hpp), and in addition to the linear patch some of its
//             elements (fit_nonlinear_terms.hpp); if that fails or they depart, `port` is built, and the patch reports it
//
// All but `hold` are one pipeline, for both kinds of port (shared_system.hpp) and both operators (frame_model.hpp):
//
//     responses of the body to the port  ->  basis V  ->  K and D on V  ->  sampled elements  ->  what the port adds
//
// K and D are the symmetric tangents, so an orthogonal projection keeps them positive semi-definite where the body's own are. A
// compressed body may have a direction without stiffness, or with a negative one along which it snaps. There a linear model would
// carry the surface away for as long as the patch lasts, while the body itself is soon stopped by its own stiffness. So each mode
// is at least as stiff as the softest mode of the body at rest: its stiffness is max(|k|, softest), and the difference is
// reported. The other stations' tools stay on the body while a patch is in use (other_tools.hpp); the basis has no direction of
// its own for their forces (docs/decisions/0010-other-tools.md). For a grasp the joint stiffness of modes and tool is then
// projected onto the positive semi-definite matrices (psd_projection.hpp).
#pragma once

#include <optional>

#include "common/patch/nonlinear_terms.hpp"
#include "server/reduction/frame_model.hpp"

namespace palpate {

/// Default number of states, two per mode: for a grasp without terms, and else all that a datagram holds. Measured: 44 for a
/// grasp gain less than 0.2 dB (docs/notebook.md, 15); 19 modes of `hyper` want more elements (71).
inline constexpr int kAttachOrder = 22, kMostOrder = 2 * kMaxModes;

struct PatchRequest {
  Scheme scheme = Scheme::port;
  int order = 0;           ///< number of states requested, 0 = default of the scheme
  Micros horizon{50'000};  ///< age that the patch will reach
  /// Longest silence expected of the link between two patches: the patch is valid for twice `horizon` plus this.
  Micros silence = kSilenceLeast;
  /// Number of surface vertices that fit into a datagram with this number of modes, without or with a load_rate, and with these
  /// numbers of relaxation branches and of other contacts.
  int (*vertices_max)(int modes, bool loaded, int branches, PatchContacts) = [](int, bool, int, PatchContacts) { return 12; };
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

/// Builds a patch for port `which` of the frame; the caller sets seq and stamp. Returns none if the port's matrix cannot be
/// solved.
std::optional<BuiltPatch> build_patch(FrameModel& frame, std::size_t which, const PatchRequest& request);
/// Returns the argument of FrameModel::request_patch() for the port of the patch.
ExpectedSlide expected_slide(const Dynamics& dynamics, const PatchRequest& request);
int modes_for(Scheme scheme, ContactKind contact, int order);

}  // namespace palpate
