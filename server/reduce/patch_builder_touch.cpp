// Patches of tools that touch the surface.
#include "common/base/part_above.hpp"
#include "server/reduce/bending.hpp"
#include "server/reduce/patch_builder.hpp"
#include "server/reduce/patch_builder_common.hpp"
#include "server/reduce/port_surface.hpp"

namespace palpate {
namespace {

/// How far a contact gets, of how far its tool does: over an edge of the body it rolls further, and the body comes towards it.
/// Where few vertices travel they are worth more around the tool's way.
constexpr double kContactOfTool = 1.5;

/// Of port `which` under P, with the springs of other tools: B^T P^-1 B.
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

/// The part of a port's compliance that the modes of the patch lack, C(s) - R (s^2 + s D + K)^-1 R^T at the shift s, where `rows`
/// is R and K the modes' own stiffness: what is too fast to be a mode yields at once. Nothing where the modes have a direction
/// for each axis of the port.
Mat3 residual_compliance(const Mat3& compliance, const PortRows& rows, const Vector& stiffness, const Matrix& damping,
                         double shift) {
  Matrix dynamic = shift * damping;
  dynamic.diagonal() += stiffness + Vector::Constant(rows.cols(), shift * shift);
  return part_above(symmetric(compliance - rows * dynamic.ldlt().solve(Matrix(rows.transpose()))), 0);
}

/// The port's responses, as large as the tool's motion along each axis [m] would make them.
void scale_to(const Vec3& motion, const Skin::Weights& b, std::vector<Vector>& responses) {
  for (int axis = 0; axis < 3; ++axis) {
    Vector& x = responses[static_cast<std::size_t>(axis)];
    const double moved = gather(b, x)[axis];
    if (moved > 0) x *= motion[axis] / moved;  // not where the body is fixed
  }
}

/// Whether the directions for a touch have P^-1 M v*.
bool needs_motion(const PatchRequest& request) {
  constexpr int kWithout = 8;  // three responses of the port, v*, three of M^-1 B (or one, and two of slides), the residual force
  return request.scheme == Scheme::hyper || PatchBuilder::modes_for(request.scheme, ContactKind::touch, request.order) > kWithout;
}

}  // namespace

void PatchBuilder::begin_touch(const ToolPort& port, Patch& patch) const {
  patch.coupling_n_m = port.parameters.coupling_n_m;
  patch.friction = port.parameters.friction;
  patch.trust_radius_m = 6 * spacing_m_;
}

std::optional<Patch> PatchBuilder::build_touch(const Model& model, FrameModel& frame, std::size_t which,
                                               const PatchRequest& request, Patch patch, const Footing& footing) {
  const ToolPort& port = frame.ports()[which];
  const Linearisation& at = model.at;
  begin_touch(port, patch);
  std::vector<Vector> inputs(3, Vector::Zero(dynamics_->masses().size())), fine;
  const Skin::Weights weights = skin_->weights(port.point);
  for (int axis = 0; axis < 3; ++axis) scatter(weights, Vec3::Unit(axis), inputs[static_cast<std::size_t>(axis)]);
  for (Vector& b : inputs) {
    if (model.local) b = model.local->restricted(b);
    mask(*at.held, b);
  }

  const double shift = footing.shift(request, shift_for(request.horizon));
  const bool balanced = request.scheme == Scheme::balanced;
  if (!balanced && !model.solver->prepare(at, shift, footing.clamp)) return std::nullopt;
  Reduced reduced;
  Matrix& v = reduced.v;
  v.resize(at.masses().size(), 0);
  if (request.scheme == Scheme::tangent) {
    const auto compliance = static_response(model, inputs);
    if (!compliance) return std::nullopt;
    patch.c_static = *compliance;
  } else {
    for (const Vector& b : inputs) fine.push_back(b.cwiseQuotient(at.masses()));
    const int modes = modes_for(request.scheme, port.kind, request.order);
    const auto basis = balanced ? restricted_basis(balanced_->touched(port.point), modes, dynamics_->masses(), held_)
                                : krylov_basis(at, *model.solver, inputs, fine, model.residual, {modes, shift}, *model.memory);
    if (!basis || !reduce(at, *basis, at.projected(*basis), model.others, patch, reduced)) return std::nullopt;
    patch.g = v.transpose() * model.residual + patch.damping * patch.q_rate;
  }
  const int vertices = request.vertices_max(patch.modes(), false);
  const auto rows = [&](std::uint32_t node) { return model.local ? model.local->rows(node, v) : at.rows(node, v); };
  cut_port_surface(*skin_, frame.positions(), rows, port.point, seconds(request.horizon) * frame.tool(which).velocity, vertices,
                   vertices, patch);
  if (request.scheme == Scheme::tangent && port.touching)
    for (int i = 0; i < patch.surface.vertex_count; ++i)
      patch.surface.vertices[static_cast<std::size_t>(i)].position -= patch.c_static * port.lambda;
  return patch;
}

std::optional<Patch> PatchBuilder::build_shared_touch(FrameModel& frame, std::size_t which, const PatchRequest& request,
                                                      Patch patch, const Footing& footing) {
  const ToolPort& port = frame.ports()[which];
  const bool ring = request.scheme == Scheme::ring, tangent = request.scheme == Scheme::tangent,
             hyper = request.scheme == Scheme::hyper;
  const Linearisation at = linearisation_for(request.scheme, frame, held_);
  begin_touch(port, patch);

  const double shift = footing.shift(request, frame.shift(request.horizon));
  const double tolerance = tangent ? kStaticTolerance : kBasisTolerance;
  SharedSystem* const p = ring ? (ring_.prepare(at, shift, footing.clamp, tolerance) ? &ring_ : nullptr)
                               : frame.system(shift, footing.clamp, tolerance);
  if (!p) return std::nullopt;
  const int before = p->iterations();
  frame.want(which, expected_slide(request));
  if (!frame.respond(*p, which, {!tangent, needs_motion(request)})) return std::nullopt;
  const OtherTools others = frame.others(*p, which);
  Reduced reduced;
  Matrix& v = reduced.v;
  v.resize(at.masses().size(), 0);
  int vertices = request.vertices_max(0, false);
  if (tangent) {
    patch.c_static = port_compliance(*p, which, others);
  } else {
    const auto basis = touch_basis(frame, *p, which, others, at, request);
    frame.enter(PatchPart::project);
    if (!basis || !reduce(at, basis->shapes, hyper ? basis->at_shapes : at.projected(basis->shapes), others, patch, reduced))
      return std::nullopt;
    vertices = request.vertices_max(patch.modes(), patch.load_rate.size() > 0);
    if (hyper) {
      HyperShapes shapes;
      shapes.port.resize(v.rows(), 0);
      shapes.modes = v;
      shapes.coordinates = v.transpose() * at.masses().asDiagonal() * basis->shapes * basis->coordinates;
      shapes.indentations = basis->indentations;
      add_terms(at, patch, reduced.stiffness.asDiagonal(), shapes, vertices);
    }
    Vector residual = frame.forces();
    if (others.load.size() > 0) residual += others.load;
    patch.g = v.transpose() * residual + patch.damping * patch.q_rate;
    if (patch.load_rate.size() > 0) patch.load_for = request.horizon;
    if (v.cols() < 3 || hyper) {  // no M^-1 B among the directions
      PortRows rows(3, v.cols());
      for (Eigen::Index m = 0; m < v.cols(); ++m) rows.col(m) = gather(p->port(which).b, v.col(m));
      // Terms take back what PSD projection changed; C(s) of a clamped P is not that of the modes' own.
      const Vector stiffness = hyper && !footing.clamp ? reduced.stiffness : Vector(patch.stiffness);
      patch.c_static = residual_compliance(port_compliance(*p, which, others), rows, stiffness, patch.damping, shift);
    }
  }
  frame.enter(PatchPart::other);
  report_.solver_iterations += p->iterations() - before;
  const bool with_terms = terms_.variables > 0;
  const SurfacePiece first = cut_port_surface(
      *skin_, frame.positions(), [&](std::uint32_t node) { return at.rows(node, v); }, port.point,
      (with_terms ? kContactOfTool : 1.0) * seconds(request.horizon) * frame.tool(which).velocity, vertices,
      with_terms ? kMaxPortVertices : vertices, patch);
  if (port.touching)  // what yields at once has done so at the stamp
    for (int i = 0; i < patch.surface.vertex_count; ++i)
      patch.surface.vertices[static_cast<std::size_t>(i)].position -= patch.c_static * port.lambda;
  if (with_terms) split_surface(first, patch.surface, terms_);
  return patch;
}

ExpectedSlide PatchBuilder::expected_slide(const PatchRequest& request) const {
  const bool hyper = request.scheme == Scheme::hyper;
  const bool slides = hyper || request.scheme == Scheme::port;
  const bool bends = hyper && can_bend(dynamics_->body());
  return {slides ? seconds(request.horizon) : 0, bends, bends ? request.acceleration : Vec3(Vec3::Zero())};
}

/// What the directions for a touch start from, the springs of coupled tools in P.
KrylovStart PatchBuilder::touch_start(const SharedSystem& p, std::size_t which, const SpringCorrection& correct,
                                      bool with_motion) const {
  const PortResponse& own = p.port(which);
  KrylovStart start{{own.response.begin(), own.response.end()}, {}, p.residual(), {}};
  if (with_motion) {
    start.motion = p.motion();
    correct.apply(start.motion);
  }
  for (Vector& x : start.ports) correct.apply(x);
  correct.apply(start.residual);
  return start;
}

/// Directions for a touch; coordinates for scheme hyper only.
std::optional<HyperBasis> PatchBuilder::touch_basis(FrameModel& frame, SharedSystem& p, std::size_t which,
                                                    const OtherTools& others, const Linearisation& at,
                                                    const PatchRequest& request) {
  frame.enter(PatchPart::basis);
  const SpringCorrection correct(others);
  const int modes = modes_for(request.scheme, ContactKind::touch, request.order);
  KrylovStart start = touch_start(p, which, correct, needs_motion(request));
  const KrylovSolve solve = [&](std::span<const SolveColumn> columns) {
    frame.enter(PatchPart::solve);
    const bool definite = p.solve(columns);
    frame.enter(PatchPart::basis);
    if (!definite) return false;
    for (const SolveColumn& column : columns) correct.apply(*column.x);
    return true;
  };
  const PortResponse& own = p.port(which);
  const auto add_slides = [&] {
    for (const Vector& x : own.slides) correct.apply(start.ports.emplace_back(x));
  };
  const bool hyper = request.scheme == Scheme::hyper;
  const Vec3 inwards = -normal_at(skin_->view(), frame.positions(), frame.ports()[which].point);
  if (hyper || !own.slides.empty()) {
    Vector push = Vector::Zero(at.masses().size());
    for (std::size_t axis = 0; axis < 3; ++axis) push += inwards[static_cast<Eigen::Index>(axis)] * own.input[axis];
    start.fine = {push.cwiseQuotient(at.masses())};
  } else {
    for (const Vector& b : own.input) start.fine.push_back(b.cwiseQuotient(at.masses()));
  }
  if (hyper) {
    const double horizon_s = seconds(request.horizon);
    if (!indentations_) indentations_ = std::make_unique<StaticIndentations>(dynamics_->body());
    const auto indentations =
        indentations_->shapes(at, {skin_->weights(frame.ports()[which].point), start.ports,
                                   expected_indentations(frame.tool(which), inwards, horizon_s), p.shift(), p.diagonal()});
    scale_to(expected_motion(frame.tool(which), horizon_s), own.b, start.ports);
    add_slides();
    return hyper_basis(at, start, solve, Matrix(), indentations, known_snapshots(), {modes, p.shift(), horizon_s}, basis_memory_);
  }
  add_slides();
  auto directions = krylov_basis(at, start, solve, {modes, p.shift(), kBasisTolerance});
  return directions ? std::optional(HyperBasis{std::move(*directions), {}, {}}) : std::nullopt;
}

}  // namespace palpate
