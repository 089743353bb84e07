// Mapping of a device's own space to the body's: scale, rotation and offset of one device.
//
// D is the device's frame as provided by its adapter (SI, right-handed, z up, the device's own origin), W the scene's. With the
// scale s and the rotation R = R_WD
//
//     p_WT = c + s R p_DT,        R_WT = R R_DT,        F_D = g R^T F_W - w,        T_D = (g / s) R^T T_W
//
// p the tool point [m], F the force on the tool [N], T the torque about its point [N m], g the force scale, w the weight of the
// object in the hand, as it pulls at the device [N, in D]: its opposite is added, so that the tool is weightless. The offset c
// maps a point of D, the centre, to the scene's home, displaced by offset_m: c = home + offset - s R centre.
//
// Forces are not scaled by default (g = 1): trainees learn how many newtons tissue needs, and these stay correct at any scale. A
// body of stiffness K feels like g s K, and the power that the hand receives is (g / s) times that which the tool receives from
// the body. That factor is one positive constant: whatever is passive in the scene is passive in the hand, and the guard, which
// accounts for energy in W, judges the correct sign. g = s preserves the power itself and g = 1 / s the stiffness. The limits of
// the device limit its image in W: stiffness K_D / (g s), velocity s v_D, forces (F_D - |w|) / g,
// torques s T_D / g and their stiffness likewise.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "client/device/device.hpp"

namespace palpate {

/// Selects the point of D that is mapped to the scene's home.
enum class Anchor : std::uint8_t {
  automatic,  ///< `workspace` where the device reports it and the scene is touched, else `start`
  workspace,  ///< the middle of the box that the device can reach
  start       ///< position of the tool when the device is first ok
};

struct WorkspaceMapping {
  double scale = 1;                   ///< s: metres in the scene per metre of the device, kScaleLeast to kScaleMost
  Vec3 rotation_deg = Vec3::Zero();   ///< R: about x, then y, then z (fixed axes)
  Vec3 offset_m = Vec3::Zero();       ///< offset from the scene's home, in W
  std::optional<Vec3> centre_m = {};  ///< the point of D that is mapped there; empty: see `anchor`
  Anchor anchor = Anchor::automatic;
  double force_scale = 1;              ///< g
  Vec3 tool_weight_n = Vec3::Zero();   ///< w, in D: (0, 0, -0.3) for a tool of 30 g that hangs on the device
  std::optional<int> clutch_button;    ///< while it is held the device moves without the tool (mapped_device.hpp)
  std::optional<int> dead_man_button;  ///< while it is not held there is no force
  std::optional<int> jaws_button;      ///< while it is held jaws close, else they open; empty: the device's own opening

  Mat3 rotation() const;  ///< R_WD
  /// True when a button lets the device move without the tool, so that c changes.
  bool indexes() const { return clutch_button || dead_man_button; }
};

inline constexpr double kScaleLeast = 0.05, kScaleMost = 20;
inline constexpr double kForceScaleLeast = 0.01, kForceScaleMost = 10;
inline constexpr double kToolWeightMostN = 20;
inline constexpr double kJawsButton1S = 2;  ///< by which a button closes and opens jaws, a share of their opening
inline constexpr int kMaxButtons = 32;

/// Returns the device's capabilities as seen from the scene. `place`: position of the centre in W; `centre`: result of
/// centre_of(). The box is the reach of the tool: the whole world for a device that indexes; for one whose centre is not known
/// yet, everything that may be within reach; empty where the device does not report its own. Throws InputError, with `where` as
/// the place, for a button that the device does not have and for a weight that exceeds its force.
DeviceCaps mapped_caps(const DeviceCaps& caps, const WorkspaceMapping& mapping, const Vec3& place,
                       const std::optional<Vec3>& centre, std::string_view where);

/// Returns the centre if it is known before the device moves; empty: the first position of the tool.
std::optional<Vec3> centre_of(const WorkspaceMapping& mapping, const DeviceCaps& caps, bool grasps);

/// A mapping for each of several devices, by name.
struct NamedMapping {
  std::string device;  ///< name as in --device: of one device, or of a kind for all devices of that kind
  WorkspaceMapping mapping;
};

/// Returns the mapping of `device` ("openhaptics:left"), else that of its kind ("openhaptics"), else nothing.
std::optional<WorkspaceMapping> mapping_for(const std::vector<NamedMapping>& all, const std::string& device);

}  // namespace palpate
