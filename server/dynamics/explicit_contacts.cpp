#include "server/dynamics/explicit_contacts.hpp"

#include <algorithm>

namespace palpate {

Vec3 ExplicitContact::gather(const NodeArrays& y) const {
  Vec3 sum = Vec3::Zero();
  for (const auto& [node, weight] : b) sum += weight * y.at(node);
  return sum;
}

double ExplicitContact::softness_1_kg(const ExplicitContact& other, const ExplicitBody& body) const {
  double sum = 0;
  for (const auto& [node, weight] : b)
    for (const auto& [same, its_weight] : other.b)
      if (node == same) sum += weight * its_weight * body.inverse_mass(node);
  return sum;
}

void ExplicitContacts::take(const BodyState& state, const std::vector<ToolPort>& ports) {
  contacts_.assign(ports.size(), {});
  looked_for_s_.assign(ports.size(), state.time_s);
  const bool any_touch = std::any_of(ports.begin(), ports.end(), [](const ToolPort& p) { return p.kind == ContactKind::touch; });
  if (any_touch && !skin_->empty()) skin_->place(state.x, skin_positions_);
}

void ExplicitContacts::look(const ExplicitBody& body, std::vector<ToolPort>& ports, double at_s, const ToolMotion& tools) {
  constexpr double kFastestMS = 1;  // closing speed of tool and surface
  bool placed = false;
  for (std::size_t k = 0; k < ports.size(); ++k) {
    ToolPort& port = ports[k];
    if (port.kind != ContactKind::touch || port.touching || skin_->empty() || at_s < looked_for_s_[k]) continue;
    if (!placed) {
      Vector x(3 * static_cast<Eigen::Index>(body.body().nodes.size()));
      for (std::uint32_t i = 0; i < body.body().nodes.size(); ++i) at_node(x, i) = body.body().nodes[i] + body.u.at(i);
      skin_->place(x, skin_positions_);
      placed = true;
    }
    const Onset onset =
        skin_->look_for_contact(port.skin_copy, skin_positions_, tools(k, at_s).position, port.sphere.radius_m, port.clearance);
    port.point = onset.nearest.point;
    port.lambda.setZero();
    port.touching = onset.touches;
    looked_for_s_[k] = at_s + std::max(kLookS, (onset.nearest.height_m - port.sphere.radius_m) / kFastestMS);
  }
}

std::vector<std::size_t> ExplicitContacts::meet(const std::vector<ToolPort>& ports, double end_s, const ToolMotion& tools) {
  std::vector<std::size_t> touching;
  for (std::size_t k = 0; k < ports.size(); ++k) {
    if (ports[k].kind != ContactKind::touch || !ports[k].touching) continue;
    refreshed(k, ports[k].point);
    contacts_[k].tool = tools(k, end_s).position;
    touching.push_back(k);
  }
  return touching;
}

void ExplicitContacts::look_again(const ExplicitBody& body, std::size_t k) {
  for (const std::uint32_t i : contacts_[k].around) {
    Vec3 at = vertex(skin_->rest(), i);
    for (const auto& [j, weight] : skin_->vertex_weights(i)) at += weight * body.u.at(j);
    Eigen::Map<Vec3>(skin_positions_.data() + 3 * std::size_t{i}) = at;
  }
  contacts_[k].normal = normal_at(skin_->view(), skin_positions_, contacts_[k].point);
}

bool ExplicitContacts::slide_on(const ExplicitBody& body, std::size_t k, const Vec3& slip, ToolPort& port) {
  if (!(slip.norm() > kSlipToleranceM)) return false;
  port.point = slide(skin_->view(), skin_positions_, port.point, slip);
  refreshed(k, port.point);
  look_again(body, k);
  return true;
}

void ExplicitContacts::finish(std::size_t k, const Vec3& slip, const Vec3& end, double end_s, ToolPort& port) {
  port.touching = port.lambda.squaredNorm() > 0;
  if (!port.touching) port.clearance = clearance_of(port.point, contacts_[k].tool - end, contacts_[k].normal);
  looked_for_s_[k] = end_s + kLookS;
  if (slip.squaredNorm() > 0) port.point = slide(skin_->view(), skin_positions_, port.point, slip);
}

const ExplicitContact& ExplicitContacts::refreshed(std::size_t k, const SurfacePoint& point) {
  ExplicitContact& contact = contacts_[k];
  if (contact.valid && contact.point.triangle == point.triangle && contact.point.weight == point.weight) return contact;
  if (!contact.valid || contact.point.triangle != point.triangle) contact.around = vertices_around(point.triangle);
  contact.valid = true;
  contact.point = point;
  contact.b = skin_->weights(point);
  contact.at_rest = position_at(skin_->view(), skin_->rest(), point);
  return contact;
}

/// Returns the vertices that determine the normal at a point of the triangle and the next triangle that it slides to.
std::vector<std::uint32_t> ExplicitContacts::vertices_around(std::uint32_t triangle) const {
  const SurfaceView surface = skin_->view();
  std::vector<std::uint32_t> vertices;
  for (const std::uint32_t corner : surface.triangles[triangle])
    for (std::uint32_t e = surface.first[corner]; e < surface.first[corner + 1]; ++e)
      for (const std::uint32_t i : surface.triangles[surface.incident[e]]) vertices.push_back(i);
  std::sort(vertices.begin(), vertices.end());
  vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
  return vertices;
}

}  // namespace palpate
