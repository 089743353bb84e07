// Patches of tools that touch the surface.
#include "common/base/part_above.hpp"

#include <cassert>
#include "server/reduce/nonlinear_elements.hpp"
#include "server/reduce/patch_builder.hpp"
#include "server/reduce/patch_builder_common.hpp"
#include "server/reduce/port_surface.hpp"

namespace palpate {
namespace {

/// Ratio of the contact's path to the tool's: it rolls further over an edge of the body, and the body comes towards it. Where few
/// vertices are sent, more of them lie around the tool's path. Measured: docs/notebook.md, 39.
constexpr double kContactDistanceRatio = 1.5;

/// Largest distance of the tool from its position at the stamp, in node spacings; more: a model is used further from its stamp.
constexpr double kTrustedSpacings = 6;

/// Returns B^T P^-1 B of port `which`, with the springs of other tools in P.
Mat3 port_compliance(const SharedSystem& p, std::size_t which, const OtherTools& others) {
  const SpringCorrection correct(others);
  const PortResponse& own = p.port(which);
  Mat3 compliance;
  for (int axis = 0; axis < 3; ++axis) {
    Vector x = own.response[static_cast<std::size_t>(axis)];
    correct.apply(x);
    compliance.col(axis) = gather(own.b, x);
  }
  return symmetric(compliance);
}

/// Returns the part of a port's compliance that the modes of the patch lack, C(s) - R (s^2 + s D + K)^-1 R^T at the shift s, with
/// R = `rows`: what is too fast for a mode yields at once. Returns zero if the modes have a direction for each axis of the port.
Mat3 residual_compliance(const Mat3& compliance, const PortRows& rows, const Patch& patch, double shift) {
  assert(rows.cols() == patch.modes() && shift >= 0);
  Matrix dynamic = shift * patch.damping;
  dynamic.diagonal() += patch.stiffness + Vector::Constant(rows.cols(), shift * shift);
  return part_above(symmetric(compliance - rows * dynamic.ldlt().solve(Matrix(rows.transpose()))), 0);
}

/// Returns true if the directions for a touch include P^-1 M v*.
bool needs_motion(const PatchRequest& request) {
  // Three responses of the port, v*, three of M^-1 B (or one, and two of slides), the residual force.
  constexpr int kModesBeforeMotion = 8;
  return request.scheme == Scheme::hyper ||
         PatchBuilder::modes_for(request.scheme, ContactKind::touch, request.order) > kModesBeforeMotion;
}

}  // namespace

/// Computes the responses of the body in this frame, and the effects of other tools.
bool PatchBuilder::respond(const Job& job, Model& model, SharedSystem& p) {
  FrameModel& frame = *job.frame;
  frame.request_patch(job.which, expected_slide(*job.request));
  if (!frame.respond(p, job.which, {job.request->scheme != Scheme::tangent, needs_motion(*job.request)})) return false;
  std::vector<std::size_t> contacts = frame.neighbours(p, job.which, job.request->horizon);
  // A model without modes has nothing that a contact could move.
  const std::size_t most = job.request->scheme == Scheme::tangent ? 0 : kMaxOtherTools;
  contacts.resize(std::min(contacts.size(), most));
  model.others = frame.others(p, job.which, contacts);
  model.residual = frame.forces();
  if (model.others.load.size() > 0) model.residual += model.others.load;
  return true;
}

/// Requires that `p` has responded.
bool PatchBuilder::build_touch(const Job& job, const Model& model, SharedSystem& p, BuiltPatch& made) {
  FrameModel& frame = *job.frame;
  const ToolPort& port = job.port();
  const PatchRequest& request = *job.request;
  Patch& patch = made.patch;
  patch.contact_stiffness_n_m = port.parameters.contact_stiffness_n_m;
  patch.friction = port.parameters.friction;
  patch.trust_radius_m = kTrustedSpacings * spacing_m_;
  Reduced reduced;
  reduced.v.resize(model.at.masses().size(), 0);
  const Matrix& v = reduced.v;
  if (request.scheme == Scheme::tangent) {
    patch.c_static = port_compliance(p, job.which, model.others);
  } else {
    PortModel of_port = touch_model(job, model, p);
    if (!reduce(job, model, of_port, made, reduced)) return false;
  }
  const int vertices = request.vertices_max(patch.modes(), patch.load_rate.size() > 0, patch.fading.count,
                                            static_cast<int>(model.others.contacts.size()));
  if (job.hyper()) {
    const Matrix none(v.rows(), 0), stiffness = reduced.stiffness.asDiagonal();
    add_terms(model, none, stiffness, vertices, reduced, made);
  }
  if (request.scheme != Scheme::tangent && v.cols() < 3) {  // none for some axis of the port
    PortRows rows(3, v.cols());
    for (Eigen::Index m = 0; m < v.cols(); ++m) rows.col(m) = gather(p.port(job.which).b, v.col(m));
    patch.c_static = residual_compliance(port_compliance(p, job.which, model.others), rows, patch, p.shift());
  }
  add_other_tools(job, model, p, v, patch);
  frame.enter(BuildPhase::other);
  const bool with_terms = made.terms.variables > 0;
  const SurfacePiece first = cut_port_surface(
      *skin_, frame.positions(), [&](std::uint32_t node) { return model.at.body->rows(node, v); }, port.point,
      (with_terms ? kContactDistanceRatio : 1.0) * seconds(request.horizon) * job.tool().velocity, vertices,
      with_terms ? kMaxPortVertices : vertices, patch);
  if (port.touching)  // the instant part has yielded already at the stamp
    for (int i = 0; i < patch.surface.vertex_count; ++i)
      patch.surface.vertices[static_cast<std::size_t>(i)].position -= patch.c_static * port.lambda;
  if (with_terms) split_surface(first, patch.surface, made.terms);
  return true;
}

/// Adds the tools that are contacts of the patch, on its modes `v`.
void PatchBuilder::add_other_tools(const Job& job, const Model& model, const SharedSystem& p, const Matrix& v,
                                   Patch& patch) const {
  FrameModel& frame = *job.frame;
  const SurfaceView surface = skin_->view();
  for (const OtherTools::Contact& contact : model.others.contacts) {
    const ToolPort& port = frame.ports()[contact.tool];
    const HandMotion path = frame.path(contact.tool, job.request->horizon);
    OtherTool& tool = patch.others.of[static_cast<std::size_t>(patch.others.count++)];
    tool.touching = port.touching;
    tool.velocity = path.velocity;
    tool.acceleration = path.acceleration;
    tool.normal = normal_at(surface, frame.positions(), port.point);
    tool.rows.resize(3, v.cols());
    for (Eigen::Index m = 0; m < v.cols(); ++m) tool.rows.col(m) = gather(contact.port->b, v.col(m));
    tool.c_static = residual_compliance(port_compliance(p, contact.tool, model.others), tool.rows, patch, p.shift());
    const Vec3 push = port.touching ? port.lambda : Vec3::Zero();
    tool.gap = frame.tool(contact.tool).position - position_at(surface, frame.positions(), port.point) + tool.c_static * push;
  }
}

ExpectedSlide PatchBuilder::expected_slide(const PatchRequest& request) const {
  const bool hyper = request.scheme == Scheme::hyper;
  const bool slides = hyper || request.scheme == Scheme::port;
  const bool nonlinear = hyper && has_nonlinear_elements(dynamics_->body());
  return {slides ? seconds(request.horizon) : 0, nonlinear, nonlinear ? request.acceleration : Vec3(Vec3::Zero())};
}

/// Returns the start of the directions for a touch, with the springs of coupled tools in P.
PatchBuilder::PortModel PatchBuilder::touch_model(const Job& job, const Model& model, SharedSystem& p) {
  const PortResponse& own = p.port(job.which);
  const SpringCorrection correct(model.others);
  const auto corrected = [&](Vector x) {
    correct.apply(x);
    return x;
  };
  PortModel port;
  port.shift_1_s = p.shift();
  assert(port.shift_1_s > 0);
  port.solve = [&p, correct](std::span<const SolveColumn> columns) {
    if (!p.solve(columns)) return false;
    for (const SolveColumn& column : columns) correct.apply(*column.x);
    return true;
  };
  if (job.request->scheme == Scheme::port) {
    port.push = own.input;
    port.slide_loads = job.frame->sliding_loads(job.which);
  }
  KrylovStart& start = port.start;
  for (const Vector& x : own.response) start.ports.push_back(corrected(x));
  start.residual = corrected(p.residual());
  if (needs_motion(*job.request)) start.motion = corrected(p.motion());
  const Vec3 inwards = -normal_at(skin_->view(), job.frame->positions(), job.port().point);
  if (job.hyper() || !own.slides.empty()) {
    Vector push = Vector::Zero(model.at.masses().size());
    for (std::size_t axis = 0; axis < 3; ++axis) push += inwards[static_cast<Eigen::Index>(axis)] * own.input[axis];
    start.fine = {push.cwiseQuotient(model.at.masses())};
  } else {
    for (const Vector& b : own.input) start.fine.push_back(b.cwiseQuotient(model.at.masses()));
  }
  if (job.hyper()) {
    add_touch_snapshots(job, model, p, inwards, port);
    for (const Vector& x : own.slides) port.snapshots.add(SnapshotKind::slide, corrected(x));
  } else {
    for (const Vector& x : own.slides) start.ports.push_back(corrected(x));
  }
  return port;
}

/// Adds port responses scaled to the tool's likely motion along each axis, and indentations.
void PatchBuilder::add_touch_snapshots(const Job& job, const Model& model, const SharedSystem& p, const Vec3& inwards,
                                       PortModel& port) {
  const double horizon_s = seconds(job.request->horizon);
  const PortResponse& own = p.port(job.which);
  const Vec3 far = expected_motion(job.tool(), horizon_s);
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const Vector& x = port.start.ports[static_cast<std::size_t>(axis)];
    const double moved = gather(own.b, x)[axis];
    port.snapshots.add(SnapshotKind::port_response, x, moved > 0 ? far[axis] / moved : 1);  // 1 if the body is fixed
  }
  if (!indentations_) indentations_ = std::make_unique<StaticIndentations>(dynamics_->body());
  const IndentationRequest request{skin_->weights(job.port().point), port.start.ports,
                                   expected_indentations(job.tool(), inwards, horizon_s), p.shift(), p.diagonal()};
  for (Vector& x : indentations_->shapes(model.at, request)) port.snapshots.add(SnapshotKind::indentation, std::move(x));
}

}  // namespace palpate
