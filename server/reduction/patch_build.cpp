#include "server/reduction/patch_build.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cassert>
#include <span>

#include "server/reduction/fit_nonlinear_terms.hpp"
#include "server/reduction/patch_parts.hpp"
#include "server/reduction/response_snapshots.hpp"
#include "server/reduction/suture_loads.hpp"
#include "server/sampling/nonlinear_elements.hpp"

namespace palpate {
namespace {

// Tolerances of solves. Measured: a basis from exact solves is no better (docs/decisions/0003). A static response is the force
// itself.
constexpr double kBasisTolerance = 1e-2, kStaticTolerance = 1e-3;

/// Variant of P with which directions are solved for: at `shift_factor` times the shift of the prediction horizon; with `clamp`
/// compressed elements do not soften it.
struct SystemVariant {
  double shift_factor = 1;
  bool clamp = false;
};

/// Returns what all schemes have: the force at the stamp, and how long it lasts.
BuiltPatch begun(const FrameModel& frame, std::size_t which, const PatchRequest& request) {
  assert(request.horizon > Micros{0} && request.order >= 0);
  const ToolPort& port = frame.ports()[which];
  BuiltPatch made;
  Patch& patch = made.patch;
  patch.scheme = request.scheme;
  patch.contact = port.kind;
  patch.constant = request.scheme == Scheme::hold;
  patch.tool = frame.tool(which).position;
  patch.tool_velocity = frame.tool(which).velocity;
  patch.touching = port.kind == ContactKind::attach || port.touching;
  patch.force = patch.touching ? Vec3(-port.lambda) : Vec3::Zero();
  patch.sphere = port.sphere;
  patch.valid_for = 2 * request.horizon + request.silence;
  patch.load_for = request.horizon;
  patch.trust_radius_m = frame.extent_m();
  return made;
}

/// Returns the held coordinates of a ring: all but the contact's nodes and their neighbours. Returns none if some of these have
/// no coordinates of their own.
std::optional<std::vector<std::uint8_t>> held_around(BodyFrame& body, const FrameModel& frame, std::size_t which) {
  const ToolPort& port = frame.ports()[which];
  std::vector<std::uint8_t> seed(frame.dynamics().nodes(), 0);
  if (port.kind == ContactKind::attach) seed[port.node] = 1;
  if (port.kind == ContactKind::touch)
    for (const std::uint32_t corner : frame.skin().view().triangles[port.point.triangle])
      each_node_of(frame.dynamics().body(), frame.skin().of_body(corner), [&](std::uint32_t node) { seed[node] = 1; });
  std::vector<std::uint8_t> near = seed;
  for (const auto& [a, b] : edges_of(frame.dynamics().body())) {
    near[a] |= seed[b];
    near[b] |= seed[a];
  }
  const std::vector<std::uint8_t>& always = body.held();
  std::vector<std::uint8_t> held(always.size(), 1);
  for (std::uint32_t i = 0; i < near.size(); ++i) {
    if (!near[i]) continue;
    const std::uint32_t row = body.coordinate(i);
    if (row == BodyOperator::kNone) return std::nullopt;
    held[row] = always[row];
  }
  return held;
}

/// Returns the number of modes that fit into a datagram with the tools that are contacts.
int modes_beside(const LinearPort& model) {
  const PatchRequest& request = model.request;
  int modes = std::min(modes_for(request.scheme, model.tool_port().kind, request.order), request.modes_max);
  const OtherTools& others = model.others;
  if (model.grasp() ||
      (others.contacts.empty() && others.shaft.empty() && others.load_rate.size() == 0 && !model.tool_port().suture))
    return modes;
  constexpr int least = 3;  // a triangle: terms carry more
  const PatchContacts contacts = contacts_of(model);
  const int branches = static_cast<int>(model.frame.dynamics().relaxation().branches().size());
  while (modes > 1 && request.vertices_max(modes, model.others.load_rate.size() > 0, branches, contacts) < least) --modes;
  return modes;
}

/// Adds relaxation on the modes, after the rows of the tool's node if it is held.
void add_fading(const LinearPort& model, const Matrix& v, Patch& patch) {
  const std::vector<Vector>& fading = model.body.fading();
  patch.fading.count = static_cast<int>(fading.size());
  for (std::size_t k = 0; k < fading.size(); ++k) {
    PatchBranch& branch = patch.fading.of[k];
    branch.prony = model.frame.dynamics().relaxation().branches()[k];
    branch.pull.resize(v.cols() + (model.grasp() ? 3 : 0));
    if (model.grasp()) branch.pull.head<3>() = at_node(fading[k], model.body.coordinate(model.tool_port().node));
    branch.pull.tail(v.cols()) = v.transpose() * fading[k];
  }
}

/// An orthonormal basis, K and D on it, and for `hyper` the snapshots and their coordinates in it.
struct Basis {
  Matrix v;
  Projection on_v;
  Matrix coordinates = {};
  SnapshotSet snapshots = {};
};

std::optional<Basis> linear_basis(const LinearPort& model, const KrylovStart& start, const KrylovSolve& solve, int modes) {
  const auto directions = krylov_basis(model.at, start, solve, {modes, model.p.shift()});
  model.frame.enter(BuildPhase::project);
  if (!directions) return std::nullopt;
  return Basis{*directions, model.at.projected(*directions)};
}

std::optional<Basis> nonlinear_basis(const LinearPort& model, const KrylovStart& start, const KrylovSolve& solve, int modes) {
  SnapshotSet snapshots = port_snapshots(model, start);
  const bool second_order = snapshots.of(SnapshotKind::indentation).empty();
  const ResponseRequest responses{model.p.shift(), seconds(model.request.horizon), second_order};
  if (!add_responses(model.at, start, solve, responses, snapshots)) return std::nullopt;
  snapshots.add(model.body.snapshots());
  const auto beside = std::min(start.fine.size(), static_cast<std::size_t>(modes - 1));
  PodBasis pod = pod_basis(model.at, snapshots, std::span(start.fine).first(beside), model.p.shift(), modes);
  model.frame.enter(BuildPhase::project);
  return Basis{std::move(pod.modes), std::move(pod.at_modes), std::move(pod.coordinates), std::move(snapshots)};
}

/// Sets the modes of a patch, rotated so that K is diagonal. Returns none if that fails.
std::optional<Reduced> set_modes(const LinearPort& model, Basis basis, BuiltPatch& made) {
  const auto r = basis.v.cols();
  Patch& patch = made.patch;
  if (r == 0) {  // all nodes at the tool are fixed, and the body is at rest: nothing moves
    patch.stiffness = patch.g = patch.q_rate = Vector();
    patch.damping = Matrix();
    return Reduced{std::move(basis.v), Vector(), Matrix(0, basis.coordinates.cols()), std::move(basis.snapshots)};
  }
  assert(basis.on_v.k.rows() == r && basis.on_v.d.rows() == r);
  for (const SutureLoads::Part& part : model.suture.stiffness) {
    const Vector y = basis.v.transpose() * part.y;
    basis.on_v.k -= part.stiffness_n_m * y * y.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Matrix> eigen(0.5 * (basis.on_v.k + basis.on_v.k.transpose()));
  if (eigen.info() != Eigen::Success) return std::nullopt;
  const Matrix& rotation = eigen.eigenvectors();
  Reduced reduced{basis.v * rotation, eigen.eigenvalues(), {}, std::move(basis.snapshots)};
  if (model.hyper()) reduced.coordinates = rotation.transpose() * basis.coordinates;
  const Matrix d = rotation.transpose() * basis.on_v.d * rotation;
  patch.stiffness = eigen.eigenvalues().cwiseAbs().cwiseMax(model.frame.softest_1_s2());
  made.psd_change_1_s2 = (patch.stiffness - eigen.eigenvalues()).maxCoeff();
  patch.damping = 0.5 * (d + d.transpose());
  patch.q_rate = reduced.v.transpose() * model.at.free_momentum();
  patch.g = reduced.v.transpose() * model.residual + patch.damping * patch.q_rate;
  add_fading(model, reduced.v, patch);
  if (model.others.load_rate.size() > 0) patch.load_rate = reduced.v.transpose() * model.others.load_rate;
  return reduced;
}

/// Computes V, and projects the body onto it.
std::optional<Reduced> reduce(const LinearPort& model, BuiltPatch& made) {
  const int modes = modes_beside(model);
  assert(modes > 0 && modes <= kMaxModes);
  model.frame.enter(BuildPhase::basis);
  const KrylovSolve solve = [&](std::span<const SolveColumn> columns) {
    model.frame.enter(BuildPhase::solve);
    const bool definite = model.p.solve(columns);
    model.frame.enter(BuildPhase::basis);
    return definite;
  };
  const KrylovStart start = krylov_start(model);
  auto basis = model.hyper() ? nonlinear_basis(model, start, solve, modes) : linear_basis(model, start, solve, modes);
  return basis ? set_modes(model, std::move(*basis), made) : std::nullopt;
}

/// Builds the patch in the coordinates of one operator, with one variant of P. Returns false if P is not definite.
bool build_on(FrameModel& frame, BodyFrame& body, std::size_t which, const PatchRequest& request, const SystemVariant& variant,
              BuiltPatch& made) {
  const bool tangent = request.scheme == Scheme::tangent;
  const ContactKind kind = frame.ports()[which].kind;
  if (request.scheme == Scheme::hyper) body.select_subdomain(which);
  SystemKey key{tangent ? 0 : variant.shift_factor * frame.shift(request.horizon), variant.clamp, body.held()};
  if (request.scheme == Scheme::ring) {
    auto held = held_around(body, frame, which);
    if (!held) return false;
    key.held = std::move(*held);
  }
  SharedSystem* const p = body.system(std::move(key), tangent ? kStaticTolerance : kBasisTolerance);
  if (!p) return false;
  const int before = p->iterations();
  if (!body.respond(*p, which, !tangent)) return false;
  // A model without modes has nothing that a contact could move.
  LinearPort model{frame,
                   body,
                   *p,
                   which,
                   request,
                   body.linearisation(),
                   other_tools(frame, *p, which, request.horizon, tangent ? 0 : kMaxOtherTools)};
  model.at.held = &p->key().held;
  model.residual = body.forces();
  mask(*model.at.held, model.residual);
  if (model.others.load.size() > 0) model.residual += model.others.load;
  if (!tangent) model.suture = suture_loads(frame, model.at, *p, which);
  if (model.suture.force.size() > 0) model.residual -= model.suture.force;
  Reduced reduced{Matrix(model.at.masses().size(), 0), Vector()};
  if (!tangent) {
    auto found = reduce(model, made);
    if (!found) return false;
    reduced = std::move(*found);
  }
  (kind == ContactKind::attach ? add_grasp : add_touch)(model, reduced, made);
  made.patch.has_terms = made.terms.variables > 0;
  made.solver_iterations += p->iterations() - before;
  return true;
}

/// Builds the patch of the requested scheme; one of `hyper` may lack terms.
std::optional<BuiltPatch> build_as_requested(FrameModel& frame, std::size_t which, const PatchRequest& request) {
  const BuiltPatch made = begun(frame, which, request);
  if (made.patch.constant) return made;
  frame.request_patch(which, expected_slide(frame.dynamics(), request));
  // A matrix that is not definite on fewer coordinates may be definite on all. A body in the middle of a fold is definite for a
  // faster hand, and its own directions then are better than those of a body that cannot fold (docs/notebook.md, 25).
  constexpr double kFoldShiftFactor = 8;  // measured: 3 then 9, or 4 then 16, give the same within a decibel
  for (const auto& body : frame.bodies())
    for (const SystemVariant& variant : {SystemVariant{}, SystemVariant{kFoldShiftFactor}, SystemVariant{1, true}}) {
      if (request.scheme == Scheme::tangent && variant.shift_factor != 1) continue;  // at a shift of 0
      BuiltPatch tried = made;
      if (build_on(frame, *body, which, request, variant, tried)) return tried;
    }
  return std::nullopt;
}

}  // namespace

std::optional<BuiltPatch> build_patch(FrameModel& frame, std::size_t which, const PatchRequest& request) {
  if (request.scheme != Scheme::hyper) return build_as_requested(frame, which, request);
  if (has_nonlinear_elements(frame.dynamics().body())) {
    auto built = build_as_requested(frame, which, request);
    if (!built) return built;
    // The check takes 2 % of the time of a solid's patch, a tenth of that of springs, which have not been seen to depart.
    const bool may_depart = frame.dynamics().body().is_solid();
    if (built->terms.variables > 0 && !(may_depart && terms_depart(built->patch, built->terms, request.horizon))) return built;
  }
  PatchRequest linear = request;
  linear.scheme = Scheme::port;
  auto built = build_as_requested(frame, which, linear);
  if (built) built->fell_back = true;
  return built;
}

int modes_for(Scheme scheme, ContactKind contact, int order) {
  if (scheme == Scheme::hold || scheme == Scheme::tangent) return 0;
  const int usual = contact == ContactKind::attach && scheme != Scheme::hyper ? kAttachOrder : kMostOrder;
  const int states = order > 0 ? order : usual;
  return std::clamp(states / 2, 1, kMaxModes);
}

ExpectedSlide expected_slide(const Dynamics& dynamics, const PatchRequest& request) {
  const bool hyper = request.scheme == Scheme::hyper;
  const bool slides = hyper || request.scheme == Scheme::port;
  const bool nonlinear = hyper && has_nonlinear_elements(dynamics.body());
  return {slides ? seconds(request.horizon) : 0, nonlinear, nonlinear ? request.acceleration : Vec3(Vec3::Zero())};
}

void add_terms(const LinearPort& model, const Matrix& prescribed, const Matrix& true_stiffness, int vertices,
               const Reduced& reduced, BuiltPatch& made) {
  const Linearisation& at = model.at;
  HyperModel hyper;
  assert(at.part && reduced.coordinates.rows() == reduced.v.cols() && reduced.coordinates.cols() == reduced.snapshots.count());
  hyper.psd_change = true_stiffness - joint_stiffness(made.patch, made.patch.stiffness);
  hyper.snapshots.resize(prescribed.cols() + reduced.v.cols(), reduced.snapshots.count());
  if (prescribed.cols() > 0) hyper.snapshots.topRows(prescribed.cols()) = prescribed.transpose() * reduced.snapshots.weighted();
  hyper.snapshots.bottomRows(reduced.v.cols()) = reduced.coordinates;
  hyper.likeliest = reduced.snapshots.likeliest();
  hyper.modes = at.moved(reduced.v);
  hyper.port = at.moved(prescribed);
  if (auto terms = nonlinear_terms(*at.part, made.patch, hyper, vertices)) made.terms = std::move(*terms);
  made.modes = PatchModes(reduced.v, *at.body);
}

Matrix PatchModes::of_nodes() const {
  if (generation_ == 0) return v_;
  if (generation_ != body_->generation()) return {};
  return body_->of_nodes(v_);
}

}  // namespace palpate
