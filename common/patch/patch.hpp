// A patch: the small local model of the body at one tool, valid from its stamp on.
//
// Around the state (x*, v*) of the body at the stamp t*, with x = x* + V q and V orthonormal in the mass matrix M:
//
//     q'' + D q' + K q = g + u,        q(t*) = 0,   q'(t*) = q_rate,        K = diag(stiffness)
//
// attach (the node is held by the tool at h(t), velocity h'(t); d = h - h*, d' = h' - h'*):
//     u = B_k d + B_d d'
//     force on the tool = force - K_p d - D_p d' + B_k^T q + B_d^T (q' - q_rate)
//
// Other tools on the body push the modes with a force that is g at the stamp and changes with time, w = g + load_rate (t - t*),
// until load_for after it; then it is constant. Their contacts' share of the stiffness is in K. In a touch the nearest of them
// (OtherContact) are contacts instead, which begin, slip and end by the contact law like the tool's own.
//
// touch (the tool pushes with lambda at a barycentric point w of a surface triangle; R_i are the port rows of vertex i):
//     vertex i is at  x_i = position_i + R_i q,       u = (sum_i w_i R_i)^T lambda
//     end-of-tick contact point p = p_free + C lambda;  lambda from the contact law (contact_law.hpp)
//     force on the tool = -lambda
// other tools: u += sum_o R_o^T lambda_o; lambda_o from the same law, the tool at gap_o(t) relative to the point under it
//     without its push, a plane with normal n_o that the modes move by R_o and a push by c_static,o:
//     gap_o(t) = gap_o* + v_o t' + a_o t'^2 / 2 - R_o q,   t' = min(t - t*, load_for)
// A tool with a body (tool_shape.hpp) has a contact for each of its spheres near the surface: the most loaded one is that at w,
//     with its sphere's lowest point in the tool's place, h + R a - r n; the others are the first `own` of these contacts, which
//     move with the tool, by h + R a_j - (h* + R* a_j), on the surface where that has their point; with F_j their forces on it,
//     force = sum_j F_j,   torque about h = sum_j (R a_j - r_j n_j) x F_j
//     Where the patch has terms, their surface has every such point, so the R_o of these contacts are not sent: zero.
//
// A needle (needle.hpp) has contacts along its path in the body instead: at the tip and at the points x_j of the path,
//     x_j = position_j + R_j q,   u = sum_j R_j^T lambda_j + ((1 - p) R_i + p R_(i+1))^T lambda_tip,   p: place_on_path()
// and punctures where a touch pushes it by more than F_p of the first layer along its axis.
//
// Where the body's stress relaxes (server/body/relaxation.hpp), with n variables u = (d, q) (attach) or q (touch) and H =
// [[K_p, -B_k^T], [-B_k, K]] or K, each branch k of its Prony series adds share_k s_k to the forces on u,
//     s_k' = (pull_k + H u - f - s_k) / time_k,      s_k(t*) = 0
// f the force of terms in addition to the patch (nonlinear_terms.hpp): the relaxed part tends to the force that the body would
// have after an instantaneous deformation. Exact for linear viscoelasticity; the rotation of the stress with the body during the
// time of a patch is in K.
//
// A patch without modes is static: `constant` shows `force` (scheme hold); otherwise K_p alone (attach) or the
// compliance c_static about the stress-free surface (touch) answers (scheme tangent).
//
// Shapes: r modes; K_p, D_p 3x3 [N/m], [N s/m]; B_k, B_d r x 3; R_i 3 x r [kg^-1/2]; q [m kg^1/2].
// All vectors in frame W. Times in the receiving client's clock.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "common/base/limits.hpp"
#include "common/base/tool_shape.hpp"
#include "common/base/types.hpp"
#include "common/mechanics/solid_law.hpp"
#include "common/patch/contact_law.hpp"
#include "common/patch/needle.hpp"
#include "common/patch/scheme.hpp"
#include "common/patch/suture.hpp"

