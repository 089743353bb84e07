// Patches of tools that hold a node.
#include "server/reduce/patch_builder.hpp"

#include <cassert>
#include "server/reduce/patch_builder_common.hpp"
#include "server/reduce/psd_projection.hpp"

namespace palpate {
namespace {

/// The columns of K and D of the tool's node: the effect of its motion on all other nodes, and on itself.
struct ToolColumns {
  std::vector<Vector> k, d;
  Mat3 k_port, d_port;
};

ToolColumns tool_columns(const Linearisation& at, std::uint32_t node) {
  const auto row = 3 * static_cast<Eigen::Index>(node);
  Matrix units = Matrix::Zero(at.masses().size(), 3), k, d;
  units.middleRows<3>(row).setIdentity();
  at.body->multiply(units, k, d);
  ToolColumns tool{{}, {}, k.middleRows<3>(row), d.middleRows<3>(row)};
  for (int axis = 0; axis < 3; ++axis) {
    mask(*at.held, tool.k.emplace_back(k.col(axis)));
    mask(*at.held, tool.d.emplace_back(d.col(axis)));
  }
  return tool;
}

/// Solves P^-1 of the inputs into the first entries of `memory`, which hold the last results. The three of a port precede the own
/// loads.
bool solve_inputs(const Linearisation& at, ShiftedSolver& solver, const std::vector<Vector>& inputs, double tolerance,
                  WarmStarts& memory) {
  if (memory.size() < inputs.size()) memory.resize(inputs.size());
  std::vector<SolveColumn> columns;
  for (std::size_t k = 0; k < inputs.size(); ++k) columns.push_back({&inputs[k], &memory[k], k < 3 ? 1 : kOwnLooser});
  return solver.solve(at, columns, tolerance);
}

/// Returns K_pf K_ff^-1 K_fp.
std::optional<Mat3> released(const Linearisation& at, ShiftedSolver& solver, const std::vector<Vector>& k_tool,
                             WarmStarts& memory) {
  if (!solve_inputs(at, solver, k_tool, kStaticTolerance, memory)) return std::nullopt;
  Mat3 response;
  for (std::size_t column = 0; column < 3; ++column)
    for (std::size_t row = 0; row < 3; ++row)
      response(static_cast<Eigen::Index>(row), static_cast<Eigen::Index>(column)) = k_tool[row].dot(memory[column]);
  return symmetric(response);
}

}  // namespace

bool PatchBuilder::build_grasp(const Job& job, const Model& model, BuiltPatch& made) {
  const Linearisation& at = model.at;
  const PatchRequest& request = *job.request;
  const std::uint32_t node = at.body->coordinate(job.port().node);
  const auto row = 3 * static_cast<Eigen::Index>(node);
  Patch& patch = made.patch;
  assert(node != BodyOperator::kNone && row + 3 <= at.masses().size() && (*at.held)[node]);
  const ToolColumns tool = tool_columns(at, node);
  patch.k_port = symmetric(tool.k_port);
  patch.d_port = symmetric(tool.d_port);
  const double shift = job.shift(shift_for(request.horizon));
  if (!solver_.prepare(at, shift, job.variant.clamp)) return false;
  if (request.scheme == Scheme::tangent) {
    const auto yields = released(at, solver_, tool.k, memory_);
    if (!yields) return false;
    patch.k_port -= *yields;
    patch.d_port.setZero();
    made.psd_change_1_s2 = project_grasp(patch, at.masses()[row]);
    return true;
  }

  PortModel port;
  port.shift_1_s = shift;
  port.prescribed = Matrix::Zero(at.masses().size(), job.hyper() ? 3 : 0);
  std::vector<Vector> inputs;
  for (std::size_t axis = 0; axis < 3; ++axis) inputs.push_back(-tool.k[axis] - shift * tool.d[axis]);
  inputs.push_back(model.residual);
  inputs.push_back(at.free_momentum());
  if (!solve_inputs(at, solver_, inputs, kBasisTolerance, memory_)) return false;
  port.start = {{memory_.begin(), memory_.begin() + 3}, {}, memory_[3], memory_[4]};
  port.solve = remembering(at, solver_, kBasisTolerance, inputs.size(), memory_);
  if (job.hyper()) {
    port.solve = [&](std::span<const SolveColumn> columns) { return solver_.solve(at, columns, kBasisTolerance); };
    const Vec3 far = expected_motion(job.tool(), seconds(request.horizon));
    for (Eigen::Index axis = 0; axis < (dynamics_->body().planar ? 2 : 3); ++axis) port.prescribed(row + axis, axis) = 1;
    for (Eigen::Index axis = 0; axis < 3; ++axis)
      port.snapshots.add(SnapshotKind::port_response,
                         port.start.ports[static_cast<std::size_t>(axis)] + port.prescribed.col(axis), far[axis]);
  }
  Reduced reduced;
  if (!reduce(job, model, port, made, reduced)) return false;
  assert(reduced.v.rows() == at.masses().size());
  Matrix& v = reduced.v;
  patch.b_k.resize(v.cols(), 3);
  patch.b_d.resize(v.cols(), 3);
  for (int axis = 0; axis < 3; ++axis) {
    patch.b_k.col(axis) = -v.transpose() * tool.k[static_cast<std::size_t>(axis)];
    patch.b_d.col(axis) = -v.transpose() * tool.d[static_cast<std::size_t>(axis)];
  }
  Matrix rotation;
  const Matrix stiffness = joint_stiffness(patch, reduced.stiffness);
  made.psd_change_1_s2 = std::max(made.psd_change_1_s2, project_grasp(patch, at.masses()[row], &rotation));
  if (!job.hyper()) return true;
  v = v * rotation;
  reduced.coordinates = rotation.transpose() * reduced.coordinates;
  Matrix turn = Matrix::Identity(v.cols() + 3, v.cols() + 3);
  turn.bottomRightCorner(v.cols(), v.cols()) = rotation;
  add_terms(model, port.prescribed, turn.transpose() * stiffness * turn, 0, reduced, made);
  return true;
}

}  // namespace palpate
