#include "server/reduce/patch_builder.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>

#include "server/reduce/lift.hpp"
#include "server/reduce/port_surface.hpp"

namespace palpate {
namespace {

constexpr double kBasisTolerance = 1e-2, kStaticTolerance = 1e-3;

Mat3 symmetric(const Mat3& m) { return 0.5 * (m + m.transpose()); }

}  // namespace

PatchBuilder::PatchBuilder(const Dynamics& dynamics, const Skin& skin, double softest_1_s2)
    : dynamics_(&dynamics),
      skin_(&skin),
      neighbours_(dynamics.nodes()),
      softest_1_s2_(softest_1_s2),
      solver_(dynamics),
      ring_(dynamics, skin) {
  const LumpedBody& body = dynamics.body();
  Eigen::AlignedBox3d box;
  for (const Vec3& x : body.nodes) box.extend(x);
  extent_m_ = box.diagonal().norm();
  for (const Element& e : body.elements) {
    neighbours_[e.a].push_back(e.b);
    neighbours_[e.b].push_back(e.a);
    spacing_m_ += e.rest_length_m / static_cast<double>(body.elements.size());
  }
}

int PatchBuilder::modes_for(Scheme scheme, ContactKind contact, int order) {
  if (scheme == Scheme::hold || scheme == Scheme::filtered || scheme == Scheme::tangent) return 0;
  const int states = order > 0 ? order : (contact == ContactKind::attach ? kAttachOrder : kTouchOrder);
  return std::clamp(states / 2, 1, kMaxModes);
}

Vector PatchBuilder::unit(std::uint32_t node, int axis) const {
  Vector e = Vector::Zero(dynamics_->masses().size());
  e[3 * static_cast<Eigen::Index>(node) + axis] = 1;
  return e;
}

void PatchBuilder::hold_far_nodes(const std::vector<std::uint32_t>& seeds) {
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
  for (std::uint32_t i = 0; i < dynamics_->nodes(); ++i)
    if (!near[i]) held_[i] = 1;
}

bool PatchBuilder::reduce(const Linearisation& at, const Matrix& v, const OtherTools& others, Patch& patch, Matrix& rotated) {
  const auto r = v.cols();
  Matrix k_v(v.rows(), r), d_v(v.rows(), r);
  for (Eigen::Index c = 0; c < r; ++c) {
    Vector k_column, d_column;
    dynamics_->multiply_tangents(*at.state, v.col(c), k_column, d_column);
    k_v.col(c) = k_column;
    d_v.col(c) = d_column;
  }
  Matrix k = v.transpose() * k_v;
  for (const OtherTools::Spring& spring : others.springs) {
    Matrix rows = Matrix::Zero(3, r);
    for (const auto& [node, weight] : spring.port->b) rows += weight * v.middleRows<3>(3 * static_cast<Eigen::Index>(node));
    k += rows.transpose() * spring.stiffness * rows;
  }
  const Eigen::SelfAdjointEigenSolver<Matrix> eigen(0.5 * (k + k.transpose()));
  if (eigen.info() != Eigen::Success) return false;
  const Matrix& u = eigen.eigenvectors();
  rotated = v * u;
  const Matrix d = u.transpose() * (v.transpose() * d_v) * u;
  patch.stiffness = eigen.eigenvalues().cwiseAbs().cwiseMax(softest_1_s2_);
  report_.lifted_1_s2 = r > 0 ? (patch.stiffness - eigen.eigenvalues()).maxCoeff() : 0.0;
  patch.damping = 0.5 * (d + d.transpose());
  Vector motion = at.state->v;
  mask(*at.held, motion);
  patch.q_rate = rotated.transpose() * dynamics_->masses().cwiseProduct(motion);
  if (others.load_rate.size() > 0) patch.load_rate = rotated.transpose() * others.load_rate;
  return true;
}

std::optional<Patch> PatchBuilder::build(FrameModel& frame, std::size_t which, const PatchRequest& request) {
  const ToolPort& port = frame.ports()[which];
  report_ = {};
  Patch patch;
  patch.scheme = request.scheme;
  patch.contact = port.kind;
  patch.constant = request.scheme == Scheme::hold || request.scheme == Scheme::filtered;
  patch.low_pass_hz = request.scheme == Scheme::filtered ? kFilteredHz : 0;
  patch.tool = frame.tool(which).position;
  patch.tool_velocity = frame.tool(which).velocity;
  patch.force = port.kind == ContactKind::attach || port.touching ? Vec3(-port.lambda) : Vec3::Zero();
  patch.touching = port.kind == ContactKind::attach || port.touching;
  patch.valid_for = 2 * request.bridge + Micros{250'000};
  patch.trust_radius_m = extent_m_;
  if (patch.constant) return patch;
  std::optional<Patch> built;
  for (const bool clamp : {false, true}) {
    held_ = frame.held();
    built = port.kind == ContactKind::attach ? build_attach(frame, which, request, patch, clamp)
                                             : build_touch(frame, which, request, patch, clamp);
    if (built) break;
  }
  return built;
}

std::optional<Mat3> PatchBuilder::static_response(const Linearisation& at, const std::vector<Vector>& inputs) {
  Mat3 response;
  for (std::size_t column = 0; column < 3; ++column) {
    if (memory_.size() <= column) memory_.emplace_back(Vector::Zero(inputs[column].size()));
    if (!solver_.solve(at, inputs[column], kStaticTolerance, memory_[column])) return std::nullopt;
    for (int row = 0; row < 3; ++row)
      response(row, static_cast<int>(column)) = inputs[static_cast<std::size_t>(row)].dot(memory_[column]);
  }
  return symmetric(response);
}

std::optional<Patch> PatchBuilder::build_attach(const FrameModel& frame, std::size_t which, const PatchRequest& request,
                                                Patch patch, bool clamp) {
  const ToolPort& port = frame.ports()[which];
  const BodyState& state = frame.state();
  if (request.scheme == Scheme::ring) hold_far_nodes({port.node});
  held_[port.node] = 1;
  const Linearisation at{dynamics_, &state, &held_};
  // Columns of K and D that belong to the tool's node: what the tool's motion does to the others, and to itself.
  std::vector<Vector> k_tool(3), d_tool(3);
  for (int axis = 0; axis < 3; ++axis) {
    const auto column = static_cast<std::size_t>(axis);
    dynamics_->multiply_tangents(state, unit(port.node, axis), k_tool[column], d_tool[column]);
    patch.k_port.col(axis) = k_tool[column].segment<3>(3 * static_cast<Eigen::Index>(port.node));
    patch.d_port.col(axis) = d_tool[column].segment<3>(3 * static_cast<Eigen::Index>(port.node));
    mask(held_, k_tool[column]);
    mask(held_, d_tool[column]);
  }
  const double node_mass_kg = dynamics_->masses()[3 * static_cast<Eigen::Index>(port.node)];
  const double shift = request.scheme == Scheme::tangent ? 0 : shift_for(request.bridge);
  if (!solver_.prepare(at, shift, clamp)) return std::nullopt;

  if (request.scheme == Scheme::tangent) {
    const auto released = static_response(at, k_tool);
    if (!released) return std::nullopt;
    patch.k_port = symmetric(patch.k_port) - *released;
    patch.d_port.setZero();
    report_.lifted_1_s2 = lift_grasp(patch, node_mass_kg);
    return patch;
  }

  Vector imbalance;
  dynamics_->forces(state.x, state.v, imbalance);
  mask(held_, imbalance);
  std::vector<Vector> inputs;
  for (std::size_t column = 0; column < 3; ++column) inputs.push_back(-k_tool[column] - shift * d_tool[column]);
  const auto basis =
      krylov_basis(at, solver_, inputs, {}, imbalance, {modes_for(request.scheme, port.kind, request.order), shift}, memory_);
  report_.solver_iterations += solver_.iterations();
  Matrix v;
  if (!basis || !reduce(at, *basis, frame.other_nodes(which), patch, v)) return std::nullopt;
  if (patch.load_rate.size() > 0) patch.load_for = request.bridge;
  patch.b_k.resize(v.cols(), 3);
  patch.b_d.resize(v.cols(), 3);
  for (int axis = 0; axis < 3; ++axis) {
    patch.b_k.col(axis) = -v.transpose() * k_tool[static_cast<std::size_t>(axis)];
    patch.b_d.col(axis) = -v.transpose() * d_tool[static_cast<std::size_t>(axis)];
  }
  patch.k_port = symmetric(patch.k_port);
  patch.d_port = symmetric(patch.d_port);
  patch.g = v.transpose() * imbalance + patch.damping * patch.q_rate;
  report_.lifted_1_s2 = std::max(report_.lifted_1_s2, lift_grasp(patch, node_mass_kg));
  return patch;
}

std::optional<Patch> PatchBuilder::build_touch(FrameModel& frame, std::size_t which, const PatchRequest& request, Patch patch,
                                               bool clamp) {
  const ToolPort& port = frame.ports()[which];
  const Triangle& corners = skin_->view().triangles[port.point.triangle];
  const bool ring = request.scheme == Scheme::ring, tangent = request.scheme == Scheme::tangent;
  if (ring) hold_far_nodes({corners.begin(), corners.end()});
  const Linearisation at{dynamics_, &frame.state(), &held_};
  patch.coupling_n_m = port.parameters.coupling_n_m;
  patch.friction = port.parameters.friction;
  patch.trust_radius_m = 6 * spacing_m_;

  const double shift = tangent ? 0 : frame.shift(request.bridge);
  const double tolerance = tangent ? kStaticTolerance : kBasisTolerance;
  SharedSystem* const p =
      ring ? (ring_.prepare(at, shift, clamp, tolerance) ? &ring_ : nullptr) : frame.system(shift, clamp, tolerance);
  if (!p) return std::nullopt;
  const int before = p->iterations();
  const auto others = frame.others(*p, which);
  if (!others) return std::nullopt;
  Matrix v(dynamics_->masses().size(), 0);
  if (tangent) {
    const SpringCorrection correct(*others);
    const PortAnswer& own = *p->port(which, port.point);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      Vector x = own.answer[axis];
      correct.apply(x);
      patch.c_static.col(static_cast<int>(axis)) = gather(own.b, x);
    }
    patch.c_static = symmetric(patch.c_static);
  } else {
    const auto basis = touch_basis(frame, *p, which, *others, at, request);
    if (!basis || !reduce(at, *basis, *others, patch, v)) return std::nullopt;
    Vector imbalance = frame.forces();
    if (others->load.size() > 0) imbalance += others->load;
    patch.g = v.transpose() * imbalance + patch.damping * patch.q_rate;
    if (patch.load_rate.size() > 0) patch.load_for = request.bridge;
  }
  report_.solver_iterations += p->iterations() - before;
  cut_port_surface(*skin_, frame.positions(), v, port.point, seconds(request.bridge) * frame.tool(which).velocity,
                   request.vertices_max(patch.modes(), patch.load_rate.size() > 0), patch);
  if (tangent && port.touching)
    for (int i = 0; i < patch.surface.vertex_count; ++i)
      patch.surface.vertices[static_cast<std::size_t>(i)].position -= patch.c_static * port.lambda;
  return patch;
}

/// Directions for a touch, the springs of coupled tools in P.
std::optional<Matrix> PatchBuilder::touch_basis(FrameModel& frame, SharedSystem& p, std::size_t which, const OtherTools& others,
                                                const Linearisation& at, const PatchRequest& request) {
  const SpringCorrection correct(others);
  const PortAnswer& own = *p.port(which, frame.ports()[which].point);
  const Vector* const imbalance = p.imbalance(frame.total());
  const Vector* const motion = p.motion();
  if (!imbalance || !motion) return std::nullopt;
  KrylovStart start{{own.answer.begin(), own.answer.end()}, {}, {}, *imbalance, *motion};
  for (const Vector& b : own.input) start.fine.push_back(b.cwiseQuotient(dynamics_->masses()));
  int modes = modes_for(request.scheme, ContactKind::touch, request.order);
  Vector load;
  for (std::size_t k = 0, o = 0; k < frame.ports().size(); ++k) {
    if (k == which || frame.ports()[k].kind != ContactKind::touch || !frame.ports()[k].touching) continue;
    const OtherTools::Spring& spring = others.springs[o++];
    const Vec3 rate = spring.stiffness * frame.tool(k).velocity;
    if (!spring.coupled || rate.isZero(0)) continue;
    if (load.size() == 0) load = Vector::Zero(at.state->x.size());
    for (std::size_t axis = 0; axis < 3; ++axis) load += rate[static_cast<int>(axis)] * spring.port->answer[axis];
  }
  if (load.size() > 0 && !getenv("NOLOAD")) {
    start.loads.push_back(load);
    if (request.order == 0) ++modes;
  }
  for (auto* directions : {&start.ports, &start.loads})
    for (Vector& x : *directions) correct.apply(x);
  correct.apply(start.imbalance);
  correct.apply(start.motion);
  const KrylovSolve solve = [&](const Vector& b, Vector& x) {
    if (!p.solve(b, x)) return false;
    correct.apply(x);
    return true;
  };
  return krylov_basis(at, start, solve, {modes, p.shift(), kBasisTolerance});
}

}  // namespace palpate
