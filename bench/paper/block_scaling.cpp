#include "bench/paper/block_scaling.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cassert>
#include <cmath>

namespace palpate {
namespace {

struct Shells {
  double first = 0, growth = 0;  ///< c_d, a_d
};
constexpr Shells kShells[] = {{1, 0}, {0.529, 0.3475}, {0.4506, 0.3964}};  // d = 1: exact; 2, 3: fitted to lattices

/// Returns the nodes in layer j around a node of a half space's face (a half plane's edge, a row's end).
double half_space_nodes(int dimension, int j) { return dimension == 1 ? 1 : dimension == 2 ? 4 * j + 1 : 12 * j * j + 4 * j + 1; }

}  // namespace

double shell_compliance(int dimension, int shell) {
  assert(dimension >= 1 && dimension <= 3 && shell >= 1);
  const Shells& shells = kShells[dimension - 1];
  return shell == 1 ? 1 : std::pow(shells.first + shells.growth * shell, 1 - dimension);
}

ShellCompliance::ShellCompliance(int dimension, const std::vector<int>& layer_nodes)
    : dimension_(dimension), layer_nodes_(layer_nodes) {}

double ShellCompliance::cut(int shell) const {
  if (layer_nodes_.size() < 3) return 1;
  const auto nodes = [&](int j) {
    const auto last = layer_nodes_.size() - 1;
    return static_cast<double>(layer_nodes_[std::min(static_cast<std::size_t>(j), last)]);
  };
  const auto half_space = [&](int j) { return half_space_nodes(dimension_, j) + half_space_nodes(dimension_, j + 1); };
  return half_space(shell) / half_space(1) * (nodes(1) + nodes(2)) / (nodes(shell) + nodes(shell + 1));
}

double ShellCompliance::operator()(int elements) const {
  double sum = 0;
  for (int j = 1; j <= elements; ++j) sum += shell_compliance(dimension_, j) * cut(j);
  return sum;
}

int dimension_of(const LumpedBody& body) {
  Mat3 spread = Mat3::Zero();
  for (const Element& e : body.elements) {
    const Vec3 direction = (body.nodes[e.b] - body.nodes[e.a]).normalized();
    spread += direction * direction.transpose();
  }
  constexpr double kExtentRounding = 1e-9;  // of the largest: rounding in the spread of parallel elements
  const Vec3 extents = Eigen::SelfAdjointEigenSolver<Mat3>(spread).eigenvalues();
  return static_cast<int>((extents.array() > kExtentRounding * extents[2]).count());
}

}  // namespace palpate
