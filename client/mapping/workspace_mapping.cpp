#include "client/mapping/workspace_mapping.hpp"

#include <algorithm>
#include <numbers>

#include "client/mapping/force_fade.hpp"
#include "common/base/error.hpp"
#include "common/base/limits.hpp"

namespace palpate {

namespace {

void check_button(const std::optional<int>& button, const char* field, const DeviceCaps& caps, std::string_view where) {
  if (!button || *button < caps.buttons) return;
  throw InputError(std::string(where), std::string(field) + " is " + std::to_string(*button),
                   caps.buttons == 0 ? "no such field: " + caps.name + " has no buttons"
                                     : "0 to " + std::to_string(caps.buttons - 1) + ", the buttons of " + caps.name);
}

/// Returns the part of a force limit that the weight leaves for the body.
double left_of(double limit_n, const WorkspaceMapping& mapping, std::string_view where) {
  if (limit_n <= 0) return limit_n;
  const double weight_n = mapping.tool_weight_n.norm();
  if (weight_n >= limit_n)
    throw InputError(std::string(where), "tool_weight_n is " + std::to_string(weight_n) + " N",
                     "less than the " + std::to_string(limit_n) + " N that the device can hold");
  return (limit_n - weight_n) / mapping.force_scale;
}

Eigen::AlignedBox3d reach_of(const Eigen::AlignedBox3d& box, const WorkspaceMapping& mapping, const Vec3& place,
                             const std::optional<Vec3>& centre) {
  Eigen::AlignedBox3d reach;
  if (box.isEmpty()) return reach;
  if (mapping.indexes()) return {Vec3::Constant(-kWorldExtentM), Vec3::Constant(kWorldExtentM)};
  const Eigen::AlignedBox3d from_centre =
      centre ? Eigen::AlignedBox3d(box.min() - *centre, box.max() - *centre) : Eigen::AlignedBox3d(-box.sizes(), box.sizes());
  const Mat3 turn = mapping.scale * mapping.rotation();
  for (int k = 0; k < 8; ++k) reach.extend(place + turn * from_centre.corner(static_cast<Eigen::AlignedBox3d::CornerType>(k)));
  return reach;
}

}  // namespace

Mat3 WorkspaceMapping::rotation() const {
  const Vec3 angles = rotation_deg * (std::numbers::pi / 180);
  return (Eigen::AngleAxisd(angles.z(), Vec3::UnitZ()) * Eigen::AngleAxisd(angles.y(), Vec3::UnitY()) *
          Eigen::AngleAxisd(angles.x(), Vec3::UnitX()))
      .toRotationMatrix();
}

DeviceCaps mapped_caps(const DeviceCaps& caps, const WorkspaceMapping& mapping, const Vec3& place,
                       const std::optional<Vec3>& centre, std::string_view where) {
  check_button(mapping.clutch_button, "clutch_button", caps, where);
  check_button(mapping.dead_man_button, "dead_man_button", caps, where);
  check_button(mapping.jaws_button, "jaws_button", caps, where);
  DeviceCaps mapped = caps;
  mapped.has_opening |= mapping.jaws_button.has_value();
  mapped.force_max_n = left_of(caps.force_max_n, mapping, where);
  mapped.force_continuous_n = left_of(caps.force_continuous_n, mapping, where);
  mapped.slew_max_n_s = caps.slew_max_n_s / mapping.force_scale;
  if (mapping.indexes()) mapped.slew_max_n_s = std::max(0.0, mapped.slew_max_n_s - kFadeSlewMax1S * mapped.force_max_n);
  mapped.stiffness_max_n_m = caps.stiffness_max_n_m / (mapping.force_scale * mapping.scale);
  const double torque_scale = mapping.scale / mapping.force_scale;
  mapped.torque_max_nm = torque_scale * caps.torque_max_nm;
  mapped.torque_continuous_nm = torque_scale * caps.torque_continuous_nm;
  mapped.torque_slew_max_nm_s = torque_scale * caps.torque_slew_max_nm_s;
  if (mapping.indexes())
    mapped.torque_slew_max_nm_s = std::max(0.0, mapped.torque_slew_max_nm_s - kFadeSlewMax1S * mapped.torque_max_nm);
  mapped.torsion_stiffness_max_nm_rad = torque_scale * caps.torsion_stiffness_max_nm_rad;
  mapped.velocity_max_m_s = caps.velocity_max_m_s * mapping.scale;
  mapped.workspace = reach_of(caps.workspace, mapping, place, centre);
  return mapped;
}

std::optional<Vec3> centre_of(const WorkspaceMapping& mapping, const DeviceCaps& caps, bool grasps) {
  if (mapping.centre_m) return mapping.centre_m;
  const bool known = !caps.workspace.isEmpty();
  const bool in_the_middle = mapping.anchor == Anchor::workspace || (mapping.anchor == Anchor::automatic && !grasps);
  return known && in_the_middle ? std::optional<Vec3>(caps.workspace.center()) : std::nullopt;
}

std::optional<WorkspaceMapping> mapping_for(const std::vector<NamedMapping>& all, const std::string& device) {
  for (const std::string& name : {device, device.substr(0, device.find(':'))})
    for (const NamedMapping& named : all)
      if (named.device == name) return named.mapping;
  return std::nullopt;
}

}  // namespace palpate
