// A needle in a body: its path, the layers that it goes through, and the law of its contacts, the same code on both ends.
//
// The path of a needle begins at the point of the surface that it punctured and is straight at that moment; it is made of
// material points at the depths l_j = j spacing (j = 0 ... kNeedlePoints - 1), in lengths of the body at rest, and linear between
// them, x(s) = x_j + (s - l_j) tau, tau = (x_(j+1) - x_j) / spacing. The tip is at the depth s, the front of the cut at c >= s,
// the furthest that the tip has been. Contacts of a needle at h with the axis a (tip to hand):
//
//     tip     at x(s) with f along t = tau / |tau|: 0 <= f . t <= L,   L = 0 where s < c (the tip lies in its own cut),
//             L = J w at the front (cutting_n),   L = F_p at a layer that is not open yet
//     shaft   at x_j with f_a along a: |f_a| <= sum F_s m_j,   m_j the length of shaft in a layer that x_j stands for, integral
//             of its hat function over the layer up to s;  a point of the shaft, a u_j from the tip, sticks to x_j until then
//
// Across their axes both are springs: k_c at the tip, k_c m_j / spacing at x_j, m_j of all layers of the body; along it k_c at
// the tip and sum F_s m_j / kStick at x_j. Each contact is a return map, as Coulomb friction is: with the gap g from the material
// point to the tool without this contact's force, C the compliance of the body there, K = k_across (1 - t t^T) + k_along t t^T,
//
//     lambda = K (g - C lambda)   if its part along t is within [least, most];   else that part is the bound nearest to it,
//     and the contact slips along t by   t . (g - C lambda) - bound / k_along   (k_along = 0: the whole of it)
//
// so that it never gives energy: the front and the bonds u_j move only along the force that moves them. Cutting dissipates
// J w |tau| dc. A bound of J w / |tau| would dissipate J w dc whatever the strain before the tip, but where J / E is centimetres,
// as in liver, an edge then compresses what it is to cut, bears more for it, and does not cut.
//
// Shapes and units: x, h 3 [m], tau 3 [1], s, c, l, u, m [m]; lambda, g 3 [N], [m]; C 3 x 3 [m/N]; J w, F_p [N], F_s [N/m].
// What can go wrong: a path that the needle is bent away from stays straight in the body: a needle does not cut sideways.
// Source: of the energy balance Mahvash and Dupont, IEEE Trans. Biomed. Eng. 57 (2010); of the return map Simo and Hughes,
// Computational Inelasticity (1998).
#pragma once

#include <algorithm>
#include <array>
#include <span>

#include "common/base/types.hpp"

namespace palpate {

inline constexpr int kNeedlePoints = 5;     ///< of a path; more: fewer modes in a datagram
inline constexpr int kMaxNeedleLayers = 8;  ///< along a path, with gaps in the body and what lies behind it
inline constexpr double kMinNeedleLengthM = 0.005, kMaxNeedleLengthM = 0.3;
inline constexpr double kNeedleStickM = 0.0005;  ///< kStick: a shaft sticks for this way; Dahl's presliding, of tissue's surface

/// A layer of the body along a path. All zero in a gap of the body, and behind it.
struct NeedleLayer {
  double begins_m = 0;      ///< depth at which the path enters it
  double puncture_n = 0;    ///< F_p: push with which a tip enters it
  double cutting_n = 0;     ///< J w
  double friction_n_m = 0;  ///< F_s
  bool is_outside() const { return puncture_n == 0 && cutting_n == 0; }
};

/// Layers of a path, in order; the first begins at 0.
struct NeedleLayers {
  int count = 0;
  double length_m = 0;  ///< longest depth of the tip
  std::array<NeedleLayer, kMaxNeedleLayers> of;
  std::span<const NeedleLayer> all() const { return std::span(of).first(static_cast<std::size_t>(count)); }
  double spacing_m() const { return length_m / (kNeedlePoints - 1); }
};

/// Place of a needle's tip on its path.
struct NeedleTip {
  bool inside = false;
  double depth_m = 0, front_m = 0;  ///< s, c
  int layer = 0;                    ///< number of the deepest layer that is open
};

/// Bounds of f . t and stiffnesses of one contact.
struct PathContact {
  double across_n_m = 0, along_n_m = 0;
  double least_n = 0, most_n = 0;
};
struct PathClosure {
  Vec3 lambda = Vec3::Zero();  ///< on the body [N]
  double slip_m = 0;           ///< of the tool along t
};
/// Closes one contact; `t` of length 1.
PathClosure close_on_path(const Vec3& gap, const Mat3& compliance, const Vec3& t, const PathContact& contact) noexcept;

/// Returns the contact of the tip.
PathContact tip_contact(const NeedleLayers& layers, const NeedleTip& tip, double contact_stiffness_n_m) noexcept;
/// Moves the tip by a slip of its contact, in lengths at rest: into its own cut, into the front, out of it; at a closed layer a
/// slip opens the layer and the tip stays. Out of the body nothing of its path remains.
void move_tip(const NeedleLayers& layers, NeedleTip& tip, double slip_m) noexcept;

/// Share of the shaft in the body that x_j stands for: its length, m_j of all layers, and its friction, sum F_s m_j.
struct ShaftShare {
  double length_m = 0, friction_n = 0;
};
ShaftShare shaft_share(const NeedleLayers& layers, const NeedleTip& tip, int j) noexcept;
/// Returns the contact of a share of the shaft with a length.
PathContact shaft_contact(const NeedleLayers& layers, const ShaftShare& share, double contact_stiffness_n_m) noexcept;

/// Returns j and the share of the way from l_j to l_(j+1), j + 1 < kNeedlePoints; beyond the last point more than 1.
struct PathPlace {
  int j = 0;
  double part = 0;
};
PathPlace place_on_path(const NeedleLayers& layers, double depth_m) noexcept;

}  // namespace palpate
