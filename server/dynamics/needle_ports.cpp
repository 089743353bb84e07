#include "server/dynamics/needle_ports.hpp"

namespace palpate {
namespace {

const NeedlePath::Point& shaft_point(const ToolPort& port) {
  return port.needle.path->points[static_cast<std::size_t>(port.needle.point)];
}

/// Position of the tip on its path, and the path's derivative by the depth.
struct TipPlace {
  Vec3 at, tau;
};
TipPlace tip_place(const NeedlePort& needle, const Vector& x) {
  TipPlace place;
  place.at = needle.path->position(needle.tip.depth_m, x, place.tau);
  return place;
}

/// Returns the ports of the shaft whose tip is port k.
std::span<ToolPort> shaft_of(std::vector<ToolPort>& ports, std::size_t k) {
  return std::span(ports).subspan(k + 1, kNeedlePoints);
}

void part_from_body(ToolPort& port) {
  port.touching = false;
  port.lambda.setZero();
}

}  // namespace

std::vector<ToolPort> needle_ports(const ToolPort& port, const NeedleTissue& tissue) {
  std::vector<ToolPort> ports;
  ToolPort part = port;
  part.body = true;
  part.needle.part = NeedlePart::tip;
  part.needle.tissue = &tissue;
  ports.push_back(part);
  part.needle.part = NeedlePart::shaft;
  for (part.needle.point = 0; part.needle.point < kNeedlePoints; ++part.needle.point) ports.push_back(part);
  return ports;
}

void put_in_body(const NeedleInBody& needle, std::vector<ToolPort>& ports) {
  const auto path = ports.front().needle.tissue->path_of(needle);
  for (ToolPort& port : ports) {
    port.needle.path = path;
    port.needle.tip = needle.tip;
  }
  ports.front().touching = true;
}

std::optional<NeedleInBody> needle_in_body(const ToolPort& port) {
  const NeedlePort& needle = port.needle;
  if (needle.part != NeedlePart::tip || !needle.tip.inside) return std::nullopt;
  return NeedleInBody{needle.path->rest, needle.path->edge, needle.path->layers, needle.tip};
}

NodeWeights weights_of(const Skin& skin, const ToolPort& port) {
  if (port.suture) return *port.bite;
  if (!port.on_path()) return skin.weights(port.point);
  if (port.needle.part == NeedlePart::shaft) return shaft_point(port).b;
  return port.needle.path->weights(port.needle.tip.depth_m);
}

Vec3 position_of(const Skin& skin, const ToolPort& port, const NodeWeights& b, const Vector& x) {
  if (port.suture) return gather(b, x);
  if (!port.on_path()) return skin.position(port.point, b, x);
  return port.needle.part == NeedlePart::shaft ? shaft_point(port).position(x) : tip_place(port.needle, x).at;
}

Vec3 joined_point(const ToolPort& port, const Vec3& tip) {
  return port.needle.part == NeedlePart::shaft ? Vec3(tip + port.needle.bond_m * port.needle.axis) : tip;
}

Vec3 along_path(const ToolPort& port, const Vector& x) {
  return port.needle.part == NeedlePart::shaft ? port.needle.axis : tip_place(port.needle, x).tau.normalized();
}

PathContact path_contact(const ToolPort& port) {
  const NeedlePort& needle = port.needle;
  const NeedleLayers& layers = needle.path->layers;
  const double stiffness_n_m = port.parameters.contact_stiffness_n_m;
  if (needle.part == NeedlePart::tip) return tip_contact(layers, needle.tip, stiffness_n_m);
  return shaft_contact(layers, shaft_share(layers, needle.tip, needle.point), stiffness_n_m);
}

void leave_body(std::vector<ToolPort>& ports, std::size_t k) {
  if (ports[k].needle.part == NeedlePart::shaft) k -= static_cast<std::size_t>(ports[k].needle.point) + 1;
  ports[k].needle.tip = {};
  ports[k].clearance = {};
  part_from_body(ports[k]);
  for (ToolPort& part : shaft_of(ports, k)) part_from_body(part);
}

void slide_on_path(std::vector<ToolPort>& ports, std::size_t k, double slip_m, const Vector& x) {
  NeedlePort& needle = ports[k].needle;
  if (needle.part == NeedlePart::shaft) {
    needle.bond_m -= slip_m;
    return;
  }
  move_tip(needle.path->layers, needle.tip, slip_m / tip_place(needle, x).tau.norm());
  if (!needle.tip.inside) leave_body(ports, k);
}

bool follow_needles(const std::vector<Vec3>& tool_points, const Vector& x, std::vector<ToolPort>& ports) {
  bool punctured = false;
  for (std::size_t k = 0; k < ports.size(); ++k) {
    NeedlePort& tip = ports[k].needle;
    if (tip.part != NeedlePart::tip) continue;
    if (!tip.tip.inside && ports[k].touching && -tip.axis.dot(ports[k].lambda) > tip.tissue->puncture_n()) {
      tip.path = tip.tissue->path(ports[k].point, -tip.axis, tip.edge, x);
      tip.tip = {true, 0, 0, 0};
      punctured = true;
    }
    for (ToolPort& part : shaft_of(ports, k)) {
      part.needle.tip = tip.tip;
      if (!tip.tip.inside) continue;
      part.needle.path = tip.path;
      const bool reached = shaft_share(tip.path->layers, tip.tip, part.needle.point).length_m > 0;
      if (reached && !part.touching) part.needle.bond_m = tip.axis.dot(shaft_point(part).position(x) - tool_points[k]);
      if (!reached) part_from_body(part);
      part.touching = reached;
    }
  }
  return punctured;
}

void predict_paths(const Vector& x, std::vector<ToolPort>& ports) {
  for (std::size_t k = 0; k < ports.size(); ++k) {
    NeedlePort& tip = ports[k].needle;
    if (tip.part != NeedlePart::tip || tip.tip.inside) continue;
    tip.path = tip.tissue->path(ports[k].point, -tip.axis, tip.edge, x);
    for (ToolPort& part : shaft_of(ports, k)) part.needle.path = tip.path;
  }
}

}  // namespace palpate
