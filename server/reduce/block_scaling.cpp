#include "server/reduce/block_scaling.hpp"

#include <Eigen/Eigenvalues>
#include <cmath>

namespace palpate {
namespace {

struct Shells {
  double first = 0, growth = 0;  ///< c_d, a_d
};
constexpr Shells kShells[] = {{1, 0}, {0.55, 0.345}, {0.45, 0.397}};

}  // namespace

double shell_compliance(int dimension, int elements_to_end) {
  if (elements_to_end == kNoEnd) return std::numeric_limits<double>::infinity();
  const Shells& shells = kShells[dimension - 1];
  double sum = elements_to_end > 0 ? 1 : 0;
  for (int j = 2; j <= elements_to_end; ++j) sum += std::pow(shells.first + shells.growth * j, 1 - dimension);
  return sum;
}

double block_scale(int dimension, int elements_to_end) { return 1 / shell_compliance(dimension, elements_to_end); }

int dimension_of(const LumpedBody& body) {
  Mat3 spread = Mat3::Zero();
  for (const Element& e : body.elements) {
    const Vec3 direction = (body.nodes[e.b] - body.nodes[e.a]).normalized();
    spread += direction * direction.transpose();
  }
  constexpr double kFlat = 1e-9;
  const Vec3 extents = Eigen::SelfAdjointEigenSolver<Mat3>(spread).eigenvalues();
  return static_cast<int>((extents.array() > kFlat * extents[2]).count());
}

}  // namespace palpate
