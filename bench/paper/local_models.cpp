#include "bench/paper/local_models.hpp"

#include <Eigen/QR>
#include <Eigen/SparseCholesky>
#include <stdexcept>

#include "server/reduction/patch_build.hpp"

namespace palpate {
namespace {

/// Restricts columns of 3 N entries to the coordinates of the system.
Matrix restricted(const Matrix& columns, const SecondOrderSystem& system) {
  Matrix v(system.size(), columns.cols());
  for (Eigen::Index row = 0; row < v.rows(); ++row)
    v.row(row) = columns.row(static_cast<Eigen::Index>(system.coordinates[static_cast<std::size_t>(row)]));
  return v;
}

/// Orthonormal basis of the span, in mass-scaled coordinates; columns below `dependent` of the largest are dropped.
Matrix independent(const Matrix& columns, const Vector& mass, double dependent) {
  const Vector root = mass.cwiseSqrt();
  Matrix scaled = root.asDiagonal() * columns;
  scaled.colwise().normalize();
  Eigen::ColPivHouseholderQR<Matrix> qr(scaled);
  qr.setThreshold(dependent);
  const Matrix q = qr.householderQ() * Matrix::Identity(scaled.rows(), qr.rank());
  return root.cwiseInverse().asDiagonal() * q;
}

}  // namespace

SecondOrderSystem condensed(const Specimen& specimen, const SecondOrderSystem& system, int layers) {
  const auto near = specimen.near_port(layers);
  std::vector<Eigen::Index> place(system.coordinates.size());
  Eigen::Index inside = 0, outside = 0;
  for (std::size_t row = 0; row < place.size(); ++row) place[row] = near[system.coordinates[row] / 3] ? inside++ : outside++;
  const auto is_near = [&](Eigen::Index row) { return near[system.coordinates[static_cast<std::size_t>(row)] / 3] != 0; };

  std::vector<Eigen::Triplet<double>> k_oo;
  Matrix k_on = Matrix::Zero(outside, inside);
  for (Eigen::Index column = 0; column < system.size(); ++column)
    for (SparseMatrix::InnerIterator entry(system.stiffness, column); entry; ++entry) {
      if (is_near(entry.row())) continue;
      const Eigen::Index i = place[static_cast<std::size_t>(entry.row())], j = place[static_cast<std::size_t>(column)];
      if (is_near(column))
        k_on(i, j) = entry.value();
      else
        k_oo.emplace_back(static_cast<int>(i), static_cast<int>(j), entry.value());
    }
  SparseMatrix oo(outside, outside);
  oo.setFromTriplets(k_oo.begin(), k_oo.end());
  const Eigen::SimplicialLDLT<SparseMatrix> solver(oo);
  if (solver.info() != Eigen::Success) throw std::runtime_error("condensed: the outer nodes can move without stiffness");
  const Matrix follow = -solver.solve(k_on);
  Matrix v = Matrix::Zero(system.size(), inside);
  for (Eigen::Index row = 0; row < system.size(); ++row) {
    const Eigen::Index at = place[static_cast<std::size_t>(row)];
    if (is_near(row))
      v(row, at) = 1;
    else
      v.row(row) = follow.row(at);
  }
  return project(system, v);
}

SecondOrderSystem krylov(const SecondOrderSystem& system, const std::vector<Complex>& shifts_1_s) {
  Matrix columns(system.size(), 0);
  const auto append = [&](const Matrix& more) {
    columns.conservativeResize(Eigen::NoChange, columns.cols() + more.cols());
    columns.rightCols(more.cols()) = more;
  };
  const DynamicStiffness stiffness(system.mass, system.damping, system.stiffness);
  for (const Complex s : shifts_1_s) {
    const ComplexMatrix x = stiffness.at(s).solve(ComplexMatrix(system.b_k.cast<Complex>() + s * system.b_d.cast<Complex>()));
    append(x.real());
    if (s.imag() != 0) append(x.imag());
  }
  constexpr double kDependent = 1e-10;
  return project(system, independent(columns, system.mass, kDependent));
}

std::optional<Matrix> krylov_directions(const Linearisation& at, ShiftedSolver& solver, const KrylovInputs& inputs,
                                        const BasisRequest& request, double tolerance) {
  const KrylovSolve solve = [&](std::span<const SolveColumn> columns) { return solver.solve(at, columns, tolerance); };
  const Vector momentum = at.free_momentum();
  KrylovStart start;
  start.fine = inputs.fine;
  start.ports.resize(inputs.ports.size());
  std::vector<SolveColumn> columns;
  for (std::size_t k = 0; k < inputs.ports.size(); ++k) columns.push_back({&inputs.ports[k], &start.ports[k]});
  columns.push_back({&inputs.residual, &start.residual, kOwnToleranceFactor});
  columns.push_back({&momentum, &start.motion, kOwnToleranceFactor});
  if (!solve(columns)) return std::nullopt;
  return krylov_basis(at, start, solve, request);
}

SecondOrderSystem krylov_moments(const Specimen& specimen, const SecondOrderSystem& system, double shift_1_s, int modes) {
  std::vector<std::uint8_t> held = specimen.body().fixed;
  held[specimen.port_node()] = 1;
  const WholeBody whole(specimen.dynamics(), specimen.rest());
  const Linearisation at(whole, held);
  ShiftedSolver solver(specimen.dynamics());
  if (!solver.prepare(at, shift_1_s, false)) throw std::runtime_error("krylov_moments: the shifted matrix is not definite");
  std::vector<Vector> ports;
  for (Eigen::Index j = 0; j < system.ports(); ++j) {
    Vector b = Vector::Zero(specimen.dynamics().masses().size());
    for (Eigen::Index row = 0; row < system.size(); ++row)
      b[static_cast<Eigen::Index>(system.coordinates[static_cast<std::size_t>(row)])] =
          system.b_k(row, j) + shift_1_s * system.b_d(row, j);
    ports.push_back(b);
  }
  const Vector balanced = Vector::Zero(specimen.dynamics().masses().size());
  const auto basis = krylov_directions(at, solver, {ports, {}, balanced}, {modes, shift_1_s}, 1e-10);
  if (!basis) throw std::runtime_error("krylov_moments: the shifted matrix is not definite");
  return project(system, restricted(*basis, system));
}

SecondOrderSystem patch_model(const Specimen& specimen, const SecondOrderSystem& system, int states) {
  const Skin skin;
  ToolPort port;
  port.kind = ContactKind::attach;
  port.node = specimen.port_node();
  PatchRequest request;
  request.order = states;
  const BodyState rest = specimen.rest();
  const std::vector<ToolPort> ports{port};
  const ToolAt tool{specimen.body().nodes[port.node], Vec3::Zero()};
  FrameModel frame(specimen.dynamics(), skin, softest_stiffness(specimen.dynamics()));
  frame.begin(rest, ports, std::span(&tool, 1), request.horizon);
  const auto built = build_patch(frame, 0, request);
  if (!built) throw std::runtime_error("patch_model: no patch at rest");
  const Patch& patch = built->patch;

  SecondOrderSystem s;
  const Eigen::Index r = patch.modes(), p = system.ports();
  s.mass = Vector::Ones(r);
  s.stiffness = Matrix(patch.stiffness.asDiagonal()).sparseView();
  s.damping = Matrix(patch.damping).sparseView();
  s.b_k.resize(r, p);
  s.b_d.resize(r, p);
  s.k_port.resize(p, p);
  s.d_port.resize(p, p);
  s.port_axes = system.port_axes;
  for (Eigen::Index j = 0; j < p; ++j) {
    const auto axis = static_cast<Eigen::Index>(s.port_axes[static_cast<std::size_t>(j)]);
    s.b_k.col(j) = patch.b_k.col(axis);
    s.b_d.col(j) = patch.b_d.col(axis);
    for (Eigen::Index i = 0; i < p; ++i) {
      const auto row = static_cast<Eigen::Index>(s.port_axes[static_cast<std::size_t>(i)]);
      s.k_port(i, j) = patch.k_port(row, axis);
      s.d_port(i, j) = patch.d_port(row, axis);
    }
  }
  return s;
}

}  // namespace palpate
