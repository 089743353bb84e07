// The ports of a needle (common/patch/needle.hpp): where they are on the body, and how they go on.
//
// A needle has a port for its tip, which is that of a point while it is outside, and one for its shaft at each point of its path.
// They follow one another, the tip first. Those of the shaft touch where the shaft has reached their point.
#pragma once

#include "server/dynamics/stepper.hpp"

namespace palpate {

/// Returns the ports of a needle outside; `port`: what all have. `tissue` must outlive them.
std::vector<ToolPort> needle_ports(const ToolPort& port, const NeedleTissue& tissue);
/// Puts a needle that is outside, of these ports, into the body; its shaft sticks from the first stage on.
void put_in_body(const NeedleInBody& needle, std::vector<ToolPort>& ports);
/// Returns the needle whose tip is that port; none while it is outside.
std::optional<NeedleInBody> needle_in_body(const ToolPort& port);
/// Returns the weights of the point of the body at which a port pushes.
NodeWeights weights_of(const Skin& skin, const ToolPort& port);
/// Returns its position, with `b` = weights_of(port).
Vec3 position_of(const Skin& skin, const ToolPort& port, const NodeWeights& b, const Vector& x);
/// Returns the point of a needle that is joined to that point; `tip`: the tool point.
Vec3 joined_point(const ToolPort& port, const Vec3& tip);
/// Returns the point of a tool at which it meets the body, with its sphere or its tip at `tool`; `normal`: of the surface.
inline Vec3 contact_place(const ToolPort& port, const Vec3& tool, const Vec3& normal) {
  return port.on_path() ? joined_point(port, tool) : port.lowest(tool, normal);
}
/// Returns the unit vector along which a contact on a path is bounded, and its contact.
Vec3 along_path(const ToolPort& port, const Vector& x);
PathContact path_contact(const ToolPort& port);
/// Moves contact k, on a path, by its slip. A tip that leaves the body takes its shaft with it.
void slide_on_path(std::vector<ToolPort>& ports, std::size_t k, double slip_m, const Vector& x);
/// Takes the needle of port k out of the body.
void leave_body(std::vector<ToolPort>& ports, std::size_t k);
/// After a stage: needles whose tips are pushed hard enough puncture, and shafts follow their tips. Returns true if one
/// punctured.
bool follow_needles(const std::vector<Vec3>& tool_points, const Vector& x, std::vector<ToolPort>& ports);
/// Sets the path that each needle outside would take from where it touches the surface, or is nearest to it, along its axis.
void predict_paths(const Vector& x, std::vector<ToolPort>& ports);

}  // namespace palpate
