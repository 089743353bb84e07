// From a device's own space to the body's: scale, rotation and offset of one device.
//
// D is the device's frame as its adapter gives it (SI, right-handed, z up, the device's own origin), W the scene's. With the
// scale s and the rotation R = R_WD
//
//     p_WT = c + s R p_DT,        R_WT = R R_DT,        F_D = g R^T F_W - w
//
// p the tool point [m], F the force on the tool [N], g the force scale, w the weight of what the hand holds, as it pulls at the
// device [N, in D]: its opposite is added, so that the tool weighs nothing. The offset c puts a point of D, the centre, on the
// scene's home, moved by offset_m: c = home + offset - s R centre.
//
// Forces are not scaled by default (g = 1): what a trainee learns is how many newtons tissue takes, and they stay true whatever
// the scale. A body of stiffness K feels like g s K, and the power that the hand takes is (g / s) times that which the tool takes
// from the body. That is one positive number for all times: whatever is passive in the scene is so in the hand, and the guard,
// which weighs energy in W, judges the sign of the hand's. g = s would keep the power itself and g = 1 / s the stiffness.
// What limits the device limits its image in W: stiffness K_D / (g s), velocity s v_D, forces (F_D - |w|) / g.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "client/device/device.hpp"

namespace palpate {

/// Which point of D comes to the scene's home.
enum class Anchor : std::uint8_t {
  automatic,  ///< `workspace` where the device knows it and the scene is touched, else `start`
  workspace,  ///< the middle of the box that the device reaches
  start       ///< where the tool is when the device is first well
};

struct WorkspaceMapping {
  double scale = 1;                   ///< s: metres in the scene for one at the device, kScaleLeast to kScaleMost
  Vec3 rotation_deg = Vec3::Zero();   ///< R: about x, then y, then z (fixed axes)
  Vec3 offset_m = Vec3::Zero();       ///< from the scene's home, in W
  std::optional<Vec3> centre_m = {};  ///< the point of D that comes there; nothing: as `anchor` says
  Anchor anchor = Anchor::automatic;
  double force_scale = 1;              ///< g
  Vec3 tool_weight_n = Vec3::Zero();   ///< w, in D: (0, 0, -0.3) for a tool of 30 g that hangs on the device
  std::optional<int> clutch_button;    ///< while it is held the device moves without the tool (mapped_device.hpp)
  std::optional<int> dead_man_button;  ///< while it is not held there is no force

  Mat3 rotation() const;  ///< R_WD
  /// It has a button with which the device moves on without the tool: c changes.
  bool indexes() const { return clutch_button || dead_man_button; }
};

inline constexpr double kScaleLeast = 0.05, kScaleMost = 20;
inline constexpr double kForceScaleLeast = 0.01, kForceScaleMost = 10;
inline constexpr double kToolWeightMostN = 20;
inline constexpr int kMaxButtons = 32;

/// What the device can do, as the scene sees it. `place`: where the centre comes to, in W; `centre` as centre_of() says it. The
/// box is all that the tool can reach: of a device that indexes the whole world, of one whose centre is not known yet what may be
/// within reach from there; empty where the device does not know its own. Throws InputError, with `where` as the place, for a
/// button that the device does not have and for a weight that takes all its force.
DeviceCaps mapped_caps(const DeviceCaps& caps, const WorkspaceMapping& mapping, const Vec3& place,
                       const std::optional<Vec3>& centre, std::string_view where);

/// The centre as far as it is known before the device moves; nothing: where the tool is first.
std::optional<Vec3> centre_of(const WorkspaceMapping& mapping, const DeviceCaps& caps, bool grasps);

/// A mapping for each of several devices, by name.
struct NamedMapping {
  std::string device;  ///< as --device names it: with its own name, or that of its kind for all of that kind
  WorkspaceMapping mapping;
};

/// That of `device` ("openhaptics:left"), else that of its kind ("openhaptics"), else nothing.
std::optional<WorkspaceMapping> mapping_for(const std::vector<NamedMapping>& all, const std::string& device);

}  // namespace palpate
