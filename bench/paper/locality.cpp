#include "bench/paper/locality.hpp"

#include <Eigen/IterativeLinearSolvers>
#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace palpate {
namespace {

using Row = Eigen::Index;

Vec3 node_of(const Vector& y, std::uint32_t node) { return y.segment<3>(3 * static_cast<Row>(node)); }

/// Scatters rows of the system to their places among all nodes; the rest is zero.
Vector spread(const SecondOrderSystem& system, const Vector& rows, Row size) {
  Vector y = Vector::Zero(size);
  for (Row i = 0; i < rows.size(); ++i) y[static_cast<Row>(system.coordinates[static_cast<std::size_t>(i)])] = rows[i];
  return y;
}

Vec3 direction(const LumpedBody& body, const Element& e) { return (body.nodes[e.a] - body.nodes[e.b]) / e.rest_length_m; }

double elongation(const LumpedBody& body, const Element& e, const Vector& u) {
  return direction(body, e).dot(node_of(u, e.a) - node_of(u, e.b));
}

std::vector<double> magnitudes(const Vector& y, std::size_t nodes, double scale) {
  std::vector<double> m(nodes);
  for (std::uint32_t i = 0; i < nodes; ++i) m[i] = node_of(y, i).norm() / scale;
  return m;
}

double largest(const Vector& y) {
  double m = 0;
  for (Row i = 0; i + 2 < y.size(); i += 3) m = std::max(m, y.segment<3>(i).norm());
  return m > 0 ? m : 1;
}

/// Adds `value` at distance `r` to the sums of all radii of at least `r`.
void add_within(double r, double value, const std::vector<double>& radii_m, std::vector<double>& sums) {
  for (std::size_t k = 0; k < radii_m.size(); ++k)
    if (r <= radii_m[k]) sums[k] += value;
}

std::vector<double> energy_shares(const Specimen& specimen, const Vector& u, const Vector& v,
                                  const std::vector<double>& radii_m) {
  const LumpedBody& body = specimen.body();
  const Vec3 port = body.nodes[specimen.port_node()];
  std::vector<double> within(radii_m.size(), 0);
  double total = 0;
  const auto add = [&](const Vec3& at, double energy) {
    total += energy;
    add_within((at - port).norm(), energy, radii_m, within);
  };
  for (const Element& e : body.elements)
    add(0.5 * (body.nodes[e.a] + body.nodes[e.b]), 0.5 * e.stiffness_n_m * std::pow(elongation(body, e, u), 2));
  for (std::uint32_t i = 0; i < body.nodes.size(); ++i) add(body.nodes[i], 0.5 * body.masses_kg[i] * node_of(v, i).squaredNorm());
  for (double& w : within) w /= total;
  return within;
}

/// Norm of the tensor 1 / (2 V) sum of the elements' tensions at a node.
double nodal_stress(const LumpedBody& body, std::uint32_t node, const Vector& u, double cell) {
  Mat3 sum = Mat3::Zero();
  for (const Element& e : body.elements) {
    if (e.a != node && e.b != node) continue;
    const Vec3 d = direction(body, e);
    sum += e.stiffness_n_m * elongation(body, e, u) * e.rest_length_m * d * d.transpose();
  }
  return (sum / (2 * cell)).norm();
}

/// Displacements of all nodes for a unit displacement of the port along `axis`.
Vector static_push(const Specimen& specimen, const SecondOrderSystem& system, Row axis) {
  const auto at = std::find(system.port_axes.begin(), system.port_axes.end(), static_cast<std::uint32_t>(axis));
  Eigen::ConjugateGradient<SparseMatrix, Eigen::Lower | Eigen::Upper> solver(system.stiffness);
  solver.setTolerance(1e-12);
  const Vector q = solver.solve(system.b_k.col(at - system.port_axes.begin()));
  if (solver.info() != Eigen::Success) throw std::runtime_error("static_push: the body can move without stiffness");
  Vector u = spread(system, q, specimen.dynamics().masses().size());
  u[3 * static_cast<Row>(specimen.port_node()) + axis] = 1;
  return u;
}

}  // namespace

std::vector<StateShape> state_shapes(const Specimen& specimen, const SecondOrderSystem& system, const Matrix& directions,
                                     const std::vector<double>& radii_m) {
  const Row n = system.size(), size = specimen.dynamics().masses().size();
  const std::size_t nodes = specimen.body().nodes.size();
  std::vector<StateShape> shapes;
  for (Row k = 0; k < directions.cols(); ++k) {
    const Vector u = spread(system, directions.col(k).head(n), size), v = spread(system, directions.col(k).tail(n), size);
    shapes.push_back(
        {magnitudes(u, nodes, largest(u)), magnitudes(v, nodes, largest(v)), energy_shares(specimen, u, v, radii_m)});
  }
  return shapes;
}

std::vector<double> even_share(const Specimen& specimen, const std::vector<double>& radii_m) {
  const LumpedBody& body = specimen.body();
  const Vec3 port = body.nodes[specimen.port_node()];
  std::vector<double> within(radii_m.size(), 0);
  for (const Element& e : body.elements)
    add_within((0.5 * (body.nodes[e.a] + body.nodes[e.b]) - port).norm(), 1.0 / static_cast<double>(body.elements.size()),
               radii_m, within);
  return within;
}

std::vector<StressAt> stress_below_port(const Specimen& specimen) {
  const LumpedBody& body = specimen.body();
  const Row axis = body.planar ? 1 : 2;
  const Vector u = static_push(specimen, specimen.system(), axis);
  const Vec3 port = body.nodes[specimen.port_node()];
  const double spacing = body.elements.front().rest_length_m;
  const double cell = body.planar ? spacing * spacing : spacing * spacing * spacing;
  std::vector<StressAt> line;
  for (std::uint32_t i = 0; i < body.nodes.size(); ++i) {
    const Vec3 from_port = body.nodes[i] - port;
    const double depth = -from_port[axis];
    if (body.fixed[i] || depth < 0.5 * spacing || from_port.norm() > depth * (1 + 1e-9)) continue;
    line.push_back({depth, nodal_stress(body, i, u, cell)});
  }
  std::sort(line.begin(), line.end(), [](const StressAt& a, const StressAt& b) { return a.depth_m < b.depth_m; });
  return line;
}

double decay_exponent(const std::vector<StressAt>& stress, double from_m, double to_m) {
  double n = 0, x = 0, y = 0, xx = 0, xy = 0;
  for (const StressAt& s : stress) {
    if (s.depth_m < from_m || s.depth_m > to_m) continue;
    const double lx = std::log(s.depth_m), ly = std::log(s.stress);
    n += 1;
    x += lx;
    y += ly;
    xx += lx * lx;
    xy += lx * ly;
  }
  return -(n * xy - x * y) / (n * xx - x * x);
}

}  // namespace palpate