namespace palpate {

template <int rows_max, int cols_max>
using BoundedMatrix =
    Eigen::Matrix<double, Eigen::Dynamic, (cols_max == 1 ? 1 : Eigen::Dynamic), Eigen::ColMajor, rows_max, cols_max>;

using ModeVector = BoundedMatrix<kMaxModes, 1>;
using ModeMatrix = BoundedMatrix<kMaxModes, kMaxModes>;
using ModePort = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::ColMajor, kMaxModes, 3>;  ///< r x 3
using PortRows = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, kMaxModes>;  ///< 3 x r

using Triangle = std::array<std::uint32_t, 3>;  ///< vertex indices, counter-clockwise seen from outside

/// A point of a triangulated surface: p = sum_k weight[k] * x[triangle[k]], weights non-negative with sum 1.
struct SurfacePoint {
  std::uint32_t triangle = 0;
  Vec3 weight = Vec3(1, 0, 0);
};

struct PortVertex {
  Vec3 position = Vec3::Zero();  ///< position at the stamp [m]
  PortRows rows;                 ///< motion with the modes
  /// Outward unit normal at the stamp where triangles outside the patch contribute to it; zero: the normal of its triangles here.
  Vec3 normal = Vec3::Zero();
};

/// Largest number of triangles of a piece of surface with that many vertices: a sphere's.
constexpr int most_triangles(int vertices) { return 2 * vertices - 4; }

/// The surface near the contact, sent with the patch so that the client finds contacts by itself between frames.
struct PortSurface {
  int vertex_count = 0, triangle_count = 0;
  std::array<PortVertex, kMaxPortVertices> vertices;
  std::array<Triangle, kMaxPortTriangles> triangles{};
};

/// Contact of another tool that touches the body, or is about to, with its expected path, or of another sphere of the same tool.
struct OtherContact {
  bool touching = false;                                      ///< contact state at the stamp
  Vec3 gap = Vec3::Zero();                                    ///< gap_o* [m]
  Vec3 velocity = Vec3::Zero(), acceleration = Vec3::Zero();  ///< v_o [m/s], a_o [m/s^2]
  Vec3 normal = Vec3::UnitZ();                                ///< n_o, outwards, of length 1
  Mat3 c_static = Mat3::Zero();                               ///< compliance there that no mode carries [m/N]
  PortRows rows;                                              ///< R_o
  ToolSphere sphere;                                          ///< of the same tool
  std::optional<ContactParameters> law = {};                  ///< of another tool; empty: as of the patch's own
};
inline constexpr int kMaxOtherContacts = static_cast<int>(kMaxToolSpheres) - 1;
struct PatchOthers {
  int count = 0;
  /// Number of those that are of the same tool, which come first. The surface of the terms moves these: R_o is zero, and
  /// c_static, alike in all directions along the surface, that of the whole body. Their pushes at the stamp are in g. Without the
  /// terms they stay where they are, and these pushes on the modes.
  int own = 0;
  std::array<OtherContact, kMaxOtherContacts> of;
  std::span<OtherContact> tools() { return std::span(of).first(static_cast<std::size_t>(count)); }
  std::span<const OtherContact> tools() const { return std::span(of).first(static_cast<std::size_t>(count)); }
  std::span<const OtherContact> of_this_tool() const { return tools().first(static_cast<std::size_t>(own)); }
  /// Those with an R_o.
  std::span<const OtherContact> of_other_tools() const { return tools().subspan(static_cast<std::size_t>(own)); }
};

/// Number of other contacts in a patch, whether its tool has a body, and jaws, the number of layers of a needle's path, and that
/// of bites of a thread: what decides their room in a datagram.
struct PatchContacts {
  int others = 0;
  bool body = false;
  int needle_layers = 0;
  bool jaws = false;
  int bites = 0;
  int own = 0;        ///< number of these that are of the same tool
  bool laws = false;  ///< true: some have their own coupling and friction
  PatchContacts(int count = 0, bool with_body = false, int layers = 0, bool with_jaws = false)  // NOLINT: a number of contacts
      : others(count), body(with_body), needle_layers(layers), jaws(with_jaws) {}
};

/// The path of a needle in the body, if the tool is one: that of its tip, or where it does not touch, that which it would take
/// from the point of the surface under it (needle.hpp).
struct PatchNeedle {
  struct Point {
    Vec3 position = Vec3::Zero();  ///< x_j at the stamp [m]
    PortRows rows;                 ///< motion with the modes
    double bond_m = 0;             ///< u_j
  };
  NeedleLayers layers;  ///< without any: the tool is no needle
  NeedleTip tip;        ///< at the stamp
  std::array<Point, kNeedlePoints> points;
  bool empty() const { return layers.count == 0; }
};

/// The thread whose end the hand holds: the tool pulls on it, and does not touch. Its forces at the stamp are not in g, nor is
/// its stiffness in K.
struct PatchSuture {
  struct Bite {
    Vec3 position = Vec3::Zero();  ///< x_j at the stamp [m]
    PortRows rows;                 ///< motion with the modes
  };
  SutureLaw law;       ///< without bites: none
  OfSpans length_m{};  ///< L_i at the stamp
  std::array<Bite, kMaxBites> bites;
  bool empty() const { return law.bites == 0; }
  std::span<const Bite> all() const { return std::span(bites).first(static_cast<std::size_t>(law.bites)); }
};

/// One branch of a stress that relaxes.
struct PatchBranch {
  PronyBranch prony;
  BoundedMatrix<kMaxModes + 3, 1> pull;  ///< pull_k [N for d, kg^1/2 m/s^2 for q]
};
struct PatchRelaxation {
  int count = 0;
  std::array<PatchBranch, kMaxPronyBranches> of;
  std::span<PatchBranch> branches() { return std::span(of).first(static_cast<std::size_t>(count)); }
  std::span<const PatchBranch> branches() const { return std::span(of).first(static_cast<std::size_t>(count)); }
};

/// Longest silence that every link is allowed: the least validity of a patch beyond the age that it is expected to reach.
inline constexpr Micros kSilenceLeast{250'000};

/// Largest components of a force [N] and of a torque [N m] in messages, in patches and elsewhere.
inline constexpr double kMaxForceN = 1e4, kMaxTorqueNM = 1e4;

struct Patch {
  std::uint32_t seq = 0;  ///< grows by one with every patch for this station
  Micros stamp{};         ///< t*
  Scheme scheme = Scheme::hold;
  ContactKind contact = ContactKind::attach;
  bool constant = false;   ///< true: show `force`, no model
  bool has_terms = false;  ///< true: terms (nonlinear_terms.hpp) follow

  // reduced dynamics
  ModeVector stiffness;  ///< K, r non-negative entries, ascending [1/s^2]
  ModeMatrix damping;    ///< D, symmetric positive semi-definite [1/s]
  ModeVector g;          ///< residual force at the stamp
  ModeVector q_rate;     ///< free motion at the stamp
  ModeVector load_rate;  ///< rate of the forces of other tools [kg^1/2 m/s^3]; r entries, or none: constant
  Micros load_for{};     ///< time after the stamp during which they change and `others` move

  Vec3 force = Vec3::Zero();  ///< force on the tool at the stamp [N]

  // attach
  Vec3 tool = Vec3::Zero(), tool_velocity = Vec3::Zero();  ///< h*, h'*
  Mat3 k_port = Mat3::Zero(), d_port = Mat3::Zero();       ///< K_p, D_p, symmetric
  ModePort b_k, b_d;

  PatchRelaxation fading;

  // touch
  double contact_stiffness_n_m = 0;  ///< k_c of the contact law, 0 = rigid
  double friction = 0;               ///< Coulomb mu
  bool touching = false;             ///< contact state at the stamp
  SurfacePoint point;                ///< contact point (touching) or nearest point, on `surface`
  Mat3 c_static = Mat3::Zero();      ///< compliance that no mode carries [m/N]
  PortSurface surface;
  PatchOthers others;  ///< contacts with the coupling and friction above, unless they have their own
  PatchNeedle needle;  ///< while its tip is inside there is no contact at `point`
  PatchSuture suture;  ///< of a tool that holds one there is no contact at `point` at all

  // a tool with a body
  Orientation turn;            ///< R*; empty for a point
  double opening = 0;          ///< o*
  ToolSphere sphere;           ///< touch: that of the contact at `point`
  Vec3 torque = Vec3::Zero();  ///< on the tool at the stamp, about the tool point [N m]

  double trust_radius_m = 0;  ///< distance of the tool from h* beyond which the force fades out
  Micros valid_for{};         ///< age beyond which the force fades out

  int modes() const { return static_cast<int>(stiffness.size()); }
  int states() const { return 2 * modes(); }
};

/// Reason for which a patch must not be played; `none` when it may. The receiver's own check, independent of the sender: every
/// number finite and in range, K and D positive semi-definite (with the port block for attach), indices inside, weights
/// barycentric. Passivity of the linear model follows from the semi-definiteness of K and D.
enum class PatchFault : std::uint8_t { none, sizes, not_finite, out_of_range, stiffness_indefinite, damping_indefinite, surface };
PatchFault check(const Patch& patch);
const char* describe(PatchFault fault);

}  // namespace palpate
