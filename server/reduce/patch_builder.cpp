#include "server/reduce/patch_builder.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "server/reduce/bending.hpp"
#include "server/reduce/narrow_basis.hpp"
#include "server/reduce/patch_builder_common.hpp"
#include "server/reduce/port_surface.hpp"
#include "server/reduce/psd_projection.hpp"

namespace palpate {
namespace {

Vector unit(const Linearisation& at, std::uint32_t node, int axis) {
  return Vector::Unit(at.masses().size(), 3 * static_cast<Eigen::Index>(node) + axis);
}

}  // namespace

PatchBuilder::PatchBuilder(const Dynamics& dynamics, const Skin& skin, double softest_1_s2, BalancedBases* balanced)
    : dynamics_(&dynamics),
      skin_(&skin),
      balanced_(balanced),
      neighbours_(dynamics.nodes()),
      softest_1_s2_(softest_1_s2),
      solver_(dynamics),
      ring_(dynamics) {
  const LumpedBody& body = dynamics.body();
  Eigen::AlignedBox3d box;
  for (const Vec3& x : body.nodes) box.extend(x);
  extent_m_ = box.diagonal().norm();
  spacing_m_ = mean_edge_m(body);
  for (const auto& [a, b] : edges_of(body)) {
    neighbours_[a].push_back(b);
    neighbours_[b].push_back(a);
  }
}

int PatchBuilder::modes_for(Scheme scheme, ContactKind contact, int order) {
  if (scheme == Scheme::hold || scheme == Scheme::filtered || scheme == Scheme::tangent) return 0;
  const bool attach = contact == ContactKind::attach;
  const int usual =
      scheme == Scheme::hyper ? (attach ? kHyperAttachOrder : kHyperTouchOrder) : (attach ? kAttachOrder : kTouchOrder);
  const int states = order > 0 ? order : usual;
  return std::clamp(states / 2, 1, kMaxModes);
}

/// False where not all that is near has coordinates of its own.
bool PatchBuilder::hold_far_nodes(const FrameModel& frame, const std::vector<std::uint32_t>& seeds) {
  std::vector<std::uint8_t> near(dynamics_->nodes(), 0);
  std::vector<std::uint32_t> front = seeds;
  for (const std::uint32_t i : front) near[i] = 1;
  for (int layer = 0; layer < kRingLayers; ++layer) {
    std::vector<std::uint32_t> next;
    for (const std::uint32_t i : front)
      for (const std::uint32_t j : neighbours_[i])
        if (!near[j]) {
          near[j] = 1;
          next.push_back(j);
        }
    front = std::move(next);
  }
  std::vector<std::uint8_t> held(held_.size(), 1);
  for (std::uint32_t i = 0; i < dynamics_->nodes(); ++i) {
    if (!near[i]) continue;
    const std::uint32_t row = frame.coordinate(i);
    if (row == RefinedBody::kNone) return false;
    held[row] = held_[row];
  }
  held_ = std::move(held);
  return true;
}

bool PatchBuilder::reduce(const Linearisation& at, const Matrix& v, const Projection& of_v, const OtherTools& others,
                          Patch& patch, Reduced& reduced) {
  const auto r = v.cols();
  if (r == 0) {  // a tool where everything is held fast, and a body at rest: nothing moves
    patch.stiffness = patch.q_rate = reduced.stiffness = Vector();
    patch.damping = Matrix();
    reduced.v = v;
    return true;
  }
  Matrix k = of_v.k;
  for (const OtherTools::Spring& spring : others.springs) {
    Matrix rows = Matrix::Zero(3, r);
    for (const auto& [node, weight] : spring.port->b) rows += weight * v.middleRows<3>(3 * static_cast<Eigen::Index>(node));
    k += rows.transpose() * spring.stiffness * rows;
  }
  const Eigen::SelfAdjointEigenSolver<Matrix> eigen(0.5 * (k + k.transpose()));
  if (eigen.info() != Eigen::Success) return false;
  const Matrix& u = eigen.eigenvectors();
  reduced.v = v * u;
  reduced.stiffness = eigen.eigenvalues();
  const Matrix d = u.transpose() * of_v.d * u;
  patch.stiffness = eigen.eigenvalues().cwiseAbs().cwiseMax(softest_1_s2_);
  report_.psd_change_1_s2 = (patch.stiffness - eigen.eigenvalues()).maxCoeff();
  patch.damping = 0.5 * (d + d.transpose());
  Vector motion = at.velocity();
  mask(*at.held, motion);
  patch.q_rate = reduced.v.transpose() * at.masses().cwiseProduct(motion);
  if (others.load_rate.size() > 0) patch.load_rate = reduced.v.transpose() * others.load_rate;
  return true;
}

std::optional<Patch> PatchBuilder::build(FrameModel& frame, std::size_t which, const PatchRequest& request) {
  const ToolPort& port = frame.ports()[which];
  report_ = {};
  terms_ = {};
  modes_.resize(0, 0);
  modes_of_ = nullptr;
  Patch patch;
  patch.scheme = request.scheme;
  patch.contact = port.kind;
  patch.constant = request.scheme == Scheme::hold || request.scheme == Scheme::filtered;
  patch.low_pass_hz = request.scheme == Scheme::filtered ? kFilteredHz : 0;
  patch.tool = frame.tool(which).position;
  patch.tool_velocity = frame.tool(which).velocity;
  patch.force = port.kind == ContactKind::attach || port.touching ? Vec3(-port.lambda) : Vec3::Zero();
  patch.touching = port.kind == ContactKind::attach || port.touching;
  patch.valid_for = 2 * request.horizon + request.silence;
  patch.trust_radius_m = extent_m_;
  if (patch.constant) return patch;
  if (request.scheme == Scheme::balanced && !balanced_) return std::nullopt;
  std::optional<Patch> built;
  if (request.scheme == Scheme::hyper && !can_bend(dynamics_->body())) return fall_back(frame, which, request, Scheme::port);
  if (request.scheme == Scheme::two_layer && !dynamics_->tetrahedra().empty())
    return fall_back(frame, which, request, Scheme::ring);
  // What is not definite on fewer coordinates may be on all. A body in the middle of a fold is definite for a hand that is
  // faster, and its own directions then are worth more than those of a body that cannot fold (docs/notebook/0025).
  constexpr double kFaster = 8;
  std::vector<Footing> footings{Footing{}};
  if (request.scheme != Scheme::tangent && request.scheme != Scheme::balanced) footings.push_back({kFaster});
  if (request.scheme != Scheme::balanced) footings.push_back({1, true});
  const bool hyper = request.scheme == Scheme::hyper;
  const bool of_body_itself = request.scheme == Scheme::two_layer || request.scheme == Scheme::balanced;
  std::vector<FrameModel*> models{&frame};
  if (!of_body_itself && &frame.refined() != &frame) models = {&frame.refined(), &frame};
  for (FrameModel* model : models)
    for (const Footing& footing : footings) {
      if (built) continue;
      held_ = model->held();
      if (hyper) {
        model->select_subdomain(which);
        snapshots_ = &model->snapshots();
      }
      built = request.scheme == Scheme::two_layer ? build_two_layer(*model, which, request, patch, footing)
                                                  : build_whole(*model, which, request, patch, footing);
    }
  return hyper && terms_.variables == 0 ? fall_back(frame, which, request, Scheme::port) : built;
}

std::optional<Patch> PatchBuilder::fall_back(FrameModel& frame, std::size_t which, const PatchRequest& request, Scheme scheme) {
  PatchRequest other = request;
  other.scheme = scheme;
  // More would leave next to nothing of the surface, and no terms bring it.
  if (scheme == Scheme::port && frame.ports()[which].kind == ContactKind::touch)
    other.order = std::min(request.order, kTouchOrder);
  auto built = build(frame, which, other);
  report_.fell_back = true;
  return built;
}

std::vector<std::uint32_t> PatchBuilder::contact_nodes(const ToolPort& port) const {
  if (port.kind == ContactKind::attach) return {port.node};
  const Triangle& corners = skin_->view().triangles[port.point.triangle];
  return {corners.begin(), corners.end()};
}

std::optional<Patch> PatchBuilder::build_whole(FrameModel& frame, std::size_t which, const PatchRequest& request,
                                               const Patch& patch, const Footing& footing) {
  const ToolPort& port = frame.ports()[which];
  if (request.scheme == Scheme::ring && !hold_far_nodes(frame, contact_nodes(port))) return std::nullopt;
  if (port.kind == ContactKind::touch && request.scheme != Scheme::balanced)
    return build_shared_touch(frame, which, request, patch, footing);
  if (port.kind == ContactKind::attach) held_[frame.coordinate(port.node)] = 1;
  const Linearisation at = linearisation_for(request.scheme, frame, held_);
  Model model{at, frame.forces_beside(which), &solver_, &memory_, nullptr, frame.other_nodes(which)};
  mask(held_, model.residual);
  const auto built = port.kind == ContactKind::attach ? build_attach(model, port, request, patch, footing, frame.tool(which))
                                                      : build_touch(model, frame, which, request, patch, footing);
  report_.solver_iterations += solver_.iterations();
  return built;
}

std::optional<Patch> PatchBuilder::build_two_layer(FrameModel& frame, std::size_t which, const PatchRequest& request,
                                                   const Patch& patch, const Footing& footing) {
  if (!two_layer_) two_layer_ = std::make_unique<TwoLayer>(dynamics_->body());
  const ToolPort& port = frame.ports()[which];
  LocalBody local = two_layer_->around(contact_nodes(port), held_);
  const Dynamics dynamics(local.body);
  const BodyState at_stamp = local.restricted(frame.state());
  Tangents tangents(dynamics);
  tangents.take(at_stamp);
  ShiftedSolver solver(dynamics);
  BasisMemory memory;
  if (port.kind == ContactKind::attach) local.body.fixed[local.index(port.node)] = 1;
  Model model{{&dynamics, &at_stamp, &local.body.fixed, &tangents},
              local.restricted(frame.forces_beside(which)),
              &solver,
              &memory,
              &local,
              {}};
  mask(local.body.fixed, model.residual);
  return port.kind == ContactKind::attach ? build_attach(model, port, request, patch, footing, frame.tool(which))
                                          : build_touch(model, frame, which, request, patch, footing);
}

/// Into the first of the memory. After the three of a port come the body's own.
bool PatchBuilder::solve_ports(const Model& model, const std::vector<Vector>& inputs, double tolerance) {
  BasisMemory& memory = *model.memory;
  if (memory.size() < inputs.size()) memory.resize(inputs.size());
  std::vector<SolveColumn> columns;
  for (std::size_t k = 0; k < inputs.size(); ++k) columns.push_back({&inputs[k], &memory[k], k < 3 ? 1 : kOwnLooser});
  return model.solver->solve(model.at, columns, tolerance);
}

std::optional<Mat3> PatchBuilder::static_response(const Model& model, const std::vector<Vector>& inputs) {
  if (!solve_ports(model, inputs, kStaticTolerance)) return std::nullopt;
  Mat3 response;
  for (std::size_t column = 0; column < 3; ++column)
    for (int row = 0; row < 3; ++row)
      response(row, static_cast<int>(column)) = inputs[static_cast<std::size_t>(row)].dot((*model.memory)[column]);
  return symmetric(response);
}

std::optional<Patch> PatchBuilder::build_attach(const Model& model, const ToolPort& port, const PatchRequest& request,
                                                Patch patch, const Footing& footing, const ToolAt& tool) {
  const Linearisation& at = model.at;
  const std::uint32_t node = model.local ? model.local->index(port.node) : at.coordinate(port.node);
  // Columns of K and D that belong to the tool's node: what the tool's motion does to the others, and to itself.
  std::vector<Vector> k_tool(3), d_tool(3);
  Matrix units(at.masses().size(), 3), k_units, d_units;
  for (int axis = 0; axis < 3; ++axis) units.col(axis) = unit(at, node, axis);
  at.multiply(units, k_units, d_units);
  for (int axis = 0; axis < 3; ++axis) {
    const auto column = static_cast<std::size_t>(axis);
    k_tool[column] = k_units.col(axis);
    d_tool[column] = d_units.col(axis);
    patch.k_port.col(axis) = k_tool[column].segment<3>(3 * static_cast<Eigen::Index>(node));
    patch.d_port.col(axis) = d_tool[column].segment<3>(3 * static_cast<Eigen::Index>(node));
    mask(*at.held, k_tool[column]);
    mask(*at.held, d_tool[column]);
  }
  const double node_mass_kg = at.masses()[3 * static_cast<Eigen::Index>(node)];
  const double shift = footing.shift(request, shift_for(request.horizon));
  const bool balanced = request.scheme == Scheme::balanced;
  if (!balanced && !model.solver->prepare(at, shift, footing.clamp)) return std::nullopt;

  if (request.scheme == Scheme::tangent) {
    const auto released = static_response(model, k_tool);
    if (!released) return std::nullopt;
    patch.k_port = symmetric(patch.k_port) - *released;
    patch.d_port.setZero();
    report_.psd_change_1_s2 = project_grasp(patch, node_mass_kg);
    return patch;
  }

  std::vector<Vector> inputs;
  for (std::size_t column = 0; column < 3; ++column) inputs.push_back(-k_tool[column] - shift * d_tool[column]);
  const int modes = modes_for(request.scheme, port.kind, request.order);
  const bool hyper = request.scheme == Scheme::hyper;
  HyperShapes shapes;
  std::optional<HyperBasis> candidates;
  if (hyper) candidates = grasp_shapes(model, node, inputs, {modes, shift, seconds(request.horizon)}, tool, shapes);
  if (hyper && !candidates) return std::nullopt;
  const auto basis = hyper      ? std::optional(candidates->shapes)
                     : balanced ? restricted_basis(balanced_->grasped(port.node), modes, dynamics_->masses(), held_)
                                : grasp_basis(model, inputs, request, {modes, shift});
  Reduced reduced;
  if (!basis || !reduce(at, *basis, hyper ? candidates->at_shapes : at.projected(*basis), model.others, patch, reduced))
    return std::nullopt;
  Matrix& v = reduced.v;
  if (patch.load_rate.size() > 0) patch.load_for = request.horizon;
  patch.b_k.resize(v.cols(), 3);
  patch.b_d.resize(v.cols(), 3);
  for (int axis = 0; axis < 3; ++axis) {
    patch.b_k.col(axis) = -v.transpose() * k_tool[static_cast<std::size_t>(axis)];
    patch.b_d.col(axis) = -v.transpose() * d_tool[static_cast<std::size_t>(axis)];
  }
  patch.k_port = symmetric(patch.k_port);
  patch.d_port = symmetric(patch.d_port);
  patch.g = v.transpose() * model.residual + patch.damping * patch.q_rate;
  Matrix rotation;
  const Matrix true_stiffness = hyper ? joint_stiffness(patch, reduced.stiffness) : Matrix();
  report_.psd_change_1_s2 = std::max(report_.psd_change_1_s2, project_grasp(patch, node_mass_kg, hyper ? &rotation : nullptr));
  if (hyper) {
    shapes.modes = v * rotation;
    shapes.coordinates = shapes.modes.transpose() * at.masses().asDiagonal() * basis.value() * candidates->coordinates;
    Matrix turn = Matrix::Identity(v.cols() + 3, v.cols() + 3);
    turn.bottomRightCorner(v.cols(), v.cols()) = rotation;
    add_terms(model.at, patch, turn.transpose() * true_stiffness * turn, shapes, 0);
  }
  return patch;
}

/// Few modes that have long to last are chosen from more (narrow_basis.hpp); as many as usual, or a short time, gain nothing by
/// it.
std::optional<Matrix> PatchBuilder::grasp_basis(const Model& model, const std::vector<Vector>& inputs,
                                                const PatchRequest& request, BasisRequest wanted) {
  constexpr int kMore = 4;
  const int modes = wanted.modes;
  const bool choose = request.scheme == Scheme::port && request.horizon >= kLongHorizon && modes < kAttachOrder / 2;
  if (choose) wanted.modes += kMore;
  auto basis = krylov_basis(model.at, *model.solver, inputs, {}, model.residual, wanted, *model.memory);
  if (basis && choose)
    basis = narrowed(model.at, *basis, inputs, model.residual, {modes, wanted.shift_1_s, seconds(request.horizon)});
  return basis;
}

/// Where the body was and will be, and where it rests, less where it is.
Matrix PatchBuilder::known_snapshots() const {
  Matrix snapshots(snapshots_->past.rows(), snapshots_->past.cols() + snapshots_->ahead.cols() + 1);
  snapshots << snapshots_->past, snapshots_->ahead, snapshots_->rest;
  return snapshots;
}

/// Directions for a grasp, and how far the tool is likely to move.
std::optional<HyperBasis> PatchBuilder::grasp_shapes(const Model& model, std::uint32_t node, std::vector<Vector> inputs,
                                                     HyperBasisRequest wanted, const ToolAt& tool, HyperShapes& shapes) {
  shapes.amplitude = expected_motion(tool, wanted.horizon_s);
  shapes.port = Matrix::Zero(inputs[0].size(), 3);
  Vector motion = model.at.velocity();
  mask(*model.at.held, motion);
  inputs.push_back(model.residual);
  inputs.push_back(model.at.masses().cwiseProduct(motion));
  if (!solve_ports(model, inputs, kBasisTolerance)) return std::nullopt;
  const BasisMemory& responses = *model.memory;
  KrylovStart start{{}, {}, responses[3], responses[4]};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto column = static_cast<Eigen::Index>(axis);
    const bool across = axis == 2 && dynamics_->body().planar;  // where nothing moves
    shapes.port(3 * static_cast<Eigen::Index>(node) + column, column) = across ? 0 : shapes.amplitude[column];
    start.ports.push_back(shapes.amplitude[column] * responses[axis]);
  }
  const KrylovSolve solve = [&](std::span<const SolveColumn> columns) {
    return model.solver->solve(model.at, columns, kBasisTolerance);
  };
  return hyper_basis(model.at, start, solve, shapes.port, {}, known_snapshots(), wanted, basis_memory_);
}

