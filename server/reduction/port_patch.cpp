// What a port adds to a patch whose modes are set: a held node its own stiffness and its coupling with the modes, a point of the
// surface the surface around it and what the modes lack of its compliance.
#include <algorithm>
#include <cassert>

#include "common/base/part_above.hpp"
#include "common/patch/terms_pieces.hpp"
#include "server/reduction/patch_parts.hpp"
#include "server/reduction/port_surface.hpp"
#include "server/reduction/psd_projection.hpp"
#include "server/reduction/suture_loads.hpp"

namespace palpate {
namespace {

/// Ratio of the contact's path to the tool's: it rolls further over an edge of the body, and the body comes towards it. Where few
/// vertices are sent, more of them lie around the tool's path. Measured: docs/notebook.md, 39.
constexpr double kContactDistanceRatio = 1.5;

/// Largest distance of the tool from its position at the stamp, in node spacings; more: a model is used further from its stamp.
constexpr double kTrustedSpacings = 6;

/// Returns B^T V.
PortRows rows_of(const Port& port, const Matrix& v) {
  PortRows rows(3, v.cols());
  for (Eigen::Index m = 0; m < v.cols(); ++m) rows.col(m) = gather(port.b, v.col(m));
  return rows;
}

/// Returns the part of a port's compliance that the modes of the patch lack, C(s) - R (s^2 + s D + K)^-1 R^T at the shift s, with
/// R = `rows`: what is too fast for a mode yields at once. Returns zero if the modes have a direction for each axis of the port.
Mat3 residual_compliance(const Port& port, double shift, const PortRows& rows, const Patch& patch) {
  assert(rows.cols() == patch.modes() && shift >= 0);
  if (rows.cols() == 0) return symmetric(port.compliance);
  Matrix dynamic = shift * patch.damping;
  dynamic.diagonal() += patch.stiffness + Vector::Constant(rows.cols(), shift * shift);
  const Mat3 by_modes = rows * dynamic.ldlt().solve(Matrix(rows.transpose()));
  return part_above(symmetric(symmetric(port.compliance) - by_modes), 0);
}

/// Returns the compliance along the normal, and the mean of those across it.
Mat3 alike_across(const Vec3& normal, const Mat3& compliance) {
  const double along = normal.dot(compliance * normal), across = 0.5 * (compliance.trace() - along);
  return across * Mat3::Identity() + (along - across) * normal * normal.transpose();
}

/// Adds the other contacts of the patch, on its modes `v`.
void add_contacts(const LinearPort& model, const Matrix& v, Patch& patch) {
  FrameModel& frame = model.frame;
  for (const OtherTools::Contact& contact : model.others.contacts) {
    const ToolPort& port = frame.ports()[contact.tool];
    const HandMotion path = frame.path(contact.tool, model.request.horizon);
    OtherContact& tool = patch.others.of[static_cast<std::size_t>(patch.others.count++)];
    tool.touching = port.touching;
    tool.sphere = port.sphere;
    if (port.parameters != model.tool_port().parameters) tool.law = port.parameters;
    const bool own = static_cast<std::size_t>(patch.others.count) <= model.others.own;
    if (!own) {
      tool.velocity = path.velocity;
      tool.acceleration = path.acceleration;
    }
    tool.normal = frame.normal(contact.tool);
    if (own) {
      tool.rows.setZero(3, v.cols());
      tool.c_static = alike_across(tool.normal, symmetric(contact.port->compliance));
    } else {
      tool.rows = rows_of(*contact.port, v);
      tool.c_static = residual_compliance(*contact.port, model.p.shift(), tool.rows, patch);
    }
    const Vec3 push = port.touching ? port.lambda : Vec3::Zero();
    tool.gap = frame.gap(contact.tool) + tool.c_static * push;
    if (own) patch.g += rows_of(*contact.port, v).transpose() * push;
  }
  patch.others.own = static_cast<int>(model.others.own);
}

void add_needle_path(const LinearPort& model, const Matrix& v, PatchNeedle& needle) {
  needle.layers = model.tool_port().needle.path->layers;
  needle.tip = model.tool_port().needle.tip;
  for (const OtherTools::Contact& contact : model.others.shaft) {
    const ToolPort& port = model.frame.ports()[contact.tool];
    PatchNeedle::Point& point = needle.points[static_cast<std::size_t>(port.needle.point)];
    point.position = position_of(model.frame.skin(), port, weights_of(model.frame.skin(), port), model.frame.state().x);
    point.rows = rows_of(*contact.port, v);
    point.bond_m = port.needle.bond_m;
  }
}

}  // namespace

void add_grasp(const LinearPort& model, Reduced& reduced, BuiltPatch& made) {
  const Port& port = model.port();
  Patch& patch = made.patch;
  const double mass_kg = at_node(model.at.masses(), model.body.coordinate(model.tool_port().node))[0];
  patch.k_port = symmetric(port.k_port);
  patch.d_port = symmetric(port.d_port);
  if (model.request.scheme == Scheme::tangent) {
    patch.k_port -= symmetric(port.compliance);
    patch.d_port.setZero();
    made.psd_change_1_s2 = project_grasp(patch, mass_kg);
    return;
  }
  Matrix& v = reduced.v;
  patch.b_k.resize(v.cols(), 3);
  patch.b_d.resize(v.cols(), 3);
  for (int axis = 0; axis < 3; ++axis) {
    patch.b_k.col(axis) = -v.transpose() * port.k[static_cast<std::size_t>(axis)];
    patch.b_d.col(axis) = -v.transpose() * port.d[static_cast<std::size_t>(axis)];
  }
  Matrix rotation;
  const Matrix stiffness = joint_stiffness(patch, reduced.stiffness);
  made.psd_change_1_s2 = std::max(made.psd_change_1_s2, project_grasp(patch, mass_kg, &rotation));
  if (!model.hyper()) return;
  v = v * rotation;
  reduced.coordinates = rotation.transpose() * reduced.coordinates;
  Matrix turn = Matrix::Identity(v.cols() + 3, v.cols() + 3);
  turn.bottomRightCorner(v.cols(), v.cols()) = rotation;
  add_terms(model, prescribed_motion(model), turn.transpose() * stiffness * turn, 0, reduced, made);
}

void add_touch(const LinearPort& model, Reduced& reduced, BuiltPatch& made) {
  FrameModel& frame = model.frame;
  const ToolPort& port = model.tool_port();
  const PatchRequest& request = model.request;
  const Matrix& v = reduced.v;
  Patch& patch = made.patch;
  patch.contact_stiffness_n_m = port.parameters.contact_stiffness_n_m;
  patch.friction = port.parameters.friction;
  patch.trust_radius_m = kTrustedSpacings * frame.spacing_m();
  const PatchContacts contacts = contacts_of(model);
  // The surface of the terms has room for the triangle under each of its contacts.
  const int vertices = std::min(request.vertices_max(patch.modes(), patch.load_rate.size() > 0, patch.fading.count, contacts),
                                kMaxPortVertices - 3 * contacts.own);
  if (model.hyper()) {
    const Matrix stiffness = reduced.stiffness.asDiagonal();
    add_terms(model, prescribed_motion(model), stiffness, vertices, reduced, made);
  } else if (v.cols() > 0 && !port.suture) {
    made.terms.variables = patch.modes();
    made.terms.rate = stamp_rate(patch);
  }
  if (request.scheme == Scheme::tangent)
    patch.c_static = symmetric(model.port().compliance);
  else if (v.cols() < 3)  // none for some axis of the port
    patch.c_static = residual_compliance(model.port(), model.p.shift(), rows_of(model.port(), v), patch);
  add_contacts(model, v, patch);
  if (!model.others.shaft.empty()) add_needle_path(model, v, patch.needle);
  if (port.suture) add_suture(model, v, patch.suture);
  frame.enter(BuildPhase::other);
  const bool with_terms = made.terms.variables > 0;
  const double ahead_s = (with_terms ? kContactDistanceRatio : 1.0) * seconds(request.horizon);
  std::vector<ContactPath> paths{{port.point, ahead_s * model.tool().velocity}};
  for (const OtherTools::Contact& own : std::span(model.others.contacts).first(model.others.own))
    paths.push_back({frame.ports()[own.tool].point, ahead_s * frame.tool(own.tool).velocity});
  const SurfacePiece first = cut_port_surface(
      frame.skin(), frame.positions(), [&](std::uint32_t node) { return model.at.body->rows(node, v); }, paths, vertices,
      with_terms && !port.suture ? kMaxPortVertices : vertices, patch);
  if (port.touching && !port.on_path())  // the instant part has yielded already at the stamp
    for (int i = 0; i < patch.surface.vertex_count; ++i)
      patch.surface.vertices[static_cast<std::size_t>(i)].position -= patch.c_static * port.lambda;
  if (with_terms) split_surface(first, patch.surface, made.terms);
  if (made.terms.elements.count() == 0 && made.terms.triangles.empty()) made.terms = {};
}

}  // namespace palpate
