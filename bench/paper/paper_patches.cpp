#include "bench/paper/paper_patches.hpp"

#include <Eigen/Eigenvalues>
#include <cassert>

#include "bench/paper/local_models.hpp"
#include "common/wire/codec.hpp"
#include "server/body/settle.hpp"
#include "server/reduction/patch_build.hpp"
#include "server/reduction/port_surface.hpp"
#include "server/reduction/psd_projection.hpp"

namespace palpate {
namespace {

constexpr double kKrylovTolerance = 1e-2;  // as a server's (patch_build.cpp)
constexpr double kTrustedSpacings = 6;     // likewise

/// K e_i and D e_i for the axes of a node, without the held nodes.
struct NodeColumns {
  std::vector<Vector> k, d;
  Mat3 k_port, d_port;
};

NodeColumns columns_of(const Linearisation& at, std::uint32_t node) {
  const auto row = 3 * static_cast<Eigen::Index>(node);
  Matrix units = Matrix::Zero(at.masses().size(), 3), k, d;
  units.middleRows<3>(row).setIdentity();
  at.body->multiply(units, k, d);
  NodeColumns columns{{}, {}, k.middleRows<3>(row), d.middleRows<3>(row)};
  for (int axis = 0; axis < 3; ++axis) {
    mask(*at.held, columns.k.emplace_back(k.col(axis)));
    mask(*at.held, columns.d.emplace_back(d.col(axis)));
  }
  return columns;
}

/// Sets K, D, g and q' of the modes, and returns V rotated so that K is diagonal.
Matrix set_modes(const Linearisation& at, const Vector& residual, const Matrix& basis, double softest_1_s2, Patch& patch) {
  const Projection projected = at.projected(basis);
  const Eigen::SelfAdjointEigenSolver<Matrix> eigen(0.5 * (projected.k + projected.k.transpose()));
  Matrix v = basis * eigen.eigenvectors();
  const Matrix d = eigen.eigenvectors().transpose() * projected.d * eigen.eigenvectors();
  patch.stiffness = eigen.eigenvalues().cwiseAbs().cwiseMax(softest_1_s2);
  patch.damping = 0.5 * (d + d.transpose());
  patch.q_rate = v.transpose() * at.free_momentum();
  patch.g = v.transpose() * residual + patch.damping * patch.q_rate;
  return v;
}

std::vector<std::uint32_t> contact_nodes(const Skin& skin, const ToolPort& port) {
  if (port.kind == ContactKind::attach) return {port.node};
  const Triangle& corners = skin.view().triangles[port.point.triangle];
  return {corners.begin(), corners.end()};
}

}  // namespace

PaperPatches::PaperPatches(Model model, const Scene& scene)
    : model_(model),
      body_(scene.body),
      dynamics_(body_),
      skin_(body_, scene.tool.radius_m),
      rest_(settled_state(dynamics_, scene.name)),
      softest_1_s2_(softest_stiffness(dynamics_)),
      spacing_m_(mean_edge_m(body_)),
      two_layer_(body_),
      balanced_(dynamics_, skin_, rest_) {
  assert(body_.relaxation.empty() && (model == Model::balanced || !body_.is_solid()));
}

std::optional<Patch> PaperPatches::build(const Room::Origin& at, const Patch& held, Micros horizon) {
  const ToolPort& port = at.port;
  std::vector<std::uint8_t> still = body_.fixed;
  if (port.kind == ContactKind::attach) still[port.node] = 1;
  Vector residual;
  dynamics_.forces(at.body, residual);
  mask(still, residual);
  if (model_ == Model::balanced) {
    const WholeBody whole(dynamics_, at.body);
    return reduce({Linearisation(whole, still), std::move(residual), nullptr}, at, held, horizon);
  }
  const LocalBody local = two_layer_.around(contact_nodes(skin_, port), still);
  const Dynamics dynamics(local.body);
  const BodyState here = local.restricted(at.body);
  const WholeBody part(dynamics, here);
  residual = local.restricted(residual);
  mask(local.body.fixed, residual);
  return reduce({Linearisation(part, local.body.fixed), std::move(residual), &local}, at, held, horizon);
}

std::optional<Matrix> PaperPatches::krylov(const Reduced& body, const Dynamics& dynamics, const std::vector<Vector>& inputs,
                                           const std::vector<Vector>& fine, int modes, Micros horizon) const {
  const double shift = shift_for(horizon);
  ShiftedSolver solver(dynamics);
  if (!solver.prepare(body.at, shift, false)) return std::nullopt;
  return krylov_directions(body.at, solver, {inputs, fine, body.residual}, {modes, shift}, kKrylovTolerance);
}

std::optional<Patch> PaperPatches::reduce(const Reduced& body, const Room::Origin& at, const Patch& held, Micros horizon) {
  const ToolPort& port = at.port;
  const bool grasp = port.kind == ContactKind::attach;
  constexpr int kTouchModes = 8;  // as many as leave twelve vertices in a datagram, as these patches have no terms
  const int modes = port.kind == ContactKind::touch ? kTouchModes : modes_for(Scheme::port, port.kind, 0);
  Patch patch = held;
  patch.scheme = Scheme::port;
  patch.constant = false;
  std::optional<Matrix> basis;
  NodeColumns node;
  const auto rows = [&](std::uint32_t i, const Matrix& v) {
    return body.local ? body.local->rows(i, v) : body.at.body->rows(i, v);
  };
  if (grasp) {
    const std::uint32_t row = body.local ? body.local->index(port.node) : port.node;
    node = columns_of(body.at, row);
    patch.k_port = 0.5 * (node.k_port + node.k_port.transpose());
    patch.d_port = 0.5 * (node.d_port + node.d_port.transpose());
    if (model_ == Model::balanced) {
      basis = restricted_basis(balanced_.grasped(port.node), modes, dynamics_.masses(), *body.at.held);
    } else {
      std::vector<Vector> inputs;
      for (std::size_t axis = 0; axis < 3; ++axis) inputs.push_back(-node.k[axis] - shift_for(horizon) * node.d[axis]);
      basis = krylov(body, body.at.body->dynamics(), inputs, {}, modes, horizon);
    }
  } else {
    patch.contact_stiffness_n_m = port.parameters.contact_stiffness_n_m;
    patch.friction = port.parameters.friction;
    patch.trust_radius_m = kTrustedSpacings * spacing_m_;
    if (model_ == Model::balanced) {
      basis = restricted_basis(balanced_.touched(port.point), modes, dynamics_.masses(), *body.at.held);
    } else {
      const NodeWeights b = body.local->restricted(skin_.weights(port.point));
      std::vector<Vector> inputs, fine;
      for (int axis = 0; axis < 3; ++axis) {
        scatter(b, Vec3::Unit(axis), inputs.emplace_back(Vector::Zero(body.at.masses().size())));
        mask(*body.at.held, inputs.back());
        fine.emplace_back(inputs.back().cwiseQuotient(body.at.masses()));
      }
      basis = krylov(body, body.at.body->dynamics(), inputs, fine, modes, horizon);
    }
  }
  if (!basis) return std::nullopt;
  const Matrix v = basis->cols() > 0 ? set_modes(body.at, body.residual, *basis, softest_1_s2_, patch) : *basis;
  if (grasp) {
    patch.b_k.resize(v.cols(), 3);
    patch.b_d.resize(v.cols(), 3);
    for (int axis = 0; axis < 3; ++axis) {
      patch.b_k.col(axis) = -v.transpose() * node.k[static_cast<std::size_t>(axis)];
      patch.b_d.col(axis) = -v.transpose() * node.d[static_cast<std::size_t>(axis)];
    }
    project_grasp(patch, body_.masses_kg[port.node]);
  } else {
    std::vector<double> x;
    skin_.place(at.body.x, x);
    const int vertices = max_port_vertices(patch.modes(), kMaxPortTriangles, false, 0, 0);
    const ContactPath path{port.point, seconds(horizon) * held.tool_velocity};
    cut_port_surface(
        skin_, x, [&](std::uint32_t i) { return rows(i, v); }, {&path, 1}, vertices, vertices, patch);
  }
  leave_room_for_rounding(patch);
  return patch;
}

}  // namespace palpate
