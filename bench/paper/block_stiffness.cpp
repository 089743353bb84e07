#include "bench/paper/block_stiffness.hpp"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "bench/paper/block_scaling.hpp"
#include "bench/paper/chain.hpp"
#include "server/body/dynamics.hpp"
#include "server/scene/lattice.hpp"
#include "server/solve/linear_solver.hpp"

namespace palpate {
namespace {

using Nodes = std::vector<std::uint32_t>;

struct Block {
  LumpedBody body;            // fixed nodes: the held end
  std::vector<Nodes> groups;  // loaded nodes: those of a group move as one
};

/// Box of `across` x (`across` x) `deep` elements with k = 1; the last axis points from the fixed end to the loaded face.
LatticeBody box(int dimension, int across, int deep) {
  LatticeSettings s;
  s.planar = dimension == 2;
  s.nodes = dimension == 2 ? std::array{across + 1, deep + 1, 1} : std::array{across + 1, across + 1, deep + 1};
  s.size_m = dimension == 2 ? Vec3(across, deep, 1) : Vec3(across, across, deep);
  s.stiffness_n_m = 1;
  return build_box(s);
}

Block row(int elements) {
  return {chain_body({.masses = elements - 1, .stiffness_n_m = 1, .damping_n_s_m = 0, .mass_kg = 1}), {{0}}};
}

/// Cube of m elements, loaded on the top and fixed at the bottom.
Block column(BlockLoading loading, int dimension, int m) {
  LatticeBody lattice = box(dimension, m, m);
  Block block{std::move(lattice.body), {}};
  Nodes top;
  lattice.grid.each([&](const Index3& n) {
    const int height = n[static_cast<std::size_t>(dimension - 1)];
    const std::uint32_t node = lattice.number[lattice.grid.index(n)];
    block.body.fixed[node] = height == 0;
    const bool middle = n[0] == m / 2 && (dimension == 2 || n[1] == m / 2);
    if (height == m && (loading != BlockLoading::node || middle)) top.push_back(node);
  });
  if (loading == BlockLoading::plate)
    block.groups = {top};
  else
    for (const std::uint32_t node : top) block.groups.push_back({node});
  return block;
}

/// Half space up to m elements beyond the cells around a node of its face.
Block around_contact(int dimension, int m) {
  const int reach = m + 1;
  LatticeBody lattice = box(dimension, 2 * reach, reach);
  Block block{std::move(lattice.body), {{}}};
  lattice.grid.each([&](const Index3& n) {
    int distance = 0;
    for (int axis = 0; axis < dimension; ++axis)
      distance = std::max(distance, std::abs(n[static_cast<std::size_t>(axis)] - reach));
    const std::uint32_t node = lattice.number[lattice.grid.index(n)];
    block.body.fixed[node] = distance == reach;
    if (distance <= 1) block.groups[0].push_back(node);
  });
  return block;
}

Block make_block(BlockLoading loading, int dimension, int elements) {
  if (dimension == 1) return row(elements);
  return loading == BlockLoading::contact ? around_contact(dimension, elements) : column(loading, dimension, elements);
}

/// Forces on the groups per displacement of each group along each axis.
Matrix stiffness_matrix(const Block& block, int dimension) {
  const Dynamics dynamics(block.body);
  const BodyState rest = dynamics.rest_state();
  std::vector<std::uint8_t> held = block.body.fixed;
  for (const Nodes& group : block.groups)
    for (const std::uint32_t i : group) held[i] = 1;
  // A straight row has no stiffness sideways; a little mass regularises those coordinates.
  const double mass = dimension == 1 ? 1e-12 : 0;
  BlockMatrix k = dynamics.make_matrix();
  dynamics.assemble(rest, mass, 0, 1, held, false, k);
  LinearSolver solver(dynamics.nodes());
  solver.factorise(k);

  constexpr double kTolerance = 1e-11;
  const auto count = static_cast<Eigen::Index>(block.groups.size());
  Matrix stiffness(dimension * count, dimension * count);
  Vector k_y, d_y;
  for (Eigen::Index column = 0; column < stiffness.cols(); ++column) {
    Vector y = Vector::Zero(rest.x.size()), x = Vector::Zero(rest.x.size());
    for (const std::uint32_t i : block.groups[static_cast<std::size_t>(column / dimension)])
      y[3 * static_cast<Eigen::Index>(i) + column % dimension] = 1;
    dynamics.multiply_tangents(rest, y, k_y, d_y);
    Vector load = -k_y;
    mask(held, load);
    if (load.norm() > 0) solver.solve(load, kTolerance, x);
    dynamics.multiply_tangents(rest, y + x, k_y, d_y);
    for (Eigen::Index r = 0; r < stiffness.rows(); ++r) {
      stiffness(r, column) = 0;
      for (const std::uint32_t i : block.groups[static_cast<std::size_t>(r / dimension)])
        stiffness(r, column) += k_y[3 * static_cast<Eigen::Index>(i) + r % dimension];
    }
  }
  return stiffness;
}

/// Slope and intercept of y over x.
std::pair<double, double> line(const std::vector<double>& x, const std::vector<double>& y) {
  double sx = 0, sy = 0, sxx = 0, sxy = 0;
  const auto n = static_cast<double>(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) {
    sx += x[i];
    sy += y[i];
    sxx += x[i] * x[i];
    sxy += x[i] * y[i];
  }
  const double slope = (n * sxy - sx * sy) / (n * sxx - sx * sx);
  return {slope, (sy - slope * sx) / n};
}

}  // namespace

const char* name_of(BlockLoading loading) {
  constexpr const char* kNames[] = {"plate", "nodes", "node", "contact"};
  return kNames[static_cast<std::size_t>(loading)];
}

double block_stiffness(BlockLoading loading, int dimension, int elements) {
  const Matrix k = stiffness_matrix(make_block(loading, dimension, elements), dimension);
  return Eigen::JacobiSVD<Matrix>(k).singularValues()[0];
}

BlockCurve block_curve(BlockLoading loading, int dimension, int elements_max) {
  BlockCurve curve{loading, dimension, {}, {}, 0};
  std::vector<double> log_m, log_k;
  for (int m = 1; m <= elements_max; ++m) {
    curve.elements.push_back(m);
    curve.stiffness.push_back(block_stiffness(loading, dimension, m));
    if (2 * m < elements_max) continue;
    log_m.push_back(std::log(m));
    log_k.push_back(std::log(curve.stiffness.back()));
  }
  curve.exponent = log_m.size() > 1 ? line(log_m, log_k).first : 0;
  return curve;
}

ShellFit fit_shells(const BlockCurve& contact) {
  const int d = contact.dimension;
  std::vector<double> shell, radius;
  for (std::size_t i = 1; i < contact.elements.size(); ++i) {
    const double w = contact.stiffness[0] / contact.stiffness[i] - contact.stiffness[0] / contact.stiffness[i - 1];
    shell.push_back(contact.elements[i]);
    radius.push_back(std::pow(w, -1.0 / (d - 1)));
  }
  ShellFit fit;
  std::tie(fit.growth, fit.first) = line(shell, radius);
  double sum = 1;
  for (std::size_t i = 1; i < contact.elements.size(); ++i) {
    sum += std::pow(fit.first + fit.growth * contact.elements[i], 1 - d);
    fit.worst = std::max(fit.worst, std::abs(sum * contact.stiffness[i] / contact.stiffness[0] - 1));
  }
  return fit;
}

double scaling_error(const BlockCurve& contact) {
  const ShellCompliance compliance(contact.dimension);
  double worst = 0;
  for (std::size_t i = 0; i < contact.elements.size(); ++i)
    worst = std::max(worst, std::abs(contact.stiffness[0] / contact.stiffness[i] / compliance(contact.elements[i]) - 1));
  return worst;
}

}  // namespace palpate