/// `true_stiffness`: of modes and tool before PSD projection, in the modes of the patch; `vertices` of its surface.
void PatchBuilder::add_terms(const Linearisation& at, const Patch& patch, const Matrix& true_stiffness, HyperShapes& shapes,
                             int vertices) {
  // Where it was, where it will be if it goes on as it did since the last frame or as its tools do, and where it rests.
  std::vector<Vector> snapshots;
  const Matrix& past = snapshots_->past;
  if (past.cols() > 0) snapshots.emplace_back(past.rightCols<1>());
  if (past.cols() > 1) snapshots.emplace_back(past.col(0));
  if (past.cols() > 0) snapshots.emplace_back(-snapshots.front());
  snapshots.push_back(snapshots_->rest);
  for (const auto& snapshot : snapshots_->ahead.colwise()) snapshots.emplace_back(snapshot);
  const Eigen::Index first = shapes.port.cols(), r = shapes.modes.cols();
  shapes.ahead = static_cast<int>(snapshots_->ahead.cols());
  shapes.going_on = snapshots_->going_on;
  shapes.snapshots.resize(first + r, static_cast<Eigen::Index>(snapshots.size()));
  for (std::size_t k = 0; k < snapshots.size(); ++k) {
    auto u = shapes.snapshots.col(static_cast<Eigen::Index>(k));
    if (first > 0) u.head<3>() = (shapes.port.transpose() * snapshots[k]).cwiseQuotient(shapes.amplitude);
    mask(*at.held, snapshots[k]);
    u.tail(r) = shapes.modes.transpose() * at.masses().cwiseProduct(snapshots[k]);
  }
  modes_ = shapes.modes;
  modes_of_ = at.refined;
  modes_generation_ = at.refined ? at.refined->generation() : 0;
  shapes.modes = at.moved(std::move(shapes.modes));
  shapes.port = at.moved(std::move(shapes.port));
  shapes.psd_change = true_stiffness - joint_stiffness(patch, patch.stiffness);
  if (auto terms = nonlinear_terms(at.bending(), patch, shapes, vertices)) terms_ = std::move(*terms);
}

Matrix PatchBuilder::modes() const {
  if (!modes_of_) return modes_;
  if (modes_generation_ != modes_of_->generation()) return {};
  std::vector<std::uint32_t> all(dynamics_->nodes());
  std::iota(all.begin(), all.end(), 0U);
  return modes_of_->moved(modes_, all);
}

}  // namespace palpate
