// Grasp and release of a body by a tool, without a step in the path of the body or in the force on the hand: both fade along the
// minimum-jerk curve m (minimum_jerk.hpp).
//
// A grasp begins at t_0 with its node d = x_node - x_tool away from the tool, and removes this difference within kGraspTime:
//     x_node(t) = x_tool(t) + (1 - m((t - t_0) / kGraspTime)) d
// A tool further than kGraspReachM from its node does not grasp it: a hand that returns from elsewhere would be pulled, and the
// body with it.
//
// A tool is released because the body was reset or because the tool cost more computation than one hand may. The force F_0 and
// torque T_0 that the hand felt then, at t_0, fade together, whatever the tool does meanwhile:
//     F(t) = (1 - m((t - t_0) / kFadeTime)) F_0,        T(t) likewise
// Afterwards, and not before `off` has passed, the tool may touch again, but only from outside: from inside it would tear the
// body open.
#pragma once

#include <algorithm>
#include <memory>
#include <vector>

#include "common/base/grasp_reach.hpp"
#include "common/base/minimum_jerk.hpp"
#include "common/base/wrench.hpp"
#include "server/body/skin.hpp"
#include "server/dynamics/needle_ports.hpp"
#include "server/room/tool_track.hpp"
#include "server/scene/scene.hpp"

namespace palpate {

inline constexpr Micros kGraspTime{500'000};  ///< for a distance of at most kGraspReachM: the node moves at 0.19 m/s at most

/// Returns the number of the skin's copy for the scene's tool number `held`.
inline std::uint8_t copy_of(const Scene& scene, std::size_t held) {
  const std::vector<double> radii = scene.contact_radii();
  return static_cast<std::uint8_t>(std::ranges::find(radii, scene.tool_of(held).radius_m) - radii.begin());
}

/// Returns what all ports of the scene's tool number `held` have; `tool`: their number of it.
inline ToolPort port_of(const Scene& scene, std::size_t held, std::uint32_t tool) {
  const ToolSpec& spec = scene.tool_of(held);
  ToolPort port;
  port.kind = spec.contact;
  port.node = spec.node;
  port.parameters = {spec.contact_stiffness_n_m, spec.friction};
  port.tool = tool;
  port.skin_copy = copy_of(scene, held);
  return port;
}

/// Returns the ports of a tool: one for each sphere of its body, those of a needle in `tissue`, or the point itself.
inline std::vector<ToolPort> parts_of(const ToolSpec& spec, const NeedleTissue* tissue, const ToolPort& port) {
  const ToolShape& shape = spec.shape;
  if (spec.needle) {
    ToolPort needle = port;
    needle.sphere.slide_m = spec.needle->stroke_m;
    return needle_ports(needle, *tissue);
  }
  if (shape.empty()) return {port};
  std::vector<ToolPort> parts(shape.size(), port);
  for (std::size_t k = 0; k < shape.size(); ++k) {
    parts[k].body = true;
    parts[k].sphere = shape[k];
  }
  return parts;
}

/// Returns the port of a tool that holds the end of a thread; `port`: what all have.
inline ToolPort suture_port(const BodyState& state, std::uint32_t which, ToolPort port) {
  port.suture = which;
  port.bite = last_bite(state, which);
  port.touching = true;
  return port;
}

/// Returns force and torque of a contact on its tool, about the tool point; `normal`: of the surface there.
inline Wrench wrench_of(const ToolPort& port, const TurningTool& tool, const Vec3& normal) {
  const Vec3 force = -port.lambda;
  if (!port.body) return force;
  return {force, (contact_place(port, tool.centre_of(port.sphere).position, normal) - tool.at.position).cross(force)};
}

struct ReleaseFade {
  static constexpr Micros kFadeTime{300'000};  ///< a force changes by at most 0.6 % of itself per tick

  FadingVector force, torque;  ///< on the tool [N], about the tool point [N m]
  Micros off = kFadeTime;

  ReleaseFade(Micros since, const Wrench& felt, Micros for_at_least = kFadeTime)
      : force{since, kFadeTime, felt.force}, torque{since, kFadeTime, felt.torque}, off(for_at_least) {}
  /// Returns true if the scene's tool number `held` may grasp or touch a body at `x` from now on.
  bool over(Micros now, const Scene& scene, std::size_t held, const Skin& skin, const Vector& x, const TurningTool& tool) const {
    const ToolSpec& spec = scene.tool_of(held);
    if (now < force.begin + off) return false;
    if (spec.contact == ContactKind::attach || skin.empty()) return true;
    const std::vector<double> surface = skin.place(x);
    const auto is_outside = [&](const ToolSphere& part) {
      return skin.nearest(copy_of(scene, held), surface, tool.centre_of(part).position).height_m > part.radius_m;
    };
    return spec.shape.empty() ? is_outside({}) : std::all_of(spec.shape.begin(), spec.shape.end(), is_outside);
  }
};

}  // namespace palpate
