#include "server/reduce/patch_builder.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cassert>

#include "server/reduce/nonlinear_elements.hpp"
#include "server/reduce/patch_builder_common.hpp"
#include "server/reduce/response_snapshots.hpp"

namespace palpate {

PatchBuilder::PatchBuilder(const Dynamics& dynamics, const Skin& skin, double softest_1_s2)
    : dynamics_(&dynamics),
      skin_(&skin),
      graph_(dynamics.body()),
      softest_1_s2_(softest_1_s2),
      solver_(dynamics),
      ring_(dynamics) {
  const LumpedBody& body = dynamics.body();
  Eigen::AlignedBox3d box;
  for (const Vec3& x : body.nodes) box.extend(x);
  extent_m_ = box.diagonal().norm();
  spacing_m_ = mean_edge_m(body);
}

int PatchBuilder::modes_for(Scheme scheme, ContactKind contact, int order) {
  if (scheme == Scheme::hold || scheme == Scheme::tangent) return 0;
  const bool attach = contact == ContactKind::attach;
  const int usual =
      scheme == Scheme::hyper ? (attach ? kHyperAttachOrder : kHyperTouchOrder) : (attach ? kAttachOrder : kTouchOrder);
  const int states = order > 0 ? order : usual;
  return std::clamp(states / 2, 1, kMaxModes);
}

/// Holds all nodes far from the seeds. Returns false if some near nodes have no coordinates of their own.
bool PatchBuilder::hold_far_nodes(const FrameModel& frame, const std::vector<std::uint32_t>& seeds) {
  const std::vector<int> layer = graph_.distances(seeds, kRingLayers);
  std::vector<std::uint8_t> held(held_.size(), 1);
  for (std::uint32_t i = 0; i < dynamics_->nodes(); ++i) {
    if (layer[i] == NodeGraph::kUnreached) continue;
    const std::uint32_t row = frame.coordinate(i);
    if (row == BodyOperator::kNone) return false;
    held[row] = held_[row];
  }
  held_ = std::move(held);
  return true;
}

std::optional<BuiltPatch> PatchBuilder::build(FrameModel& frame, std::size_t which, const PatchRequest& request) {
  const ToolPort& port = frame.ports()[which];
  BuiltPatch made;
  assert(request.horizon > Micros{0} && request.order >= 0);
  Patch& patch = made.patch;
  patch.scheme = request.scheme;
  patch.contact = port.kind;
  patch.constant = request.scheme == Scheme::hold;
  patch.tool = frame.tool(which).position;
  patch.tool_velocity = frame.tool(which).velocity;
  patch.force = port.kind == ContactKind::attach || port.touching ? Vec3(-port.lambda) : Vec3::Zero();
  patch.touching = port.kind == ContactKind::attach || port.touching;
  patch.valid_for = 2 * request.horizon + request.silence;
  patch.load_for = request.horizon;
  patch.trust_radius_m = extent_m_;
  if (patch.constant) return made;
  const bool hyper = request.scheme == Scheme::hyper;
  if (hyper && !has_nonlinear_elements(dynamics_->body())) return fall_back(frame, which, request);
  // A matrix that is not definite on fewer coordinates may be definite on all. A body in the middle of a fold is definite for a
  // faster hand, and its own directions then are better than those of a body that cannot fold (docs/notebook.md, 25).
  constexpr double kFoldShiftFactor = 8;  // measured: 3 then 9, or 4 then 16, give the same within a decibel
  std::vector<SystemVariant> variants{SystemVariant{}};
  if (request.scheme != Scheme::tangent) variants.push_back({kFoldShiftFactor});
  variants.push_back({1, true});
  std::vector<FrameModel*> models{&frame};
  if (&frame.refined() != &frame) models = {&frame.refined(), &frame};
  for (FrameModel* model : models)
    for (const SystemVariant& variant : variants) {
      BuiltPatch tried = made;
      if (!attempt({model, which, &request, variant}, tried)) continue;
      if (hyper && tried.terms.variables == 0) return fall_back(frame, which, request);
      return tried;
    }
  return std::nullopt;
}

std::optional<BuiltPatch> PatchBuilder::fall_back(FrameModel& frame, std::size_t which, const PatchRequest& request) {
  PatchRequest other = request;
  other.scheme = Scheme::port;
  // More would leave next to no surface, and there are no terms that carry the rest.
  if (frame.ports()[which].kind == ContactKind::touch) other.order = std::min(request.order, kTouchOrder);
  auto built = build(frame, which, other);
  if (built) built->fell_back = true;
  return built;
}

std::vector<std::uint32_t> PatchBuilder::contact_nodes(const ToolPort& port) const {
  if (port.kind == ContactKind::attach) return {port.node};
  const Triangle& corners = skin_->view().triangles[port.point.triangle];
  return {corners.begin(), corners.end()};
}

bool PatchBuilder::attempt(const Job& job, BuiltPatch& made) {
  const Scheme scheme = job.request->scheme;
  FrameModel& frame = *job.frame;
  const ToolPort& port = job.port();
  held_ = frame.held();
  if (job.hyper()) frame.select_subdomain(job.which);
  if (scheme == Scheme::ring && !hold_far_nodes(frame, contact_nodes(port))) return false;
  const bool grasp = port.kind == ContactKind::attach;
  if (grasp) held_[frame.coordinate(port.node)] = 1;
  Model model{linearisation_for(scheme, frame, held_), {}, {}};
  if (grasp) {
    model.residual = frame.forces_beside(job.which);
    mask(held_, model.residual);
    model.others = frame.other_nodes(job.which);
    const bool built = build_grasp(job, model, made);
    made.solver_iterations += solver_.iterations();
    return built;
  }
  const double shift = job.shift(frame.shift(job.request->horizon));
  const double tolerance = scheme == Scheme::tangent ? kStaticTolerance : kBasisTolerance;
  SharedSystem* const p = scheme != Scheme::ring ? frame.system(shift, job.variant.clamp, tolerance)
                          : ring_.prepare(model.at, shift, job.variant.clamp, tolerance) ? &ring_
                                                                                         : nullptr;
  if (!p) return false;
  const int before = p->iterations();
  if (!respond(job, model, *p) || !build_touch(job, model, *p, made)) return false;
  made.solver_iterations += p->iterations() - before;
  return true;
}

/// Returns the number of modes that fit into a datagram with the tools that are contacts.
int PatchBuilder::modes_beside(const Job& job, const OtherTools& others) const {
  const PatchRequest& request = *job.request;
  int modes = std::min(modes_for(request.scheme, job.port().kind, request.order), request.modes_max);
  if (others.contacts.empty()) return modes;
  // A triangle if terms carry more, else enough for the tool to move about between frames.
  const int least = job.hyper() ? 3 : 6, contacts = static_cast<int>(others.contacts.size());
  const int branches = static_cast<int>(dynamics_->relaxation().branches().size());
  while (modes > 1 && request.vertices_max(modes, others.load_rate.size() > 0, branches, contacts) < least) --modes;
  return modes;
}

/// Computes V, and projects the body onto it.
bool PatchBuilder::reduce(const Job& job, const Model& model, PortModel& port, BuiltPatch& made, Reduced& reduced) {
  FrameModel& frame = *job.frame;
  const int modes = modes_beside(job, model.others);
  assert(modes > 0 && modes <= kMaxModes);
  frame.enter(BuildPhase::basis);
  const KrylovSolve solve = [&](std::span<const SolveColumn> columns) {
    frame.enter(BuildPhase::solve);
    const bool definite = port.solve(columns);
    frame.enter(BuildPhase::basis);
    return definite;
  };
  if (!job.hyper()) {
    const bool chosen = !port.push.empty();
    const int directions = chosen ? std::max(modes, kCandidates) : modes;
    const auto basis = krylov_basis(model.at, port.start, solve, {directions, port.shift_1_s, kBasisTolerance});
    frame.enter(BuildPhase::project);
    if (!basis) return false;
    const Projection projected = model.at.projected(*basis);
    if (!chosen || basis->cols() == 0) return take_basis(job, model, *basis, projected, made, reduced);
    const Matrix q = dominant_directions(projected, rollout_loads(job, model, port, *basis), port.shift_1_s, modes);
    return take_basis(job, model, *basis * q, {q.transpose() * projected.k * q, q.transpose() * projected.d * q}, made, reduced);
  }
  SnapshotSet& snapshots = reduced.snapshots = std::move(port.snapshots);
  const bool second_order = snapshots.of(SnapshotKind::indentation).empty();
  const ResponseRequest responses{port.shift_1_s, seconds(job.request->horizon), second_order};
  if (!add_responses(model.at, port.start, solve, responses, response_memory_, snapshots)) return false;
  snapshots.add(frame.snapshots());
  const auto beside = std::min(port.start.fine.size(), static_cast<std::size_t>(modes - 1));
  const PodBasis basis = pod_basis(model.at, snapshots, std::span(port.start.fine).first(beside), port.shift_1_s, modes);
  frame.enter(BuildPhase::project);
  if (!take_basis(job, model, basis.modes, basis.at_modes, made, reduced)) return false;
  reduced.coordinates = reduced.rotation.transpose() * basis.coordinates;
  return true;
}

RolloutLoads PatchBuilder::rollout_loads(const Job& job, const Model& model, const PortModel& port, const Matrix& w) const {
  RolloutLoads loads{Matrix(w.cols(), 3), w.transpose() * model.residual, w.transpose() * model.at.free_momentum(),
                     Matrix(w.cols(), static_cast<Eigen::Index>(port.slide_loads.size()))};
  for (Eigen::Index axis = 0; axis < 3; ++axis) loads.port.col(axis) = w.transpose() * port.push[static_cast<std::size_t>(axis)];
  if (job.port().touching) loads.own += loads.port * job.port().lambda;
  for (Eigen::Index k = 0; k < loads.slides.cols(); ++k)
    loads.slides.col(k) = w.transpose() * port.slide_loads[static_cast<std::size_t>(k)];
  return loads;
}

bool PatchBuilder::take_basis(const Job& job, const Model& model, const Matrix& basis, const Projection& projected,
                              BuiltPatch& made, Reduced& reduced) const {
  const auto r = basis.cols();
  Patch& patch = made.patch;
  if (r == 0) {  // all nodes at the tool are fixed, and the body is at rest: nothing moves
    patch.stiffness = patch.g = patch.q_rate = reduced.stiffness = Vector();
    patch.damping = reduced.rotation = Matrix();
    reduced.v = basis;
    return true;
  }
  assert(projected.k.rows() == r && projected.d.rows() == r);
  Matrix k = projected.k;
  for (const OtherTools::Spring& spring : model.others.springs) {
    Matrix rows = Matrix::Zero(3, r);
    for (const auto& [node, weight] : spring.port->b) rows += weight * basis.middleRows<3>(3 * static_cast<Eigen::Index>(node));
    k += rows.transpose() * spring.stiffness * rows;
  }
  const Eigen::SelfAdjointEigenSolver<Matrix> eigen(0.5 * (k + k.transpose()));
  if (eigen.info() != Eigen::Success) return false;
  reduced.rotation = eigen.eigenvectors();
  reduced.v = basis * reduced.rotation;
  reduced.stiffness = eigen.eigenvalues();
  const Matrix d = reduced.rotation.transpose() * projected.d * reduced.rotation;
  patch.stiffness = eigen.eigenvalues().cwiseAbs().cwiseMax(softest_1_s2_);
  made.psd_change_1_s2 = (patch.stiffness - eigen.eigenvalues()).maxCoeff();
  patch.damping = 0.5 * (d + d.transpose());
  patch.q_rate = reduced.v.transpose() * model.at.free_momentum();
  patch.g = reduced.v.transpose() * model.residual + patch.damping * patch.q_rate;
  add_fading(job, model, reduced.v, patch);
  if (model.others.load_rate.size() > 0) patch.load_rate = reduced.v.transpose() * model.others.load_rate;
  return true;
}

/// Adds relaxation on the modes, after the rows of the tool's node if it is held.
void PatchBuilder::add_fading(const Job& job, const Model& model, const Matrix& v, Patch& patch) const {
  const std::vector<Vector>& fading = job.frame->fading();
  patch.fading.count = static_cast<int>(fading.size());
  for (std::size_t k = 0; k < fading.size(); ++k) {
    PatchBranch& branch = patch.fading.of[k];
    branch.prony = dynamics_->relaxation().branches()[k];
    branch.pull.resize(v.cols() + (patch.contact == ContactKind::attach ? 3 : 0));
    if (patch.contact == ContactKind::attach)
      branch.pull.head<3>() = at_node(fading[k], model.at.body->coordinate(job.port().node));
    branch.pull.tail(v.cols()) = v.transpose() * fading[k];
  }
}

/// `true_stiffness`: of modes and tool before PSD projection, in the modes of the patch; `vertices`: of its surface.
void PatchBuilder::add_terms(const Model& model, const Matrix& port, const Matrix& true_stiffness, int vertices,
                             const Reduced& reduced, BuiltPatch& made) const {
  const Linearisation& at = model.at;
  HyperModel hyper;
  assert(at.part && reduced.coordinates.rows() == reduced.v.cols() && reduced.coordinates.cols() == reduced.snapshots.count());
  hyper.psd_change = true_stiffness - joint_stiffness(made.patch, made.patch.stiffness);
  hyper.snapshots.resize(port.cols() + reduced.v.cols(), reduced.snapshots.count());
  if (port.cols() > 0) hyper.snapshots.topRows(port.cols()) = port.transpose() * reduced.snapshots.weighted();
  hyper.snapshots.bottomRows(reduced.v.cols()) = reduced.coordinates;
  hyper.likeliest = reduced.snapshots.likeliest();
  hyper.modes = at.moved(reduced.v);
  hyper.port = at.moved(port);
  if (auto terms = nonlinear_terms(*at.part, made.patch, hyper, vertices)) made.terms = std::move(*terms);
  made.modes = PatchModes(reduced.v, *at.body);
}

Matrix PatchModes::of_nodes() const {
  if (generation_ == 0) return v_;
  if (generation_ != body_->generation()) return {};
  return body_->of_nodes(v_);
}

}  // namespace palpate
